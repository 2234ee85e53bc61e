// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <numbers>

#include "mlvi/base/parallel.h"
#include "mlvi/sensors/camera_model.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Heard {
  std::vector<ImuSample> imu;
  std::vector<LidarSweep> sweeps;
  std::vector<Time> available;
};

Heard Listen(Recording& recording) {
  Heard heard;
  while (auto measurement = recording.Next().value()) {
    heard.available.push_back(AvailableAt(*measurement));
    if (const auto* imu = std::get_if<ImuSample>(&*measurement)) heard.imu.push_back(*imu);
    if (auto* sweep = std::get_if<LidarSweep>(&*measurement))
      heard.sweeps.push_back(std::move(*sweep));
  }
  return heard;
}

// A fingerprint of all bits of a sweep.
std::uint64_t Fingerprint(const LidarSweep& sweep) {
  std::uint64_t hash = static_cast<std::uint64_t>(sweep.stamp.nanoseconds());
  const auto add = [&](std::uint64_t bits) { hash = (hash ^ bits) * 0x100000001b3ULL; };
  for (const LidarPoint& p : sweep.points) {
    for (int axis = 0; axis < 3; ++axis) add(std::bit_cast<std::uint32_t>(p.position[axis]));
    add(std::bit_cast<std::uint32_t>(p.intensity));
    add(static_cast<std::uint64_t>(p.offset_ns));
    add(p.ring);
  }
  return hash;
}

TEST(Recording, SameBitsOnEveryRunAndAtEveryNumberOfThreads) {
  const auto run = [](int threads) {
    const ThreadLimit limit(threads);
    Recording recording(StandardSequence("courtyard-hard", test::NewerCollege(), 0.5, 7));
    std::vector<std::uint64_t> prints;
    const Heard heard = Listen(recording);
    for (const LidarSweep& sweep : heard.sweeps) prints.push_back(Fingerprint(sweep));
    for (const ImuSample& imu : heard.imu)
      prints.push_back(std::bit_cast<std::uint64_t>(imu.linear_acceleration.x()));
    return prints;
  };
  const auto one = run(1);
  EXPECT_EQ(one.size(), 5U + 101U);
  EXPECT_EQ(one, run(2));
  EXPECT_EQ(one, run(2));
}

// The same with everything that is drawn at random on top: an operator, relief, vibration, jitter.
TEST(Recording, SameBitsWithAllItsImperfections) {
  const auto run = [](int threads) {
    const ThreadLimit limit(threads);
    SequenceOptions options = StandardSequence("quad-hard", test::NewerCollege(), 0.3, 7);
    options.clocks = {{"imu", {.offset = 4e-3, .jitter = 2e-3}},
                      {"lidar", {.offset = 1e-3, .jitter = 5e-4}}};
    Recording recording(options);
    EXPECT_TRUE(recording.options().carried && HasErrors(recording.options().imu_errors));
    EXPECT_FALSE(recording.lidar().pattern().physics.plane_surfaces);
    std::vector<std::uint64_t> prints;
    const Heard heard = Listen(recording);
    for (const LidarSweep& sweep : heard.sweeps) prints.push_back(Fingerprint(sweep));
    for (const ImuSample& imu : heard.imu) {
      prints.push_back(static_cast<std::uint64_t>(imu.stamp.nanoseconds()));
      prints.push_back(std::bit_cast<std::uint64_t>(imu.angular_velocity.x()));
    }
    return prints;
  };
  const auto one = run(1);
  EXPECT_EQ(one.size(), 3U + 2U * 61U);
  EXPECT_EQ(one, run(2));
}

// Two small cameras on the Newer College rig: 20 and 10 Hz, 2 ms behind the IMU's clock.
Rig WithCameras() {
  Rig rig = test::NewerCollege();
  for (const int i : {0, 1}) {
    CameraSpec spec{.name = "cam" + std::to_string(i), .topic = "/cam" + std::to_string(i)};
    spec.model =
        MakeCameraModel("equidistant", 96, 72, {47.0, 47.0, 47.5, 35.5}, {0.0, 0.0, 0.0, 0.0})
            .value();
    // Looks ahead and to the right of a body with x ahead, y right, z down.
    const Eigen::Quaterniond ahead(0.5, 0.5, 0.5, 0.5);
    spec.T_body_camera = Pose3(i == 0 ? ahead : ExpSo3({0.0, 0.0, 1.57}) * ahead, {0.05, 0.0, 0.0});
    spec.rate_hz = i == 0 ? 20.0 : 10.0;
    spec.time_offset = Duration::FromMilliseconds(2);
    rig.cameras.push_back(spec);
  }
  return rig;
}

std::vector<Image> ImagesOf(Recording& recording) {
  std::vector<Image> images;
  while (auto measurement = recording.Next().value()) {
    if (auto* image = std::get_if<Image>(&*measurement)) images.push_back(std::move(*image));
  }
  return images;
}

TEST(Recording, TakesImagesAtTheRatesAndStampsOfTheRig) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithCameras(), 1.0);
  options.cameras = {"cam0", "cam1"};
  options.camera_physics.colour = true;
  for (const RecordingForm form : {RecordingForm::kMeasurements, RecordingForm::kMessages}) {
    Recording recording(options, form);
    const bool messages = form == RecordingForm::kMessages;
    const std::vector<Image> images = ImagesOf(recording);
    std::array<std::vector<Time>, 2> stamps;
    for (const Image& image : images) {
      stamps.at(static_cast<std::size_t>(image.camera)).push_back(image.stamp);
      ASSERT_EQ(image.channels, messages ? 3 : 1);  // grey is what estimators get
      ASSERT_EQ(image.pixels.size(), static_cast<std::size_t>(96 * 72 * image.channels));
    }
    EXPECT_EQ(stamps[0].size(), 20U);
    EXPECT_EQ(stamps[1].size(), 10U);
    EXPECT_EQ(recording.Counts().at("/cam0").delivered, 20);
    EXPECT_EQ(stamps[0][2] - stamps[0][0], Duration::FromMilliseconds(100));
    EXPECT_EQ(stamps[0][0], stamps[1][0]) << "one trigger";
    const Time middle = recording.cameras()[0].TimeOf(0);
    EXPECT_EQ(stamps[0][0], messages ? middle - Duration::FromMilliseconds(2) : middle);
  }
}

TEST(Recording, CamerasMayBeTriggeredLater) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithCameras(), 0.5);
  options.cameras = {"cam0", "cam1"};
  options.faults.triggers["cam1"] = 0.03;
  const Recording recording(options);
  EXPECT_EQ(recording.cameras()[1].TimeOf(0) - recording.cameras()[0].TimeOf(0),
            Duration::FromMilliseconds(30));
}

// Of the camera that was named, in its window; readers drop them.
TEST(Recording, CorruptedImagesAreWrittenButNotDelivered) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithCameras(), 1.0);
  options.cameras = {"cam0", "cam1"};
  options.image_rate = 5.0;
  options.faults.cameras = {{"cam1", CameraFailure::kCorrupted, {.start = 0.3, .length = 0.4}}};
  Recording messages(options, RecordingForm::kMessages), measurements(options);
  std::array<int, 2> images{}, corrupted{};
  while (const auto measurement = messages.Next().value()) {
    const auto* image = std::get_if<Image>(&*measurement);
    if (image == nullptr) continue;
    ++images.at(static_cast<std::size_t>(image->camera));
    corrupted.at(static_cast<std::size_t>(image->camera)) += messages.IsCorrupted(*measurement);
  }
  EXPECT_THAT(images, ::testing::ElementsAre(5, 5));
  EXPECT_THAT(corrupted, ::testing::ElementsAre(0, 2));
  EXPECT_EQ(ImagesOf(measurements).size(), 8U);
  EXPECT_EQ(measurements.Counts().at("/cam1").dropped.at("unreadable message"), 2);
  EXPECT_TRUE(measurements.Counts().at("/cam0").dropped.empty());
}

// cam0 dies, cam1 freezes, its lens is dirty, exposures jump.
TEST(Recording, CamerasFailAsOrdered) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithCameras(), 1.0);
  options.cameras = {"cam0", "cam1"};
  options.image_rate = 10.0;
  Recording intact(options);
  options.faults.cameras = {{"cam0", CameraFailure::kDead, {.start = 0.5, .length = 1.0}},
                            {"cam1", CameraFailure::kFrozen, {.start = 0.25, .length = 0.3}}};
  options.faults.lens_patches = {{.camera = "cam1", .radius = 0.2}};
  options.faults.exposure_jump = ExposureJump{.window = {0.75, 0.1}, .factor = 3.0};
  Recording faulty(options);
  const auto images = [](Recording& recording) {
    std::array<std::vector<Image>, 2> result;
    while (auto measurement = recording.Next().value()) {
      if (auto* image = std::get_if<Image>(&*measurement))
        result[static_cast<std::size_t>(image->camera)].push_back(std::move(*image));
    }
    return result;
  };
  const auto expected = images(intact), found = images(faulty);
  const auto mean = [](const Image& image) {
    double sum = 0.0;
    for (const std::uint8_t pixel : image.pixels) sum += pixel;
    return sum / static_cast<double>(image.pixels.size());
  };
  EXPECT_EQ(found[0].size(), 5U);
  EXPECT_EQ(found[0][2].pixels, expected[0][2].pixels);
  ASSERT_EQ(found[1].size(), expected[1].size());
  for (const std::size_t i : {4, 5}) {  // 0.3 to 0.5 s: three times the same image
    EXPECT_EQ(found[1][i].pixels, found[1][3].pixels);
    EXPECT_EQ(found[1][i].stamp, expected[1][i].stamp);
  }
  EXPECT_NE(found[1][6].pixels, found[1][3].pixels);
  EXPECT_LT(mean(found[1][0]), mean(expected[1][0]));
  EXPECT_GT(mean(found[1][8]), mean(expected[1][8]));
}

TEST(Recording, CamerasLeaveTheOtherSensorsAlone) {
  const auto fingerprints = [](const std::vector<std::string>& cameras, int threads) {
    const ThreadLimit limit(threads);
    SequenceOptions options = StandardSequence("courtyard-hard", WithCameras(), 0.4, 3);
    options.cameras = cameras;
    Recording recording(options);
    std::vector<std::uint64_t> prints;
    std::map<int, std::vector<std::vector<std::uint8_t>>> images;
    while (auto measurement = recording.Next().value()) {
      if (const auto* sweep = std::get_if<LidarSweep>(&*measurement))
        prints.push_back(Fingerprint(*sweep));
      if (auto* image = std::get_if<Image>(&*measurement))
        images[image->camera].push_back(std::move(image->pixels));
    }
    return std::pair(prints, images);
  };
  const auto all = fingerprints({"cam0", "cam1"}, 1), one = fingerprints({"cam1"}, 2),
             none = fingerprints({}, 2);
  EXPECT_FALSE(all.second.at(0).empty());
  EXPECT_EQ(all.first, none.first);
  EXPECT_EQ(all.second.at(1), one.second.at(1)) << "an image depends on other cameras or threads";
}

TEST(Recording, SeedsAndSensorsAreIndependent) {
  const auto first_imu = [](std::uint64_t seed, const std::string& sequence) {
    Recording recording(StandardSequence(sequence, test::NewerCollege(), 0.2, seed));
    return Listen(recording).imu.front().linear_acceleration;
  };
  EXPECT_NE(first_imu(1, "courtyard-easy"), first_imu(2, "courtyard-easy"));
}

TEST(Recording, HandsMeasurementsOutInTheOrderOfArrival) {
  Recording recording(StandardSequence("courtyard-easy", test::Hilti(), 1.0));
  const Heard heard = Listen(recording);
  EXPECT_EQ(heard.imu.size(), 401U);
  EXPECT_EQ(heard.sweeps.size(), 10U);
  EXPECT_TRUE(std::is_sorted(heard.available.begin(), heard.available.end()));
  EXPECT_DOUBLE_EQ(recording.Progress(), 1.0);
  EXPECT_EQ(recording.Counts().at("/points").delivered, 10);
}

TEST(Recording, SweepsReadAsFromAFile) {
  Recording recording(StandardSequence("courtyard-easy", test::M2dgr(), 0.3));
  for (const LidarSweep& sweep : Listen(recording).sweeps) {
    ASSERT_GT(sweep.points.size(), 10000U);
    std::int32_t first = std::numeric_limits<std::int32_t>::max(), last = 0;
    for (const LidarPoint& p : sweep.points) {
      ASSERT_TRUE(p.position.allFinite() && p.position.norm() > 0.1F);
      first = std::min(first, p.offset_ns);
      last = std::max(last, p.offset_ns);
    }
    EXPECT_EQ(first, 0);
    EXPECT_EQ(sweep.span.nanoseconds(), last);
  }
}

TEST(Recording, FaultsHappenWhereOrdered) {
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr(), 2.0);
  options.faults.lidar_gap = FaultWindow{.start = 0.25, .length = 0.3};
  options.faults.imu_gap = FaultWindow{.start = 0.6, .length = 0.2};
  options.faults.empty_sweeps = FaultWindow{.start = 0.85, .length = 0.2};
  options.faults.nan_points = FaultWindow{.start = 1.25, .length = 0.1};
  options.faults.time_jump = TimeJump{.start = 1.5, .back = 0.4};
  options.faults.imu_in_g = true;
  Recording recording(options, RecordingForm::kMessages);
  const Heard heard = Listen(recording);
  const std::size_t rays = recording.lidar().pattern().rays.size();
  ASSERT_EQ(heard.sweeps.size(), 20U - 3U);
  EXPECT_EQ(heard.imu.size(), 301U - 30U);
  EXPECT_NEAR(heard.imu[0].linear_acceleration.norm(), 9.81 / 9.80665, 0.1);
  std::size_t empty = 0, spoilt = 0, backwards = 0;
  for (std::size_t i = 0; i < heard.sweeps.size(); ++i) {
    ASSERT_EQ(heard.sweeps[i].points.size(), rays);
    std::size_t returns = 0, nans = 0;
    for (const LidarPoint& p : heard.sweeps[i].points) {
      returns += p.position.allFinite() && !p.position.isZero(0.0F);
      nans += p.position.hasNaN();
    }
    empty += returns == 0;
    spoilt += nans > 0;
    if (nans > 0) {
      const auto n = static_cast<double>(rays);
      EXPECT_NEAR(static_cast<double>(nans), 0.1 * n, 5.0 * std::sqrt(0.09 * n));
    }
    backwards += i > 0 && heard.sweeps[i].stamp < heard.sweeps[i - 1].stamp;
  }
  EXPECT_EQ(empty, 2U);
  EXPECT_EQ(spoilt, 1U);
  EXPECT_EQ(backwards, 1U);
}

TEST(Recording, MeasurementFormMendsWhatAReaderMends) {
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr(), 0.2);
  options.faults.imu_in_g = true;
  options.faults.nan_points = FaultWindow{.start = 0.0, .length = 1.0};
  Recording recording(options);
  const Heard heard = Listen(recording);
  EXPECT_NEAR(heard.imu[0].linear_acceleration.norm(), 9.81, 0.6);
  for (const LidarPoint& p : heard.sweeps[0].points) ASSERT_TRUE(p.position.allFinite());
}

class Walks : public ::testing::TestWithParam<std::tuple<std::string, int>> {};

// The whole walk: 0.3 m of free space around the body, and the angular rates that the profile
// promises.
TEST_P(Walks, AreFreeAndMoveAsPromised) {
  const auto& [sequence, seed] = GetParam();
  const Recording recording(
      StandardSequence(sequence, test::M2dgr(), 0.0, static_cast<std::uint64_t>(seed)));
  EXPECT_GT(recording.Clearance(), 0.3);
  const Time moving = recording.begin() + Duration::FromSeconds(4.0);
  const MotionStatistics m = MeasureMotion(recording.motion(), moving, recording.end());
  const bool hard = sequence.ends_with("hard");
  RecordProperty("mean_deg_s", std::to_string(m.mean_rate / kDegree));
  RecordProperty("p95_deg_s", std::to_string(m.p95_rate / kDegree));
  RecordProperty("max_deg_s", std::to_string(m.max_rate / kDegree));
  if (hard) {
    EXPECT_THAT(m.max_rate, ::testing::AllOf(::testing::Ge(3.0), ::testing::Le(4.0)));
    EXPECT_THAT(m.max_acceleration, ::testing::AllOf(::testing::Ge(7.0), ::testing::Le(10.0)));
  } else {
    // Newer College quad-easy has mean 13, p95 26, max 51 deg/s; eight half turns on the stairs add
    // to that.
    const bool stairs = sequence.starts_with("corridor");
    EXPECT_THAT(m.mean_rate / kDegree,
                ::testing::AllOf(::testing::Ge(10.0), ::testing::Le(stairs ? 20.0 : 15.0)));
    EXPECT_THAT(m.p95_rate / kDegree,
                ::testing::AllOf(::testing::Ge(20.0), ::testing::Le(stairs ? 45.0 : 32.0)));
    EXPECT_THAT(m.max_rate / kDegree, ::testing::AllOf(::testing::Ge(30.0), ::testing::Le(65.0)));
    EXPECT_LT(m.max_acceleration, 6.0);
  }
  EXPECT_THAT(m.mean_speed, ::testing::AllOf(::testing::Ge(0.8), ::testing::Le(1.7)));
}

INSTANTIATE_TEST_SUITE_P(Catalogue, Walks,
                         ::testing::Combine(::testing::Values("courtyard-easy", "courtyard-hard",
                                                              "corridor-easy", "corridor-hard"),
                                            ::testing::Values(1, 2)));

TEST(Recording, RestsFirst) {
  const Recording recording(StandardSequence("courtyard-hard", test::NewerCollege(), 4.0));
  const MotionStatistics rest = MeasureMotion(recording.motion(), recording.begin(),
                                              recording.begin() + Duration::FromSeconds(1.9));
  EXPECT_LT(rest.max_rate, 1e-9);
  EXPECT_LT(rest.max_acceleration, 1e-9);
  SequenceOptions moving = StandardSequence("courtyard-easy", test::NewerCollege(), 4.0);
  moving.rest = 0.0;
  EXPECT_GT(Recording(moving).GroundTruth(moving.begin).v_world_body.norm(), 0.8);
}

TEST(Recording, CarriesTheLidarUpright) {
  for (const Rig& rig : {test::NewerCollege(), test::M2dgr(), test::Hilti()}) {
    const Recording recording(StandardSequence("courtyard-easy", rig, 1.0));
    const NavState state = recording.GroundTruth(recording.begin());
    const Eigen::Vector3d up =
        (state.T_world_body * rig.lidar->T_body_lidar).rotation() * Eigen::Vector3d::UnitZ();
    EXPECT_GT(up.z(), 0.999) << rig.name;
    // The walk starts along +x; the body's x axis points ahead.
    EXPECT_GT((state.T_world_body.rotation() * Eigen::Vector3d::UnitX()).x(), 0.9) << rig.name;
  }
}

// Cameras on a body whose z axis looks ahead: it is carried as they look, not along its x or y axis,
// unless they look all around.
TEST(Recording, CarriesCamerasAhead) {
  Rig rig = test::NewerCollege();
  // x up, y right, z ahead, as on EuRoC's robot; the LiDAR is upright.
  const Eigen::Matrix3d upright = Eigen::Vector3d::UnitZ() * Eigen::RowVector3d::UnitX() -
                                  Eigen::Vector3d::UnitY() * Eigen::RowVector3d::UnitY() +
                                  Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitZ();
  rig.lidar->T_body_lidar = Pose3(Eigen::Quaterniond(upright), {});
  const auto ahead = [&](const std::vector<double>& angles) {
    rig.cameras.clear();
    for (const double degrees : angles) {  // of the optical axis from z to the right
      const Pose3 mount(ExpSo3({-degrees * kDegree, 0.0, 0.0}), {});
      rig.cameras.push_back({.name = "c", .T_body_camera = mount});
    }
    return (CarriedOrientation(rig).conjugate() * Eigen::Vector3d::UnitX()).eval();
  };
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  EXPECT_LT((ahead({0.0, 2.0, 90.0, -89.0}) - z).norm(), 1e-9);
  EXPECT_LT((ahead({175.0}) + z).norm(), 1e-9);
  EXPECT_LT((ahead({45.0}) - (y + z).normalized()).norm(), 1e-9);
  EXPECT_LT((ahead({0.0, 90.0, 180.0, 271.0}) - y).norm(), 1e-9);
  EXPECT_LT((ahead({}) - y).norm(), 1e-9);
}

TEST(Recording, FollowsARecordedTrajectory) {
  std::vector<Time> stamps;
  std::vector<Pose3> poses;
  for (int i = 0; i <= 100; ++i) {  // 10 s straight on at 0.5 m/s, somewhere else, at another time
    stamps.push_back(Time::FromNanoseconds(1'000'000'000LL + 100'000'000LL * i));
    poses.emplace_back(ExpSo3({0.0, 0.0, 2.0}),
                       Eigen::Vector3d(100.0, 50.0, 3.0) +
                           0.05 * i * Eigen::Vector3d(std::cos(2.0), std::sin(2.0), 0.0));
  }
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr());
  options.trajectory = FitPoseSpline(stamps, poses).value();
  const Recording recording(options);
  EXPECT_NEAR((recording.end() - recording.begin()).seconds(), 10.0, 0.06);
  const Pose3 start = recording.GroundTruth(recording.begin()).T_world_body;
  const Pose3 later =
      recording.GroundTruth(recording.begin() + Duration::FromSeconds(4.0)).T_world_body;
  EXPECT_LT((start.translation() - Eigen::Vector3d(0.0, -10.5, 1.4)).norm(), 0.1);
  EXPECT_LT((later.translation() - start.translation() - Eigen::Vector3d(2.0, 0.0, 0.0)).norm(),
            0.02);
}

TEST(CheckOptions, NamesWhatIsWrong) {
  SequenceOptions options = StandardSequence("courtyard-esay", test::NewerCollege());
  EXPECT_THAT(CheckOptions(options).error().message, ::testing::HasSubstr("'courtyard-easy'"));
  options = StandardSequence("courtyard-easy", test::NewerCollege());
  options.rig.true_rig.lidar->model = "OS7";
  EXPECT_THAT(CheckOptions(options).error().message, ::testing::HasSubstr("OS0-128"));
  EXPECT_THROW(Recording recording(options), ContractViolation);
  options = StandardSequence("courtyard-easy", WithCameras());
  options.cameras = {"cam0", "cam7"};
  EXPECT_THAT(CheckOptions(options).error().message, ::testing::HasSubstr("cam0, cam1"));
  options.cameras = {"cam0"};
  options.faults.triggers["cam7"] = 0.03;
  EXPECT_THAT(CheckOptions(options).error().message, ::testing::HasSubstr("cam0, cam1"));
}

}  // namespace
}  // namespace mlvi
