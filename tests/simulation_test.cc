// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Simulated recordings through the real formats: what is written as the drivers' messages reads
// back as what was simulated, and the command line makes complete recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "mlvi/io/bag_writer.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/io/tum.h"
#include "mlvi/sim/recording.h"

namespace mlvi {
namespace {

// A folder that vanishes with the test.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name)
      : path_(std::filesystem::path(testing::TempDir()) / ("mlvi_simulation_" + name)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::vector<Measurement> ReadAll(MeasurementSource& source) {
  std::vector<Measurement> all;
  while (auto next = source.Next().value()) all.push_back(std::move(*next));
  return all;
}

class SimulatedBags : public ::testing::TestWithParam<std::string> {};

TEST_P(SimulatedBags, ReadBackAsSimulated) {
  const Expected<Rig> rig = LoadRig(GetParam());
  ASSERT_TRUE(rig.has_value()) << rig.error().message;
  const SequenceOptions options = StandardSequence("courtyard-easy", *rig, 0.5, 3);
  const TemporaryFolder folder(GetParam());
  const std::string path = folder.path() / "test.bag";
  Recording messages(options, RecordingForm::kMessages);
  const auto writer = BagWriter::Create(path, messages.rig()).value();
  while (auto message = messages.Next().value()) ASSERT_TRUE(writer->Write(*message).has_value());
  ASSERT_TRUE(writer->Close().has_value());

  Recording recording(options);
  const std::vector<Measurement> simulated = ReadAll(recording);
  const auto source = RosBagSource::Open({path}, messages.rig());
  ASSERT_TRUE(source.has_value()) << source.error().message;
  const std::vector<Measurement> read = ReadAll(**source);
  ASSERT_EQ(read.size(), simulated.size());
  // Velodyne's times are float32 seconds (7 ns at 0.1 s), Hesai's float64 of Unix time (240 ns).
  constexpr std::int64_t kTimeErrorNs = 250;
  for (std::size_t i = 0; i < read.size(); ++i) {
    ASSERT_EQ(read[i].index(), simulated[i].index()) << i;
    if (const auto* imu = std::get_if<ImuSample>(&read[i])) {
      const auto& expected = std::get<ImuSample>(simulated[i]);
      EXPECT_EQ(imu->stamp, expected.stamp);
      EXPECT_EQ(imu->linear_acceleration, expected.linear_acceleration);
      EXPECT_EQ(imu->angular_velocity, expected.angular_velocity);
      continue;
    }
    const auto &sweep = std::get<LidarSweep>(read[i]),
               &expected = std::get<LidarSweep>(simulated[i]);
    EXPECT_TRUE(sweep.has_times && sweep.has_rings && sweep.has_intensity);
    EXPECT_LE(std::abs((sweep.stamp - expected.stamp).nanoseconds()), kTimeErrorNs);
    ASSERT_EQ(sweep.points.size(), expected.points.size());
    for (std::size_t k = 0; k < sweep.points.size(); ++k) {
      const LidarPoint &a = sweep.points[k], &b = expected.points[k];
      ASSERT_EQ(a.position, b.position) << k;
      ASSERT_EQ(a.ring, b.ring) << k;
      ASSERT_LE(std::abs(a.offset_ns - b.offset_ns), 2 * kTimeErrorNs) << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, SimulatedBags,
                         ::testing::Values("newer_college", "m2dgr", "hilti_2022"),
                         [](const auto& tested) { return tested.param; });

#ifdef MLVI_BINARY

int RunMlvi(const std::string& arguments) {
  const int status =
      std::system((std::string(MLVI_BINARY) + " " + arguments + " >/dev/null 2>&1").c_str());
  return WEXITSTATUS(status);
}

TEST(SimulateCommand, WritesACompleteRecording) {
  const TemporaryFolder folder("command");
  const std::string output = folder.path();
  ASSERT_EQ(RunMlvi("simulate corridor-easy --rig m2dgr --seconds 1 --seed 5 --lidar-gap 0.4,0.2 "
                    "--imu-in-g -o " +
                    output),
            0);
  const Expected<Rig> rig = LoadRig(output + "/rig.yaml");
  ASSERT_TRUE(rig.has_value()) << rig.error().message;
  EXPECT_EQ(rig->name, "m2dgr");
  const auto truth = ReadTum(output + "/groundtruth.tum");
  ASSERT_TRUE(truth.has_value()) << truth.error().message;
  EXPECT_EQ(truth->size(), 101U);
  std::ifstream file(output + "/sequence.json");
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json.at("seed"), 5);
  EXPECT_EQ(json.at("status"), "complete");
  EXPECT_EQ(json.at("messages").at(rig->lidar->topic), 8);
  EXPECT_DOUBLE_EQ(json.at("faults").at("lidar_gap").at("start_s"), 0.4);
  const auto source = RosBagSource::Open({output + "/corridor-easy.bag"}, *rig);
  ASSERT_TRUE(source.has_value()) << source.error().message;
  EXPECT_EQ(ReadAll(**source).size(), 8U + 151U);
}

TEST(SimulateCommand, AnswersWrongUseWithExitCode1) {
  const TemporaryFolder folder("usage");
  EXPECT_EQ(RunMlvi("simulate courtyard-esay -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy"), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy --seconds -3 -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate --list"), 0);
}

#endif

}  // namespace
}  // namespace mlvi
