// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A real flight (EuRoC V1_01_easy) drives a simulated LiDAR: its poses become the truth, its IMU
// samples the bag's.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "mlvi/io/euroc.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/io/tum.h"
#include "mlvi/sim/recording.h"
#include "temporary_folder.h"

#ifdef MLVI_BINARY

namespace mlvi {
namespace {

constexpr double kSeconds = 3.0, kLonger = 100.0;

class RecordedMotion : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = std::filesystem::path(MLVI_SHARED_DATA_DIR) / "euroc_v1_01";
    if (!std::filesystem::exists(folder / "imu.csv"))
      GTEST_SKIP() << "no EuRoC V1_01 in " << folder;
    truth_file_ = folder / "groundtruth.csv";
    imu_file_ = folder / "imu.csv";
    flown_ = ReadEurocGroundTruth(truth_file_).value();
  }

  // Into output_; the flight begins in the middle of the laboratory.
  void Simulate(const std::string& arguments, double seconds) {
    const std::string command = std::string(MLVI_BINARY) +
                                " simulate room-01 --rig euroc_os0 --cameras none --start "
                                "5.3,4.2,1.2,90 --seconds " +
                                std::to_string(seconds) + " " + arguments + " -o " +
                                output_.path().string() + " >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
  Trajectory Truth() const { return ReadTum(output_.path() / "groundtruth.tum").value(); }

  // From the clock of the flight to that of the recording.
  Duration Shift() const { return SequenceOptions().begin - flown_.front().stamp; }

  // The truth of the recording is the flight, moved as a whole about the vertical.
  void ExpectTheFlight(const Trajectory& truth) const {
    ASSERT_GT(truth.size(), 100U * static_cast<std::size_t>(kSeconds));
    const Pose3 T_world_flight = truth.front().pose * flown_.front().T_world_body.inverse();
    EXPECT_NEAR(T_world_flight.R()(2, 2), 1.0, 1e-4) << "tilted";
    std::size_t compared = 0, next = 0;
    double squares = 0.0, largest_angle = 0.0;
    for (const NavState& state : flown_) {
      const Time stamp = state.stamp + Shift();
      while (next < truth.size() && truth[next].stamp < stamp) ++next;
      if (next == truth.size()) break;
      if (truth[next].stamp - stamp > Duration::FromNanoseconds(100'000)) continue;
      const Pose3 expected = T_world_flight * state.T_world_body;
      squares += (truth[next].pose.translation() - expected.translation()).squaredNorm();
      largest_angle =
          std::max(largest_angle, truth[next].pose.rotation().angularDistance(expected.rotation()));
      ++compared;
    }
    ASSERT_GT(compared, 20U);
    // The spline passes through the poses; text holds them to 1e-6 m and 1e-9.
    EXPECT_LT(std::sqrt(squares / static_cast<double>(compared)), 1e-5);
    EXPECT_LT(largest_angle, 0.01 * std::numbers::pi / 180.0);
  }

  test::TemporaryFolder output_{"recorded_motion"};
  std::string truth_file_, imu_file_;
  std::vector<NavState> flown_;
};

TEST_F(RecordedMotion, FlightAndImuOfEuroc) {
  Simulate("--trajectory " + truth_file_ + " --imu " + imu_file_, kSeconds);
  ExpectTheFlight(Truth());
  // Every IMU sample of the flight is in the bag as it was measured.
  const Rig rig = LoadRig((output_.path() / "rig.yaml").string()).value();
  auto source = RosBagSource::Open({output_.path() / "room-01.bag"}, rig).value();
  const std::vector<ImuSample> measured = ReadEurocImu(imu_file_).value();
  auto expected = measured.begin();
  std::size_t samples = 0, sweeps = 0;
  while (auto next = source->Next().value()) {
    sweeps += std::holds_alternative<LidarSweep>(*next);
    const auto* sample = std::get_if<ImuSample>(&*next);
    if (sample == nullptr) continue;
    if (samples++ == 0) {
      while (expected != measured.end() && expected->stamp + Shift() < sample->stamp) ++expected;
    }
    ASSERT_NE(expected, measured.end());
    EXPECT_EQ(sample->stamp, expected->stamp + Shift());
    EXPECT_EQ(sample->angular_velocity, expected->angular_velocity);
    EXPECT_EQ(sample->linear_acceleration, expected->linear_acceleration);
    ++expected;
  }
  EXPECT_NEAR(static_cast<double>(samples), 200.0 * kSeconds, 2.0);
  EXPECT_NEAR(static_cast<double>(sweeps), 10.0 * kSeconds, 1.0);
  std::ifstream file(output_.path() / "sequence.json");
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["recorded_imu"], imu_file_);
  EXPECT_TRUE(json["noise"]["imu"].is_null()) << "noise that nobody has added";
  EXPECT_EQ(json["trajectory_start"]["position"], nlohmann::json({5.3, 4.2, 1.2}));
  const auto bias = json["bias_at_begin"]["gyroscope_rad_s"].get<std::vector<double>>();
  EXPECT_LT((Eigen::Vector3d(bias.data()) - flown_.front().bias.gyroscope).norm(), 1e-4);
}

TEST_F(RecordedMotion, PosesFromATumFile) {
  Trajectory poses;
  for (const NavState& state : flown_) {
    if (state.stamp - flown_.front().stamp > Duration::FromSeconds(kSeconds + 1.0)) break;
    poses.push_back({.stamp = state.stamp, .pose = state.T_world_body});
  }
  const std::string path = output_.path() / "flight.tum";
  ASSERT_TRUE(WriteTum(poses, path, "").has_value());
  Simulate("--trajectory " + path, kSeconds);
  ExpectTheFlight(Truth());
  std::ifstream file(output_.path() / "sequence.json");
  EXPECT_EQ(nlohmann::json::parse(file)["trajectory"], path);
}

// A recording cannot be longer than its motion, nor pass through walls.
TEST_F(RecordedMotion, EndsWithTheFlightAndStaysOutOfWalls) {
  Trajectory poses;
  for (int i = 0; i <= 20; ++i) {
    poses.push_back({.stamp = Time::FromNanoseconds(1'000'000'000LL + 100'000'000LL * i),
                     .pose = Pose3::FromTranslation({0.05 * i, 0.0, 0.0})});
  }
  const std::string path = output_.path() / "straight.tum";
  ASSERT_TRUE(WriteTum(poses, path, "").has_value());
  Simulate("--trajectory " + path, kLonger);
  EXPECT_NEAR(static_cast<double>(Truth().size()), 201.0, 6.0);
  for (StampedPose& pose : poses)
    pose.pose = Pose3::FromTranslation(10.0 * pose.pose.translation());  // 10 m: through a wall
  ASSERT_TRUE(WriteTum(poses, path, "").has_value());
  const std::string command = std::string(MLVI_BINARY) +
                              " simulate room-01 --rig euroc_os0 --cameras none --start "
                              "5.3,4.2,1.2,90 --trajectory " +
                              path + " -o " + output_.path().string() + " >/dev/null 2>&1";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
}

}  // namespace
}  // namespace mlvi

#endif
