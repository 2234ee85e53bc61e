// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// `mlvi run` as its users meet it: real processes on simulated recordings, good ones and bad ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "mlvi/eval/evaluation.h"
#include "mlvi/io/bag_writer.h"
#include "mlvi/io/raw_bag_writer.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_serialization.h"
#include "mlvi/io/tum.h"
#include "mlvi/sim/recording.h"
#include "run_mlvi.h"
#include "summary_keys.h"
#include "temporary_folder.h"

namespace mlvi {
namespace {

namespace fs = std::filesystem;
using test::ProcessResult;
using test::ReadFile;
using test::RunMlvi;
using ::testing::HasSubstr;

constexpr double kSeconds = 6.0;
// Sweeps of the whole recording: the sequence rests for 2 s, in which the start is found.
constexpr int kSweeps = 59;

// A part of a recording of `seconds` by itself: its stamps lie in [from, to) seconds after the
// beginning, late by `late` against the true clock.
struct Part {
  double seconds = kSeconds, from = 0.0, to = 1e9, late = 0.0;
  std::size_t poses = 0;  // at least
};

class RunCommand : public ::testing::Test {
 protected:
  static Rig TestRig() {
    Expected<Rig> rig = LoadRig("m2dgr");
    EXPECT_TRUE(rig.has_value());
    return *rig;
  }

  RunCommand() {
    bag_ = (folder_ / "recording.bag").string();
    rig_ = (folder_ / "rig.yaml").string();
    EXPECT_TRUE(SaveRig(TestRig(), rig_));
  }

  // Alters a measurement (its time since the beginning in s), and tells whether it is kept.
  using Change = std::function<bool(Measurement&, double)>;

  void Simulate(const SequenceFaults& faults = {}, double seconds = kSeconds) {
    SequenceOptions options = StandardSequence("courtyard-easy", TestRig(), seconds, 5);
    options.faults = faults;
    Write(
        options, [](Measurement&, double) { return true; }, bag_);
  }

  void SimulateChanged(const Change& change, double seconds = kSeconds) {
    Write(StandardSequence("courtyard-easy", TestRig(), seconds, 5), change, bag_);
  }

  void Write(const SequenceOptions& options, const Change& change, const std::string& path) {
    Recording recording(options, RecordingForm::kMessages);
    auto writer = BagWriter::Create(path, recording.rig());
    ASSERT_TRUE(writer.has_value()) << writer.error().message;
    while (true) {
      auto next = recording.Next();
      ASSERT_TRUE(next.has_value());
      if (!*next) break;
      if (!change(**next, (AvailableAt(**next) - recording.begin()).seconds())) continue;
      ASSERT_TRUE((*writer)->Write(**next));
    }
    ASSERT_TRUE((*writer)->Close());
  }

  void UseRig(const Rig& rig) { ASSERT_TRUE(SaveRig(rig, rig_)); }

  ProcessResult Run(const std::string& extra = "") { return RunOn(bag_, extra); }
  ProcessResult RunOn(const std::string& bags, const std::string& extra = "") {
    return RunMlvi("run " + bags + " --rig " + rig_ + " -o " + Output() + " " + extra);
  }
  std::string Reason() const { return Summary()["reason"].get<std::string>(); }
  std::string Output() const { return (folder_ / "result").string(); }
  nlohmann::json Summary() const {
    return nlohmann::json::parse(ReadFile(folder_ / "result" / "summary.json"), nullptr, false);
  }
  Trajectory Estimate(const std::string& name = "trajectory.tum") const {
    const auto trajectory = ReadTum((folder_ / "result" / name).string());
    return trajectory ? *trajectory : Trajectory{};
  }

  // se3-aligned rmse of the estimate against the simulator's truth, m.
  double Ate(const Part& part = {}, const std::string& name = "trajectory.tum") const {
    const Recording recording(StandardSequence("courtyard-easy", TestRig(), part.seconds, 5));
    Trajectory estimate, truth;
    for (const StampedPose& pose : Estimate(name)) {
      const double t = (pose.stamp - recording.begin()).seconds();
      if (t < part.from || t >= part.to) continue;
      estimate.push_back(pose);
      const Time instant = pose.stamp - Duration::FromSeconds(part.late);
      truth.push_back({.stamp = pose.stamp, .pose = recording.GroundTruth(instant).T_world_body});
    }
    const auto evaluation = Evaluate(estimate, truth, {});
    return evaluation && estimate.size() >= part.poses ? evaluation->absolute_translation.rmse
                                                       : 1e9;
  }

  // All promised results are there and agree with one another.
  void ExpectResults(const std::string& status, int at_least_poses) {
    const nlohmann::json summary = Summary();
    ASSERT_TRUE(summary.is_object());
    EXPECT_EQ(summary["status"], status) << summary["reason"];
    EXPECT_EQ(summary["resets"], 0);
    EXPECT_GE(static_cast<int>(Estimate().size()), at_least_poses);
    EXPECT_EQ(Estimate("odometry.tum").size(), Estimate().size());
    for (const char* name : {"map.ply", "map.png", "config.yaml"}) {
      EXPECT_GT(fs::file_size(folder_ / "result" / name), 100U) << name;
    }
  }

  test::TemporaryFolder temporary_{"run"};
  fs::path folder_ = temporary_.path();
  std::string bag_, rig_;
};

TEST_F(RunCommand, WholeRecordingIsUsedAndRepeatsBitByBitAtAnyThreadCount) {
  Simulate();
  const ProcessResult result = Run("--threads 1");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  ExpectResults("ok", kSweeps);
  EXPECT_LT(Ate(), 0.015);
  // Nothing is promised that is not there.
  EXPECT_EQ(ReadFile(folder_ / "result" / "map.ply").substr(0, 400).find("intensity"),
            std::string::npos);
  const std::string trajectory = ReadFile(folder_ / "result" / "trajectory.tum");
  const std::string odometry = ReadFile(folder_ / "result" / "odometry.tum");
  const std::string map = ReadFile(folder_ / "result" / "map.ply");
  for (const char* threads : {"--threads 2", "--threads 1", "--threads 4"}) {
    EXPECT_EQ(Run(threads).exit_code, 0);
    EXPECT_TRUE(trajectory == ReadFile(folder_ / "result" / "trajectory.tum")) << threads;
    EXPECT_TRUE(odometry == ReadFile(folder_ / "result" / "odometry.tum")) << threads;
    EXPECT_TRUE(map == ReadFile(folder_ / "result" / "map.ply")) << threads;
  }
}

TEST_F(RunCommand, TruncatedBagKeepsWhatWasEstimated) {
  Simulate();
  fs::resize_file(bag_, fs::file_size(bag_) * 7 / 10);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_THAT(result.output, HasSubstr("input_truncated"));
  ExpectResults("input_truncated", kSweeps / 2);
  EXPECT_LT(Ate(), 0.015);
}

TEST_F(RunCommand, ZeroByteFile) {
  std::ofstream(bag_).close();
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("empty"));
}

TEST_F(RunCommand, FileThatIsNoBag) {
  std::ofstream(bag_) << std::string(10000, 'x');
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("is no ROS 1 bag"));
}

TEST_F(RunCommand, MissingFile) {
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr(bag_));
}

TEST_F(RunCommand, MissingTopicNamesThoseThatAreThere) {
  Simulate({}, 2.0);
  Rig rig = TestRig();
  const std::string there = rig.lidar->topic;
  rig.lidar->topic = "/velodyne_pts";
  ASSERT_TRUE(SaveRig(rig, rig_));
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("/velodyne_pts"));
  EXPECT_THAT(result.output, HasSubstr(there));
}

TEST_F(RunCommand, UnknownPointLayoutNamesItsFields) {
  auto bag = RawBagWriter::Create(bag_, BagCompression::kNone);
  ASSERT_TRUE(bag.has_value());
  const Rig rig = TestRig();
  PointCloud2Data cloud;
  cloud.fields = {{"distance_mm", 0, PointDatatype::kFloat32, 1}};
  cloud.point_step = 4;
  cloud.width = 10;
  cloud.data.resize(40);
  for (int i = 0; i < 5; ++i) {
    cloud.stamp = Time::FromSeconds(100.0 + i);
    ASSERT_TRUE((*bag)->Write(rig.lidar->topic, cloud.stamp, PointCloud2Message(cloud)));
    ASSERT_TRUE((*bag)->Write(rig.imu.topic, cloud.stamp, ImuMessage({.stamp = cloud.stamp})));
  }
  ASSERT_TRUE((*bag)->Close());
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_THAT(result.output, HasSubstr("distance_mm"));
}

TEST_F(RunCommand, NanPointsAreDroppedAndCounted) {
  Simulate({.nan_points = FaultWindow{0.0, kSeconds}});
  EXPECT_EQ(Run().exit_code, 0);
  ExpectResults("ok", kSweeps);
  EXPECT_THAT(Summary()["messages"].dump(), HasSubstr("NaN"));
  EXPECT_LT(Ate(), 0.015);
}

TEST_F(RunCommand, EmptySweepsAreCountedAndTheEstimateGoesOn) {
  Simulate({.empty_sweeps = FaultWindow{3.0, 0.5}});
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  ExpectResults("degraded", kSweeps - 6);
  const nlohmann::json lidar = Summary()["streams"]["lidar"];
  EXPECT_EQ(lidar["dropped"]["no valid point"], 5);
  // The gap is explained, not only seen.
  EXPECT_THAT(Reason(), HasSubstr("sweeps dropped ('no valid point' 5"));
  EXPECT_THAT(result.output, HasSubstr("messages these were dropped: 'no valid point' 5"));
  EXPECT_LT(Ate(), 0.015);
}

TEST_F(RunCommand, AccelerationsInGravitiesAreConvertedAndNoted) {
  Simulate({.imu_in_g = true});
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(Summary()["notes"].dump(), HasSubstr("taken as g and converted"));
  ExpectResults("ok", kSweeps);
  EXPECT_LT(Ate(), 0.015);
}

TEST_F(RunCommand, AnImuWithoutGravityIsAFailureOfTheInput) {
  SimulateChanged(
      [](Measurement& measurement, double) {
        if (auto* sample = std::get_if<ImuSample>(&measurement))
          sample->linear_acceleration.setZero();
        return true;
      },
      4.0);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_EQ(Summary()["status"], "failed");
  EXPECT_EQ(Summary()["streams"]["imu"]["health"], "failed");
  EXPECT_THAT(Reason(), HasSubstr("imu: accelerations of 0.000 m/s^2 on average, gravity is 9.79"));
}

TEST_F(RunCommand, AnImuOfNansIsNamedAsSuch) {
  SimulateChanged(
      [](Measurement& measurement, double) {
        if (auto* sample = std::get_if<ImuSample>(&measurement))
          sample->linear_acceleration.y() = std::nan("");
        return true;
      },
      3.0);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_EQ(Summary()["status"], "input_unusable");
  EXPECT_THAT(Reason(), HasSubstr("451 of 451 were dropped ('NaN or infinite' 451)"));
}

TEST_F(RunCommand, EveryThirdImuSampleMissing) {
  SimulateChanged([k = 0](Measurement& measurement, double) mutable {
    return !std::holds_alternative<ImuSample>(measurement) || ++k % 3 != 0;
  });
  EXPECT_EQ(Run().exit_code, 0);
  ExpectResults("degraded", kSweeps);
  EXPECT_THAT(Reason(), HasSubstr("imu: 33 % of the samples are missing between others (100.0 Hz "
                                  "arrive, imu.rate_hz is 150)"));
}

TEST_F(RunCommand, RatesThatContradictTheRig) {
  Simulate();
  Rig rig = TestRig();
  rig.imu.rate_hz = 20.0;
  rig.lidar->rate_hz = 1.0;
  UseRig(rig);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(Summary()["status"], "degraded");
  EXPECT_THAT(Reason(), HasSubstr("imu: samples come at 150.0 Hz, but imu.rate_hz is 20"));
  EXPECT_THAT(Reason(), HasSubstr("lidar: sweeps come at 10.0 Hz, but lidar.rate_hz is 1"));
  EXPECT_NEAR(Summary()["streams"]["imu"]["rate_hz"].get<double>(), 150.0, 0.1);
}

TEST_F(RunCommand, ALidarMountedUpsideDownIsNoted) {
  Simulate({}, 10.0);
  Rig rig = TestRig();
  rig.lidar->T_body_lidar = rig.lidar->T_body_lidar *
                            Pose3(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d::Zero());
  UseRig(rig);
  const ProcessResult result = Run();
  EXPECT_EQ(Summary()["status"], "degraded") << result.output;
  EXPECT_EQ(Summary()["odometry"]["health"], "degraded");
  EXPECT_THAT(Reason(), HasSubstr("lidar.T_body_lidar"));
}

TEST_F(RunCommand, AMountThatIsATenthOfATurnOffIsMeasured) {
  Simulate({}, 10.0);
  Rig rig = TestRig();
  rig.lidar->T_body_lidar =
      rig.lidar->T_body_lidar *
      Pose3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())),
            Eigen::Vector3d::Zero());
  UseRig(rig);
  Run();
  EXPECT_EQ(Summary()["status"], "degraded");
  EXPECT_THAT(Reason(), HasSubstr("rotations by the LiDAR are turned by"));
}

TEST_F(RunCommand, ALidarWhoseClockIsLateIsMeasured) {
  const auto delay = [](Measurement& measurement, double) {
    if (auto* sweep = std::get_if<LidarSweep>(&measurement))
      sweep->stamp = sweep->stamp + Duration::FromMilliseconds(10);
    return true;
  };
  Write(StandardSequence("courtyard-hard", TestRig(), kSeconds, 5), delay, bag_);
  ASSERT_EQ(Run().exit_code, 0);
  const nlohmann::json offset = Summary()["odometry"]["lidar_time_offset"];
  const double sigma = offset["sigma_s"].get<double>();
  EXPECT_LT(sigma, 0.001);
  EXPECT_NEAR(offset["deviation_s"].get<double>(), -0.010, 3.0 * sigma);
  EXPECT_THAT(Summary()["events"].dump(), HasSubstr("late by the IMU's clock"));
  const auto calibrated = LoadRig(Output() + "/calibrated_rig.yaml");
  ASSERT_TRUE(calibrated.has_value());
  EXPECT_NEAR(calibrated->lidar->time_offset.seconds(), -0.010, 3.0 * sigma);
  // And is nothing left to find in a second pass?
  UseRig(*calibrated);
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_NEAR(Summary()["odometry"]["lidar_time_offset"]["deviation_s"].get<double>(), 0.0,
              3.0 * sigma);
}

TEST_F(RunCommand, ALeverArmInMillimetresIsWarnedOf) {
  Simulate({}, 2.5);
  Rig rig = TestRig();
  rig.lidar->T_body_lidar = Pose3(rig.lidar->T_body_lidar.rotation(), {-37.0, 0.0, 0.0});
  UseRig(rig);
  const ProcessResult result = Run();
  EXPECT_THAT(result.output, HasSubstr("lidar: T_body_lidar puts it 37.00 m from the IMU"));
}

TEST_F(RunCommand, PartsInTheWrongOrderArePutRightAndDoublesAreRefused) {
  const std::string second = (folder_ / "second.bag").string();
  const SequenceOptions options = StandardSequence("courtyard-easy", TestRig(), kSeconds, 5);
  Write(
      options, [](Measurement&, double t) { return t < 3.0; }, bag_);
  Write(
      options, [](Measurement&, double t) { return t >= 3.0; }, second);
  const ProcessResult result = RunOn(second + " " + bag_);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  ExpectResults("ok", kSweeps - 1);
  EXPECT_THAT(Summary()["notes"].dump(), HasSubstr("in the order of their times"));

  const ProcessResult twice = RunOn(bag_ + " " + bag_);
  EXPECT_EQ(twice.exit_code, 1) << twice.output;
  EXPECT_THAT(twice.output, HasSubstr("overlap by 3.0 s"));
}

// In the middle: the index is there, and what follows is read.
TEST_F(RunCommand, DamageWithinABagIsNoEndOfIt) {
  Simulate();
  {
    // The header of a message record: damage to a measurement itself cannot be seen.
    const std::string content = ReadFile(bag_);
    const std::size_t header = content.find(std::string("op=\x02"), content.size() * 7 / 10);
    ASSERT_NE(header, std::string::npos);
    std::fstream file(bag_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(header));
    file << std::string(2000, '\xff');
  }
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 2) << result.output;
  ExpectResults("input_damaged", kSweeps - 10);
}

TEST_F(RunCommand, TimeJumpBackIsReportedAndWhatWasEstimatedIsKept) {
  Simulate({.time_jump = TimeJump{4.0, 1.0}});
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("imu: time jumps back by 0.99"));
  EXPECT_THAT(result.output, HasSubstr("lidar: time jumps back by 0.9"));
  EXPECT_THAT(Reason(), HasSubstr("time jumped back, "));
  ExpectResults("degraded", 38);
  // Stamps after the jump repeat instants before it: only the part before has a truth to compare
  // with.
  const Trajectory estimate = Estimate();
  for (std::size_t i = 1; i < estimate.size(); ++i)
    EXPECT_LT(estimate[i - 1].stamp, estimate[i].stamp);
}

TEST_F(RunCommand, TwoSecondsWithoutLidar) {
  Simulate({.lidar_gap = FaultWindow{3.0, 2.0}});
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("gap of 2."));
  ExpectResults("degraded", kSweeps - 21);
  EXPECT_LT(Ate(), 0.05);
}

// Two recordings of one walk, given as one: the second begins a minute later, in motion.
TEST_F(RunCommand, AMinuteBetweenTwoRecordings) {
  constexpr double kWhole = 72.0;
  const FaultWindow pause{6.0, 61.0};
  Simulate({.lidar_gap = pause, .imu_gap = pause}, kWhole);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const nlohmann::json summary = Summary();
  EXPECT_EQ(summary["status"], "degraded");
  EXPECT_EQ(summary["resets"], 1);
  const nlohmann::json reset = summary["odometry"]["resets"][0];
  EXPECT_THAT(reset["reason"].get<std::string>(), HasSubstr("without IMU"));
  EXPECT_FALSE(reset["resumed_s"].get<std::string>().empty());
  EXPECT_THAT(result.output, HasSubstr("track lost"));
  EXPECT_THAT(result.output, HasSubstr("found again"));
  // docs/outputs.md names exactly the keys that are written; those of cameras in
  // visual_run_test.cc.
  EXPECT_THAT(test::UndocumentedKeys(summary), ::testing::IsEmpty());
  // command_line_test.cc has what could not be written.
  EXPECT_THAT(test::UnwrittenKeys(summary, "", {"visual", "calibration.cameras", "not_written"}),
              ::testing::IsEmpty());
  // The first sweep after a minute is held for a broken clock until another confirms it.
  for (const char* name : {"odometry.tum", "trajectory.tum"}) {
    const double first = Ate({.seconds = kWhole, .to = 30.0, .poses = 59}, name);
    const double second = Ate({.seconds = kWhole, .from = 30.0, .poses = 45}, name);
    EXPECT_LT(first, 0.02) << name;
    EXPECT_LT(second, 0.02) << name;
  }
}

TEST_F(RunCommand, AClockThatJumpsAheadByAMinute) {
  constexpr double kWhole = 9.0;
  Simulate({.time_jump = TimeJump{5.0, -70.0}}, kWhole);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(Summary()["resets"], 1);
  EXPECT_NEAR(Summary()["data_duration_s"].get<double>(), kWhole, 0.2);  // the jump is no data
  EXPECT_LT(Ate({.seconds = kWhole, .to = 30.0, .poses = 48}), 0.02);
  EXPECT_LT(Ate({.seconds = kWhole, .from = 30.0, .late = 70.0, .poses = 35}), 0.02);
}

TEST_F(RunCommand, ASecondRecordingTooShortForAStart) {
  const FaultWindow pause{4.0, 40.0};
  Simulate({.lidar_gap = pause, .imu_gap = pause}, 44.6);
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.output, HasSubstr("track lost"));
  EXPECT_EQ(Summary()["status"], "failed");
  EXPECT_EQ(Summary()["odometry"]["resets"][0]["resumed_s"], "");
  EXPECT_LT(Ate({.seconds = 44.6, .poses = 38}), 0.02);  // what was estimated before is kept
}

TEST_F(RunCommand, HalfASecondWithoutImu) {
  Simulate({.imu_gap = FaultWindow{3.0, 0.5}});
  const ProcessResult result = Run();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("gap of 0.5"));
  ExpectResults("degraded", kSweeps);
  EXPECT_LT(Ate(), 0.05);
}

TEST_F(RunCommand, BadRigs) {
  Simulate({}, 1.0);
  const std::string good = ReadFile(rig_);
  const auto run_with = [&](const std::string& rig) {
    std::ofstream(rig_) << rig;
    return Run();
  };
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string rig = good;
    const std::size_t at = rig.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in\n" << good;
    return rig.replace(at, from.size(), to);
  };
  const ProcessResult unknown = run_with(replaced("max_range", "maxrange"));
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.output, HasSubstr("maxrange"));
  EXPECT_THAT(unknown.output, HasSubstr("max_range"));

  const ProcessResult missing =
      run_with(replaced("  topic: \"" + TestRig().imu.topic + "\"\n", ""));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.output, HasSubstr("topic"));

  const ProcessResult mirrored = run_with(
      "name: mirrored\nimu: {topic: /imu, rate_hz: 100, noise: {accelerometer_density: 0.01, "
      "gyroscope_density: 0.001, "
      "accelerometer_random_walk: 0.001, gyroscope_random_walk: 0.0001}}\n"
      "lidar: {topic: /points, rate_hz: 10, T_body_lidar: {t: [0, 0, 0], R: [1, 0, 0, 0, 1, 0, 0, "
      "0, -1]}}\n");
  EXPECT_EQ(mirrored.exit_code, 1);
  EXPECT_THAT(mirrored.output, HasSubstr("-1"));
  EXPECT_THAT(mirrored.output, HasSubstr("T_body_lidar"));
}

TEST_F(RunCommand, BadConfiguration) {
  Simulate({}, 1.0);
  const ProcessResult unknown = Run("--set lio.map.voxelsize=0.4");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.output, HasSubstr("lio.map.voxel_size"));
  const ProcessResult range = Run("--set lio.map.voxel_size=-1");
  EXPECT_EQ(range.exit_code, 1);
  EXPECT_THAT(range.output, HasSubstr("-1"));
  const ProcessResult order = Run("--set lio.start.min_span=5");
  EXPECT_EQ(order.exit_code, 1);
  EXPECT_THAT(order.output, HasSubstr("lio.start.min_span = 5 exceeds lio.start.max_span = 4"));
  EXPECT_EQ(RunMlvi("run").exit_code, 1);
  EXPECT_EQ(RunMlvi("fly").exit_code, 1);
}

TEST(ConfigurationPage, IsWhatTheProgramDeclares) {
  EXPECT_EQ(RunMlvi("config-docs").output,
            ReadFile(fs::path(MLVI_SOURCE_DIR) / "docs" / "configuration.md"))
      << "renew it: mlvi config-docs > docs/configuration.md";
}

TEST_F(RunCommand, InterruptionKeepsWhatWasEstimated) {
  Simulate();
  // The progress lines tell when half of the recording is through.
  const ProcessResult result =
      test::InterruptMlvi("run " + bag_ + " --rig " + rig_ + " -o " + Output() + " --threads 1",
                          folder_ / "log", "run: 5");
  EXPECT_EQ(result.exit_code, 130) << result.output;
  ExpectResults("interrupted", 10);
  EXPECT_LT(Estimate().size(), static_cast<std::size_t>(kSweeps));
}

}  // namespace
}  // namespace mlvi
