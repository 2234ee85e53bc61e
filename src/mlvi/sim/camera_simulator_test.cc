// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "mlvi/base/parallel.h"
#include "mlvi/sim/lidar_simulator.h"
#include "mlvi/sim/mesh_builder.h"

namespace mlvi {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const Time kBegin = Time::FromNanoseconds(1'000'000'000'000);

Material Plain(const std::string& name, float albedo) {
  return {.name = name,
          .texture = {.light = Eigen::Vector3f::Constant(albedo),
                      .dark = Eigen::Vector3f::Constant(albedo)}};
}

// Even light of 1000 lux everywhere, no shadows.
Lighting EvenLight() {
  return {.sun_illuminance = 0.0, .sky_illuminance = 0.0, .ambient_illuminance = 1000.0};
}

// No noise, no vignetting, linear; grey value 250 for a luminance of 1000 / pi * 0.8.
CameraPhysics Ideal() {
  return {.lens_gain = 1.0,
          .electrons_per_lux_second = 1e12,
          .full_well = 1000.0 / std::numbers::pi * 0.8 * 1e9 * 255.0 / 250.0,
          .read_noise = 0.0,
          .gamma = 1.0,
          .corner_brightness = 1.0};
}

const std::vector<std::shared_ptr<const CameraModel>>& Lenses() {
  static const std::vector<std::shared_ptr<const CameraModel>> lenses = {
      // Newer College collection 3 cam0, LVI-SAM's MEI camera, and double sphere and pinhole lenses
      // of like size.
      MakeCameraModel("equidistant", 720, 540, {353.835, 353.081, 354.960, 261.966},
                      {-0.03908623683636908, -0.008364734078508202, 0.006865315014140142,
                       -0.0022325156415695015})
          .value(),
      MakeCameraModel(
          "mei", 720, 540,
          {1.9926618269451453, 669.8940458885896, 669.1450614220616, 377.9459252967363,
           279.63655686698144},
          {-0.0399258932468764, 0.15160828121223818, 1.7756967825777937e-4, -1.1531239076798612e-3})
          .value(),
      MakeCameraModel("double_sphere", 720, 540, {-0.2, 0.59, 280.0, 280.0, 361.0, 268.0}, {})
          .value(),
      MakeCameraModel("pinhole_radtan", 720, 540, {420.0, 421.0, 362.0, 271.0},
                      {-0.25, 0.08, 1e-4, -2e-4})
          .value()};
  return lenses;
}

// A camera that looks along +x of the world, y of the image down; `turn` turns it further (its own
// frame).
Pose3 LookingAhead(const Eigen::Vector3d& position,
                   const Eigen::Vector3d& turn = Eigen::Vector3d::Zero()) {
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return Pose3(Eigen::Quaterniond(R) * ExpSo3(turn), position);
}

// The body stands at `pose` for a second around kBegin; the camera is the body.
PoseSpline Standing(const Pose3& pose) {
  return PoseSpline(kBegin - Duration::FromMilliseconds(500), Duration::FromMilliseconds(100),
                    std::vector<Pose3>(14, pose));
}
// It turns about its own axes by `rate` rad/s and moves at `velocity` m/s in the world, meeting
// `pose` at kBegin.
PoseSpline Moving(const Pose3& pose, const Eigen::Vector3d& rate, const Eigen::Vector3d& velocity) {
  std::vector<Pose3> poses;
  for (int i = -6; i <= 7; ++i) {
    const double t = 0.1 * i;
    poses.emplace_back(pose.rotation() * ExpSo3(t * rate), pose.translation() + t * velocity);
  }
  return PoseSpline(kBegin - Duration::FromMilliseconds(500), Duration::FromMilliseconds(100),
                    std::move(poses));
}

CameraSimulator Camera(const std::shared_ptr<const CameraModel>& lens, const CameraPhysics& physics,
                       std::uint64_t seed = 1) {
  return CameraSimulator({.name = "cam", .model = lens}, physics, RandomStream(seed, "cam"));
}

double GreyAt(const Image& image, double x, double y) {
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const double a = x - i, b = y - j;
  const auto at = [&](int column, int row) -> double {
    return image.pixels.at(static_cast<std::size_t>(row * image.width + column));
  };
  return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) +
         b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
}

// Signed distance, px, from the pixel to where the grey value crosses the middle between dark and
// bright along `across` (unit; towards bright), or NaN when it does not within 3 px.
double EdgeOffset(const Image& image, const Eigen::Vector2d& pixel, const Eigen::Vector2d& across,
                  double middle) {
  for (double s = -3.0; s < 3.0; s += 0.05) {
    const Eigen::Vector2d a = pixel + s * across, b = pixel + (s + 0.05) * across;
    const double low = GreyAt(image, a.x(), a.y()), high = GreyAt(image, b.x(), b.y());
    if (low <= middle && high > middle) return s + 0.05 * (middle - low) / (high - low);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// White squares of 0.8 m on a black wall 4 m ahead, and their edges.
struct Board {
  TriangleMesh mesh;
  std::vector<std::array<Eigen::Vector3d, 3>> edges;  // start, end, a point inside of the square
};
Board MakeBoard() {
  MeshBuilder builder;
  const MaterialId black = builder.AddMaterial(Plain("black", 0.1F)),
                   white = builder.AddMaterial(Plain("white", 0.8F));
  builder.AddQuad({4.01, -30, -30}, {4.01, 30, -30}, {4.01, 30, 30}, {4.01, -30, 30}, black);
  Board board;
  for (double y = -5.0; y <= 5.0; y += 2.5) {
    for (double z = -3.0; z <= 3.0; z += 1.5) {
      const Eigen::Vector3d middle(4.0, y, z);
      std::array<Eigen::Vector3d, 4> corners;
      for (int k = 0; k < 4; ++k) {
        const double angle = 0.2 + 0.5 * std::numbers::pi * k;
        corners[static_cast<std::size_t>(k)] =
            middle + 0.55 * Eigen::Vector3d(0.0, std::cos(angle), std::sin(angle));
      }
      builder.AddQuad(corners[0], corners[1], corners[2], corners[3], white);
      for (std::size_t k = 0; k < 4; ++k)
        board.edges.push_back({corners[k], corners[(k + 1) % 4], middle});
    }
  }
  board.mesh = std::move(builder).Finish();
  return board;
}

struct EdgeErrors {
  std::vector<double> offsets;  // px
  double worst() const {
    double result = 0.0;
    for (const double o : offsets) result = std::max(result, std::abs(o));
    return result;
  }
  double rms() const {
    double sum = 0.0;
    for (const double o : offsets) sum += o * o;
    return std::sqrt(sum / static_cast<double>(offsets.size()));
  }
};

EdgeErrors MeasureEdges(const Board& board, const Image& image, const CameraModel& lens,
                        const Pose3& T_world_camera) {
  const Pose3 T_camera_world = T_world_camera.inverse();
  const double middle = 0.5 * (0.1 + 0.8) / 0.8 * 250.0;
  EdgeErrors errors;
  for (const auto& [start, end, inside] : board.edges) {
    for (const double share : {0.2, 0.35, 0.5, 0.65, 0.8}) {
      const Eigen::Vector3d point = start + share * (end - start);
      const auto pixel = lens.Project(T_camera_world * point);
      const auto onward = lens.Project(T_camera_world * (point + 0.01 * (end - start)));
      const auto inner = lens.Project(T_camera_world * (point + 0.05 * (inside - point)));
      if (!pixel || !onward || !inner || !lens.InImage(*pixel, 6.0)) continue;
      if ((*onward - *pixel).norm() < 0.3) continue;  // a square of a few pixels at the rim
      const Eigen::Vector2d along = (*onward - *pixel).normalized();
      Eigen::Vector2d across(-along.y(), along.x());
      if (across.dot(*inner - *pixel) < 0.0) across = -across;
      errors.offsets.push_back(EdgeOffset(image, *pixel, across, middle));
    }
  }
  return errors;
}

class EveryLens : public ::testing::TestWithParam<int> {};

// Whole chain against the lens model's own projection, at poses in general position.
TEST_P(EveryLens, EdgesLieWhereTheirPointsProject) {
  const auto& lens = Lenses()[static_cast<std::size_t>(GetParam())];
  const Board board = MakeBoard();
  const World world(board.mesh, EvenLight());
  const SceneRenderer renderer(world);
  const CameraSimulator camera = Camera(lens, Ideal());
  const Pose3 pose = LookingAhead({0.1, -0.2, 0.15}, {0.05, -0.08, 0.3});
  const Image image = camera.Render(renderer, Standing(pose), kBegin, 0, {.seconds = 1e-3});
  const EdgeErrors errors = MeasureEdges(board, image, *lens, pose);
  ASSERT_GT(errors.offsets.size(), 100U);
  RecordProperty("rms_px", std::to_string(errors.rms()));
  RecordProperty("worst_px", std::to_string(errors.worst()));
  EXPECT_LT(errors.worst(), 0.3);
  EXPECT_LT(errors.rms(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Lenses, EveryLens, ::testing::Range(0, 4));

TEST(CameraSimulator, SeesBehindItselfThroughAWideLens) {
  const auto lens =
      MakeCameraModel("equidistant", 400, 400, {100.0, 100.0, 199.5, 199.5}, {0, 0, 0, 0}).value();
  MeshBuilder builder;
  const MaterialId black = builder.AddMaterial(Plain("black", 0.02F)),
                   white = builder.AddMaterial(Plain("white", 0.8F));
  builder.AddBox({0, 0, -20}, {40, 40, 40}, 0.0, black);
  builder.AddBox({-1.5, 4.0, -0.3}, {0.6, 0.6, 0.6}, 0.0, white);  // 110 degrees to the left
  const World world(std::move(builder).Finish(), EvenLight());
  const SceneRenderer renderer(world);
  const Pose3 pose = LookingAhead({0, 0, 0});
  const Image image =
      Camera(lens, Ideal()).Render(renderer, Standing(pose), kBegin, 0, {.seconds = 1e-3});
  const Eigen::Vector3d box_in_camera = pose.inverse() * Eigen::Vector3d(-1.5, 4.0, 0.0);
  ASSERT_LT(box_in_camera.z(), 0.0);
  const Eigen::Vector2d pixel = lens->Project(box_in_camera).value();
  ASSERT_TRUE(lens->InImage(pixel));
  EXPECT_NEAR(GreyAt(image, pixel.x(), pixel.y()), 250.0, 1.0);
  EXPECT_NEAR(GreyAt(image, 399.0 - pixel.x(), pixel.y()), 6.0, 1.0);
}

// Rough ground and walls that a textured place has.
World TexturedRoom() {
  MeshBuilder builder;
  const auto textured = [&](TexturePattern pattern) {
    return builder.AddMaterial(
        {.name = "wall",
         .texture = {.pattern = pattern, .light = {0.7F, 0.7F, 0.7F}, .dark = {0.1F, 0.1F, 0.1F}}});
  };
  const MaterialId stone = textured(TexturePattern::kStoneBlocks),
                   rock = textured(TexturePattern::kRock),
                   gravel = textured(TexturePattern::kGravel),
                   posters = textured(TexturePattern::kPosters);
  builder.AddQuad({6, -8, -2}, {6, 8, -2}, {6, 8, 4}, {6, -8, 4}, stone);
  builder.AddQuad({-8, 8, -2}, {6, 8, -2}, {6, 8, 4}, {-8, 8, 4}, rock);
  builder.AddQuad({-8, -8, -2}, {6, -8, -2}, {6, -8, 4}, {-8, -8, 4}, posters);
  builder.AddQuad({-8, -8, -2}, {6, -8, -2}, {6, 8, -2}, {-8, 8, -2}, gravel);
  builder.AddQuad({-8, -8, 4}, {6, -8, 4}, {6, 8, 4}, {-8, 8, 4}, stone);
  return World(std::move(builder).Finish(), EvenLight());
}

// Shift of the 13 x 13 patch around `a` of one image to `b` of the other, beyond b - a, by one
// Gauss-Newton iteration after another; NaN where there is too little texture.
Eigen::Vector2d PatchShift(const Image& one, const Eigen::Vector2d& a, const Image& two,
                           const Eigen::Vector2d& b) {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int iteration = 0; iteration < 5; ++iteration) {
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    for (int dy = -6; dy <= 6; ++dy) {
      for (int dx = -6; dx <= 6; ++dx) {
        const Eigen::Vector2d p = a + Eigen::Vector2d(dx, dy),
                              q = b + shift + Eigen::Vector2d(dx, dy);
        const Eigen::Vector2d slope(
            0.5 * (GreyAt(one, p.x() + 1, p.y()) - GreyAt(one, p.x() - 1, p.y())),
            0.5 * (GreyAt(one, p.x(), p.y() + 1) - GreyAt(one, p.x(), p.y() - 1)));
        H += slope * slope.transpose();
        g += slope * (GreyAt(one, p.x(), p.y()) - GreyAt(two, q.x(), q.y()));
      }
    }
    if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(H).eigenvalues()[0] < 169.0 * 25.0)
      return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    shift += H.inverse() * g;
  }
  return shift;
}

// No shimmer: textures move as the points that they lie on, in near and far, flat and grazing
// places.
TEST(CameraSimulator, FlowOfStaticPointsFollowsTheTruth) {
  const World world = TexturedRoom();
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  const CameraSimulator camera = Camera(lens, Ideal());
  const Pose3 first = LookingAhead({0, 0, 0}),
              second = LookingAhead({0.02, 0.013, 0.008}, {0.004, -0.006, 0.002});
  const Image one = camera.Render(renderer, Standing(first), kBegin, 0, {.seconds = 1e-3});
  const Image two = camera.Render(renderer, Standing(second), kBegin, 1, {.seconds = 1e-3});
  std::vector<double> errors;
  for (int row = 40; row < 500; row += 20) {
    for (int column = 40; column < 680; column += 20) {
      const Eigen::Vector2d pixel(column, row);
      const Eigen::Vector3d ray = first.rotation() * lens->Unproject(pixel).value();
      const auto hit = world.Cast(first.translation(), ray, 100.0);
      if (!hit) continue;
      const auto moved = lens->Project(second.inverse() * (first.translation() + hit->range * ray));
      if (!moved || !lens->InImage(*moved, 10.0)) continue;
      const double error = PatchShift(one, pixel, two, *moved).norm();
      if (std::isfinite(error)) errors.push_back(error);
    }
  }
  ASSERT_GT(errors.size(), 200U);
  std::sort(errors.begin(), errors.end());
  RecordProperty("median_px", std::to_string(errors[errors.size() / 2]));
  RecordProperty("p90_px", std::to_string(errors[errors.size() * 9 / 10]));
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.2);
}

TEST(CameraSimulator, LidarPointsLieOnTheSameEdges) {
  const Board board = MakeBoard();
  TriangleMesh mesh = board.mesh;
  mesh.materials[0].reflectivity = 0.2;
  mesh.materials[1].reflectivity = 0.8;
  const World world(std::move(mesh), EvenLight());
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  const Pose3 T_world_camera = LookingAhead({0, 0, 0});
  const Image image = Camera(lens, Ideal())
                          .Render(renderer, Standing(T_world_camera), kBegin, 0, {.seconds = 1e-3});
  LidarPattern pattern = MakeLidarPattern("OS0-128").value();
  pattern.physics = IdealPhysics(pattern.physics);
  pattern.physics.beam_noise = pattern.physics.range_noise = 0.0;
  // The LiDAR at the camera's centre, upright.
  const Pose3 T_camera_lidar = T_world_camera.inverse();
  const LidarSimulator lidar(pattern, T_camera_lidar, RandomStream(1, "lidar"));
  const LidarSweep sweep = lidar.Sweep(world, Standing(T_world_camera), kBegin, 0);
  int seen = 0, wrong = 0;
  for (const LidarPoint& point : sweep.points) {
    if (point.position.isZero(0.0F)) continue;
    const Eigen::Vector3d in_camera = T_camera_lidar * point.position.cast<double>();
    const auto pixel = lens->Project(in_camera);
    if (!pixel || !lens->InImage(*pixel, 2.0)) continue;
    const double cosine = in_camera.z() / in_camera.norm();
    const bool white = point.intensity / (255.0 * cosine) > 0.5;
    // Some pixel within one of it must show the surface that the LiDAR measured.
    bool matches = false;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        matches |= (GreyAt(image, std::round(pixel->x()) + dx, std::round(pixel->y()) + dy) >
                    140.0) == white;
    ++seen;
    wrong += !matches;
  }
  EXPECT_GT(seen, 20000);
  EXPECT_EQ(wrong, 0);
}

// Photon transfer: mean and variance of grey values against the model, at several exposures and
// gains.
TEST(CameraSimulator, NoiseIsShotAndReadNoise) {
  MeshBuilder builder;
  builder.AddBox({0, 0, -5}, {10, 10, 10}, 0.0, builder.AddMaterial(Plain("grey", 0.5F)));
  const World world(std::move(builder).Finish(), EvenLight());
  const SceneRenderer renderer(world);
  CameraPhysics physics;
  physics.gamma = 1.0;
  physics.corner_brightness = 1.0;
  const auto lens =
      MakeCameraModel("equidistant", 200, 150, {80.0, 80.0, 99.5, 74.5}, {0, 0, 0, 0}).value();
  const CameraSimulator camera = Camera(lens, physics);
  // Noise of more than half a grey value, so that rounding adds its 1/12 to the variance.
  for (const Exposure exposure :
       {Exposure{2e-3, 1.0}, Exposure{4e-3, 1.0}, Exposure{1e-3, 4.0}, Exposure{1e-4, 12.0}}) {
    const Image image = camera.Render(renderer, Standing(Pose3()), kBegin, 0, exposure);
    const double electrons = 500.0 / std::numbers::pi * physics.lens_gain *
                             physics.electrons_per_lux_second * exposure.seconds;
    const double per_electron = 255.0 * exposure.gain / physics.full_well;
    const double variance =
        per_electron * per_electron * (electrons + physics.read_noise * physics.read_noise) +
        1.0 / 12.0;
    const auto n = static_cast<double>(image.pixels.size());
    double sum = 0.0, squares = 0.0;
    for (const std::uint8_t grey : image.pixels) sum += grey;
    for (const std::uint8_t grey : image.pixels) squares += (grey - sum / n) * (grey - sum / n);
    ASSERT_LT(per_electron * electrons, 240.0);
    EXPECT_NEAR(sum / n, per_electron * electrons, 5.0 * std::sqrt(variance / n) + 0.02);
    EXPECT_NEAR(squares / n, variance, 5.0 * variance * std::sqrt(2.0 / n));
  }
}

TEST(CameraSimulator, SameBitsAtAnyNumberOfThreadsAndInAnyOrder) {
  const World world = TexturedRoom();
  const auto lens =
      MakeCameraModel("equidistant", 120, 90, {60.0, 60.0, 59.5, 44.5}, {0, 0, 0, 0}).value();
  const PoseSpline motion = Moving(LookingAhead({0, 0, 0}), {0, 1.0, 0.3}, {0.5, 0, 0});
  const auto render = [&](int threads, std::vector<std::uint64_t> order) {
    const ThreadLimit limit(threads);
    const SceneRenderer renderer(world);
    const CameraSimulator camera = Camera(lens, CameraPhysics{});
    std::map<std::uint64_t, std::vector<std::uint8_t>> images;
    for (const std::uint64_t i : order)
      images[i] = camera
                      .Render(renderer, motion,
                              kBegin + Duration::FromMilliseconds(20 * static_cast<int>(i)), i,
                              {.seconds = 8e-3})
                      .pixels;
    return images;
  };
  const auto one = render(1, {0, 1, 2});
  EXPECT_EQ(one, render(2, {2, 0, 1}));
  EXPECT_NE(one.at(0), one.at(1));
}

// An edge that passes by during the exposure becomes a ramp as long as its way.
TEST(CameraSimulator, MotionBlurIsAsLongAsTheWay) {
  MeshBuilder builder;
  const MaterialId black = builder.AddMaterial(Plain("black", 0.1F)),
                   white = builder.AddMaterial(Plain("white", 0.8F));
  builder.AddQuad({4, -30, -30}, {4, 0, -30}, {4, 0, 30}, {4, -30, 30}, black);
  builder.AddQuad({4, 0, -30}, {4, 30, -30}, {4, 30, 30}, {4, 0, 30}, white);
  const World world(std::move(builder).Finish(), EvenLight());
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  const double rate = 1.5, seconds = 12e-3;  // 6 px in the middle of the image
  const PoseSpline motion = Moving(LookingAhead({0, 0, 0}), {0, rate, 0}, Eigen::Vector3d::Zero());
  CameraPhysics physics = Ideal();
  physics.full_well *= seconds / 1e-3;
  const Image image =
      Camera(lens, physics).Render(renderer, motion, kBegin, 0, {.seconds = seconds});
  // White on the left. The ramp's length is its area over the step where it is straight.
  const double way = rate * seconds * 353.8, x = 354.96, y = 262.0;
  const auto share = [&](double at) { return (GreyAt(image, at, y) - 31.25) / (250.0 - 31.25); };
  EXPECT_NEAR(share(x), 0.5, 0.06);
  EXPECT_NEAR(share(x - 0.25 * way), 0.75, 0.08);
  EXPECT_NEAR(share(x + 0.25 * way), 0.25, 0.08);
  EXPECT_NEAR(share(x - 0.5 * way - 1.5), 1.0, 0.02);
  EXPECT_NEAR(share(x + 0.5 * way + 1.5), 0.0, 0.02);
}

// A white square that flies across at 4 m by `velocity` m/s (along -y: to the right in images).
World FlyingSquare(double velocity) {
  MeshBuilder wall, square;
  wall.AddQuad({6, -30, -30}, {6, 30, -30}, {6, 30, 30}, {6, -30, 30},
               wall.AddMaterial(Plain("black", 0.1F)));
  Material white = Plain("white", 0.8F);
  white.reflectivity = 0.9;
  square.AddQuad({0, -0.5, -0.5}, {0, 0.5, -0.5}, {0, 0.5, 0.5}, {0, -0.5, 0.5},
                 square.AddMaterial(white));
  World world(std::move(wall).Finish(), EvenLight(),
              {{.name = "square",
                .parts = {std::move(square).Finish()},
                .poses = [velocity](double seconds, std::span<Pose3> T_world_part) {
                  T_world_part[0] = Pose3(Eigen::Quaterniond::Identity(),
                                          Eigen::Vector3d(4.0, 0.6 - velocity * seconds, 0.2));
                }}});
  world.StartClock(kBegin);
  return world;
}

TEST(CameraSimulator, MovingObjectsAreSeenWhereTheyAre) {
  constexpr double kVelocity = 3.0;
  const World world = FlyingSquare(kVelocity);
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  const Pose3 pose = LookingAhead({0, 0, 0});
  CameraPhysics physics = Ideal();
  physics.electrons_per_lux_second *= 100.0;  // an exposure of 10 us: no blur
  for (const double seconds : {0.0, 0.2, 0.4}) {
    const Image image = Camera(lens, physics)
                            .Render(renderer, Standing(pose),
                                    kBegin + Duration::FromSeconds(seconds), 0, {.seconds = 1e-5});
    const Eigen::Vector3d centre(4.0, 0.6 - kVelocity * seconds, 0.2);
    const auto corner = [&](double y, double z) -> Eigen::Vector3d {
      return centre + Eigen::Vector3d(0.0, y, z);
    };
    const Board board{.edges = {{corner(-0.5, -0.5), corner(-0.5, 0.5), centre},
                                {corner(0.5, -0.5), corner(0.5, 0.5), centre},
                                {corner(-0.5, 0.5), corner(0.5, 0.5), centre}}};
    const EdgeErrors errors = MeasureEdges(board, image, *lens, pose);
    ASSERT_EQ(errors.offsets.size(), 15U);
    EXPECT_LT(errors.worst(), 0.3) << seconds;
  }
  // The LiDAR meets it at each firing's own time.
  LidarPattern pattern = MakeLidarPattern("OS0-128").value();
  pattern.physics = IdealPhysics(pattern.physics);
  pattern.physics.beam_noise = pattern.physics.range_noise = 0.0;
  const LidarSimulator lidar(pattern, pose.inverse(), RandomStream(1, "lidar"));
  const LidarSweep sweep = lidar.Sweep(world, Standing(pose), kBegin, 0);
  int on_it = 0;
  for (const LidarPoint& point : sweep.points) {
    if (point.position.x() < 3.9F || point.position.x() > 4.1F) continue;
    const double y = 0.6 - kVelocity * 1e-9 * point.offset_ns;
    EXPECT_LE(std::abs(point.position.y() - y), 0.5 + 0.02);  // a beam is 3 mm wide there
    ++on_it;
  }
  EXPECT_GT(on_it, 500);
}

// The camera stands still: only what moves is blurred.
TEST(CameraSimulator, MovingObjectsBlurAlongTheirWay) {
  constexpr double kVelocity = 8.0, kSeconds = 10e-3;  // 7 px
  const World world = FlyingSquare(kVelocity);
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  CameraPhysics physics = Ideal();
  physics.full_well *= kSeconds / 1e-3;
  const Pose3 pose = LookingAhead({0, 0, 0});
  const Image image =
      Camera(lens, physics).Render(renderer, Standing(pose), kBegin, 0, {.seconds = kSeconds});
  const auto share = [&](double y) {
    const auto pixel = lens->Project(pose.inverse() * Eigen::Vector3d(4.0, y, 0.2));
    return (GreyAt(image, pixel->x(), pixel->y()) - 31.25) / (250.0 - 31.25);
  };
  const double way = kVelocity * kSeconds;  // m
  for (const double side : {-1.0, 1.0}) {   // the edge ahead and the one behind
    const double edge = 0.6 + 0.5 * side;
    EXPECT_NEAR(share(edge), 0.5, 0.1);
    EXPECT_NEAR(share(edge - 0.25 * side * way), 0.75, 0.1);
    EXPECT_NEAR(share(edge + 0.25 * side * way), 0.25, 0.1);
    EXPECT_NEAR(share(edge - side * (0.5 * way + 0.02)), 1.0, 0.02);
    EXPECT_NEAR(share(edge + side * (0.5 * way + 0.02)), 0.0, 0.02);
  }
}

TEST(CameraSimulator, RollingShutterSlantsWhatPassesBy) {
  const Board board = MakeBoard();
  const World world(board.mesh, EvenLight());
  const SceneRenderer renderer(world);
  const auto& lens = Lenses()[0];
  CameraPhysics physics = Ideal();
  physics.row_time = Duration::FromNanoseconds(20'000);
  physics.electrons_per_lux_second *= 100.0;  // an exposure of 10 us: no blur
  const Eigen::Vector3d rate(0.0, 0.8, 0.0);
  const PoseSpline motion = Moving(LookingAhead({0, 0, 0}), rate, Eigen::Vector3d::Zero());
  const Image image = Camera(lens, physics).Render(renderer, motion, kBegin, 0, {.seconds = 1e-5});
  // Each edge point at the pose of its own row, against the pose of the first one.
  double rolling = 0.0, global = 0.0;
  int count = 0;
  for (const auto& edge : board.edges) {
    const Eigen::Vector3d point = 0.5 * (edge[0] + edge[1]);
    const auto first = lens->Project(motion.PoseAt(kBegin).inverse() * point);
    if (!first || !lens->InImage(*first, 20.0)) continue;
    const auto offset_at = [&](Time time) {
      const Board one{.edges = {edge}};
      return MeasureEdges(one, image, *lens, motion.PoseAt(time)).rms();
    };
    const double late = offset_at(kBegin + physics.row_time * static_cast<int>(first->y()));
    if (!std::isfinite(late)) continue;
    const double early = offset_at(kBegin);
    rolling = std::max(rolling, late);
    if (std::isfinite(early)) global = std::max(global, early);
    ++count;
  }
  ASSERT_GT(count, 20);
  EXPECT_LT(rolling, 0.35);  // the row itself shifts by a pixel or two: 0.02 px
  EXPECT_GT(global, 1.0);    // 500 rows late: 2.8 px
}

TEST(CameraSimulator, ExposureFollowsTheLightWithItsLag) {
  MeshBuilder builder;
  builder.AddBox({0, 0, -5}, {10, 10, 10}, 0.0, builder.AddMaterial(Plain("grey", 0.5F)));
  // The light goes down to a hundredth at the world's second 1.
  const World world(std::move(builder).Finish(),
                    {.sun_illuminance = 0.0,
                     .sky_illuminance = 0.0,
                     .lamps = {{.position = {0.0, 0.0, 2.0}, .intensity = 20000.0}},
                     .lamp_level = [](double seconds) { return seconds < 1.0 ? 1.0 : 0.01; }});
  const SceneRenderer renderer(world);
  const CameraSimulator camera = Camera(Lenses()[0], CameraPhysics{});
  const PoseSpline still(Time::FromNanoseconds(0), Duration::FromMilliseconds(1000),
                         std::vector<Pose3>(8));
  std::vector<CameraSimulator::Metering> meterings;
  for (int i = 0; i < 120; ++i)
    meterings.push_back(camera.Meter(renderer, still, Time::FromNanoseconds(33'333'333LL * i)));
  const auto exposures = camera.ControlExposure(meterings, 1.0 / 30.0);
  const auto product = [&](std::size_t i) { return exposures[i].seconds * exposures[i].gain; };
  EXPECT_NEAR(product(0), product(29), 0.02 * product(0));
  EXPECT_NEAR(product(30), product(0), 0.02 * product(0)) << "before the change is metered";
  // After one time constant 63 % of the way in powers of the exposure; clipping does not apply
  // here.
  const double way = std::log(product(30 + 8) / product(0)) / std::log(product(119) / product(0));
  EXPECT_THAT(way, ::testing::AllOf(::testing::Ge(0.5), ::testing::Le(0.75)));
  EXPECT_NEAR(product(119) / product(0), 100.0, 5.0);
  EXPECT_LE(exposures[119].seconds, CameraPhysics{}.max_exposure);
}

// Lamps, what they light, their shades and the lamp that is carried: all go off together.
TEST(CameraSimulator, NothingShinesWhenTheLampsAreOff) {
  MeshBuilder builder;
  const MaterialId grey = builder.AddMaterial(Plain("grey", 0.5F));
  Material shade = Plain("lamp", 0.5F);
  shade.emission = 2000.0;
  const MaterialId lamp = builder.AddMaterial(shade);
  builder.AddQuad({5, -5, 0}, {5, -5, 4}, {5, 5, 4}, {5, 5, 0}, grey);  // a wall
  builder.AddQuad({-1, -1, 3.9}, {-1, 1, 3.9}, {1, 1, 3.9}, {1, -1, 3.9}, lamp);
  const World world(std::move(builder).Finish(),
                    {.sun_illuminance = 0.0,
                     .sky_illuminance = 0.0,
                     .lamps = {{.position = {0.0, 0.0, 3.5}, .intensity = 100.0}},
                     .lamp_level = [](double seconds) { return seconds < 1.0 ? 1.0 : 0.0; },
                     .carried_lamp_intensity = 50.0});
  const SceneRenderer renderer(world);
  const Eigen::Vector3d eye(0.5, 0.0, 1.0);
  const auto luminance = [&](double seconds, const Eigen::Vector3d& direction) {
    const auto moment = renderer.At(Time::FromNanoseconds(0) + Duration::FromSeconds(seconds), eye);
    return renderer
        .Trace(moment, {.origin = eye,
                        .direction = direction.normalized().cast<float>(),
                        .pixel_angle = 1e-3F})
        .luminance.mean();
  };
  EXPECT_GT(luminance(0.5, {0.0, 0.0, 1.0}), 2000.0);
  EXPECT_GT(luminance(0.5, {1.0, 0.0, 0.0}), 0.1);
  EXPECT_LT(luminance(1.5, {0.0, 0.0, 1.0}), 1e-12);
  EXPECT_LT(luminance(1.5, {1.0, 0.0, 0.0}), 1e-12);
}

TEST(CameraSimulator, ShadowsLieWhereTheSunThrowsThem) {
  MeshBuilder builder;
  const MaterialId grey = builder.AddMaterial(Plain("grey", 0.5F));
  builder.AddQuad({-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}, grey);
  builder.AddQuad({-1, -1, 3}, {1, -1, 3}, {1, 1, 3}, {-1, 1, 3}, grey);
  const Eigen::Vector3d sun = Eigen::Vector3d(1.0, 0.5, 2.0).normalized();
  const World world(std::move(builder).Finish(),
                    {.sun_direction = sun, .sun_illuminance = 1e5, .sky_illuminance = 1e4});
  const SceneRenderer renderer(world);
  const auto moment = renderer.At(kBegin, Eigen::Vector3d::Zero());
  const auto luminance = [&](double x, double y) {
    const Eigen::Vector3d from(3.0, -8.0, 2.0), to(x, y, 0.0);
    return renderer
        .Trace(moment, {.origin = from,
                        .direction = (to - from).normalized().cast<float>(),
                        .pixel_angle = 1e-3F})
        .luminance.mean();
  };
  // The roof's shadow lies 3 m down the sun's ray: at (-1.5, -0.75).
  EXPECT_LT(luminance(-1.5, -0.75), 0.3 * luminance(1.5, 1.5));
  EXPECT_LT(luminance(-2.45, -0.75), 0.5 * luminance(-2.55, -0.75));
  EXPECT_NEAR(luminance(8.0, 8.0), (1e5 * sun.z() + 1e4) * 0.5 / std::numbers::pi, 0.03 * 1.6e4);
}

}  // namespace
}  // namespace mlvi
