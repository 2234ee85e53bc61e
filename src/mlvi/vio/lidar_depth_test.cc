// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/lidar_depth.h"

#include <gtest/gtest.h>

#include "mlvi/panorama/testing.h"
#include "mlvi/vio/depth_testing.h"
#include "mlvi/vio/window_features.h"

namespace mlvi {
namespace {

constexpr double kNoise = 0.02;  // m, of ranges

// A rig that walks through the room with four cameras and a LiDAR whose odometry has a world of its
// own, placed anywhere in the window's.
class LidarDepthTest : public ::testing::Test {
 protected:
  LidarDepthTest() : model_(test::MakePanorama(MakeRig())) {
    window_.calibration.T_body_pano = model_.T_body_pano();
    for (int i = 0; i < model_.cameras(); ++i) {
      window_.calibration.T_pano_camera.push_back(model_.T_pano_camera(i));
      window_.calibration.time_offsets.push_back(0.0);
    }
    MakeFrames();
  }
  void MakeFrames() {
    window_.frames.clear();
    for (int i = 0; i <= 4; ++i) {
      WindowFrame frame{.id = FrameId(i), .imu = {}, .prior_state = {}};
      frame.state.stamp = At(0.1 * i);
      const Pose3 T_room_body = BodyInRoom(0.1 * i);
      const Eigen::Vector3d v_room(kSpeed, 0.0, 0.0);
      frame.state.T_world_body = T_window_room_ * T_room_body;
      frame.state.v_world_body = T_window_room_.rotation() * v_room;
      ImageMotion motion;
      motion.twist << T_room_body.rotation().conjugate() * v_room, 0.0, 0.0, turn_rate_;
      frame.images.assign(static_cast<std::size_t>(model_.cameras()), motion);
      window_.frames.push_back(frame);
    }
  }
  static Rig MakeRig() {
    Rig rig = test::RingRig(4, 0.1, test::MakeCamera(testing::NewerCollegeCalibrations()[0]));
    rig.p_body_pano = Eigen::Vector3d(0.02, 0.01, 0.05);
    return rig;
  }
  static Time At(double seconds) { return Time::FromSeconds(100.0 + seconds); }
  Pose3 BodyInRoom(double seconds) const {
    return Pose3(ExpSo3({0.02, -0.03, 0.5}) * ExpSo3({0.0, 0.0, turn_rate_ * seconds}),
                 {kSpeed * seconds - 0.5, 0.4, 0.1});
  }
  Pose3 BodyInLidarWorld(double seconds) const { return T_lidar_room_ * BodyInRoom(seconds); }

  static DepthConfig SmoothSurfaces() {
    DepthConfig config;
    config.roughness = config.incidence_noise = 0.0;
    return config;
  }
  // `T_moved`: the LiDAR odometry's world, moved.
  void AddSweeps(LidarDepth& depth, const Pose3& T_moved = Pose3()) const {
    for (const double seconds : {0.03, 0.13, 0.23, 0.33, 0.43}) {
      const Pose3 T_room_body = BodyInRoom(seconds), T_body_room = T_room_body.inverse();
      PointCloud sweep = test::ScanRoom(T_room_body, kNoise,
                                        RandomStream(static_cast<std::uint64_t>(1e3 * seconds)));
      for (Eigen::Vector3f& p : sweep) p = (T_body_room * p.cast<double>()).cast<float>();
      depth.Add(sweep, T_moved * BodyInLidarWorld(seconds), At(seconds));
    }
  }

  // Of a point of the room seen first in `first` and last in the newest frame; none where a camera
  // does not see it.
  std::optional<WindowFeature> MakeFeature(RandomStream& random, std::size_t first) const {
    const int camera = static_cast<int>(random.Uniform(0.0, model_.cameras() - 1e-9));
    const CameraModel& lens = model_.camera(camera);
    const auto seen = model_.Lift(camera, {random.Uniform(0.0, lens.width() - 1.0),
                                           random.Uniform(0.0, lens.height() - 1.0)});
    if (!seen) return std::nullopt;
    const Ray ray = InRoom(*seen, first);
    if (!test::IsOnOneSurface(ray)) return std::nullopt;
    const Eigen::Vector3d point = ray.At(test::RangeInRoom(ray.origin, ray.direction));
    const auto again = model_.ProjectPoint(camera, (Pano(4)).inverse() * point);
    const auto last = again ? model_.Lift(camera, *again) : std::nullopt;
    if (!last) return std::nullopt;
    WindowFeature feature{.track = TrackId(1), .observations = {}, .lidar = {}};
    feature.observations = {{FrameId(static_cast<int>(first)), *seen}, {FrameId(4), *last}};
    return feature;
  }
  // When the images were taken: of all cameras at once.
  Pose3 Pano(std::size_t frame) const {
    return BodyInRoom(0.1 * static_cast<double>(frame) + window_.calibration.time_offsets[0]) *
           model_.T_body_pano();
  }
  Ray InRoom(const PanoramicObservation& o, std::size_t frame) const {
    const Pose3 T = Pano(frame) * model_.T_pano_camera(o.camera);
    return {T.translation(), T.rotation() * o.bearing_camera};
  }

  // Measures 400 features, first seen in any frame, and compares with the room.
  void ExpectTrueDepths(LidarDepth depth = LidarDepth(SmoothSurfaces())) {
    AddSweeps(depth);
    RandomStream random(3);
    while (window_.features.size() < 400) {
      auto feature = MakeFeature(random, window_.features.size() % 4);
      if (!feature) continue;
      feature->track = TrackId(static_cast<std::int64_t>(window_.features.size()));
      window_.features.push_back(*feature);
    }
    const int found = depth.Associate(window_, config_);
    // Rings reach 45 degrees up and down; at corners of the picture cameras see farther.
    EXPECT_GT(found, 200);
    double squared = 0.0;
    int wrong = 0;
    for (const WindowFeature& feature : window_.features) {
      if (!feature.lidar) continue;
      const auto& anchor = feature.observations.front();
      const Ray ray = InRoom(anchor.observation, static_cast<std::size_t>(anchor.frame.value()));
      const double truth = 1.0 / test::RangeInRoom(ray.origin, ray.direction);
      const double z = (feature.lidar->inverse_depth - truth) / feature.lidar->sigma;
      squared += z * z;
      wrong += std::abs(z) > 4.0 ? 1 : 0;
      EXPECT_TRUE(feature.triangulated);
    }
    // Noise of beams and bearings is claimed and not there, so variances are on the careful side.
    EXPECT_LT(squared / found, 1.3);
    EXPECT_GT(squared / found, 0.1);
    EXPECT_LE(wrong, found / 100);
  }

  static constexpr double kSpeed = 0.8;
  inline static const Pose3 T_window_room_{ExpSo3({0.0, 0.0, 1.2}), {30.0, -20.0, 3.0}};
  inline static const Pose3 T_lidar_room_{ExpSo3({0.01, -0.02, -0.7}), {-5.0, 8.0, -1.0}};
  double turn_rate_ = 0.0;  // rad/s, about the body's z
  PanoramaModel model_;
  VioWindow window_;
  WindowConfig config_;
};

// Depths are along the ray of the feature's first observation, whichever camera and frame it was
// in, with the variance that they have.
TEST_F(LidarDepthTest, MeasuresAlongTheAnchorsRay) { ExpectTrueDepths(); }

// Images are taken off their stamps, while the rig turns by 1.7 degrees.
TEST_F(LidarDepthTest, LooksFromWhereTheImagesWereTaken) {
  turn_rate_ = 1.5;
  window_.calibration.time_offsets.assign(4, 0.02);
  MakeFrames();
  ExpectTrueDepths();
}

// A new start of the LiDAR odometry is placed somewhere else: of what it said before nothing stays.
TEST_F(LidarDepthTest, ForgetsWhenLidarOdometryStartsAnew) {
  LidarDepth depth(SmoothSurfaces());
  AddSweeps(depth, Pose3(ExpSo3({0.0, 0.0, 0.4}), {0.5, 0.3, 0.0}));
  depth.Clear();
  EXPECT_TRUE(depth.empty());
  ExpectTrueDepths(std::move(depth));
}

// Only what is seen now and has no depth yet is asked for, and nothing while the sweeps do not
// overlap the window.
TEST_F(LidarDepthTest, AsksForWhatIsInSight) {
  LidarDepth depth(DepthConfig{});
  RandomStream random(4);
  std::optional<WindowFeature> feature;
  while (!feature) feature = MakeFeature(random, 0);
  window_.features = {*feature};
  EXPECT_EQ(depth.Associate(window_, config_), 0);  // no sweep yet
  AddSweeps(depth);
  window_.features[0].observations.pop_back();
  EXPECT_EQ(depth.Associate(window_, config_), 0);  // out of sight
  for (WindowFrame& frame : window_.frames) {
    frame.state.stamp = frame.state.stamp - Duration::FromSeconds(10.0);
  }
  window_.features = {*feature};
  EXPECT_EQ(depth.Associate(window_, config_), 0);  // the window has not come to any sweep
}

}  // namespace
}  // namespace mlvi
