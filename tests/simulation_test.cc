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
#include "run_mlvi.h"
#include "temporary_folder.h"

namespace mlvi {
namespace {

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
  const test::TemporaryFolder folder(GetParam());
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

int RunMlvi(const std::string& arguments) { return test::RunMlvi(arguments).exit_code; }

TEST(SimulateCommand, WritesACompleteRecording) {
  const test::TemporaryFolder folder("command");
  const std::string output = folder.path();
  ASSERT_EQ(RunMlvi("simulate corridor-easy --rig m2dgr --seconds 1 --seed 5 --lidar-gap 0.4,0.2 "
                    "--cameras none --imu-in-g -o " +
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

// Images of all three rigs come back as they were made: raw ones bit by bit, JPEGs but for the
// compression, on the topics and with the types of the real recordings.
class ImagesOfRig : public ::testing::TestWithParam<std::string> {};

TEST_P(ImagesOfRig, SurviveTheBag) {
  const test::TemporaryFolder folder("images");
  const std::string bag = folder.path() / "images.bag";
  const Rig rig = LoadRig(GetParam()).value();
  SequenceOptions options = StandardSequence("corridor-easy", rig, 0.1);
  options.cameras = {rig.cameras.front().name, rig.cameras[1].name};
  options.image_rate = 10.0;
  Recording messages(options, RecordingForm::kMessages), measurements(options);
  auto writer = BagWriter::Create(bag, messages.options().rig.estimator_rig).value();
  while (auto measurement = messages.Next().value())
    ASSERT_TRUE(writer->Write(*measurement).has_value());
  ASSERT_TRUE(writer->Close().has_value());
  const auto images_of = [](const std::vector<Measurement>& all) {
    std::vector<Image> images;
    for (const Measurement& m : all) {
      if (const auto* image = std::get_if<Image>(&m)) images.push_back(*image);
    }
    return images;
  };
  auto source = RosBagSource::Open({bag}, rig, {.cameras = options.cameras});
  ASSERT_TRUE(source.has_value()) << source.error().message;
  const auto read = images_of(ReadAll(**source)), made = images_of(ReadAll(measurements));
  ASSERT_EQ(made.size(), 2U);
  ASSERT_EQ(read.size(), made.size());
  const bool raw = !rig.cameras.front().topic.ends_with("/compressed");
  for (std::size_t i = 0; i < made.size(); ++i) {
    EXPECT_EQ(read[i].stamp, made[i].stamp);
    EXPECT_EQ(read[i].camera, made[i].camera);
    ASSERT_EQ(read[i].pixels.size(), made[i].pixels.size());
    if (raw) {
      EXPECT_EQ(read[i].pixels, made[i].pixels);
      continue;
    }
    double squares = 0.0;
    for (std::size_t k = 0; k < read[i].pixels.size(); ++k) {
      const double d = static_cast<double>(read[i].pixels[k]) - made[i].pixels[k];
      squares += d * d;
    }
    // JPEG of quality 80 takes off part of the noise, no more.
    EXPECT_LT(std::sqrt(squares / static_cast<double>(read[i].pixels.size())), 8.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, ImagesOfRig,
                         ::testing::Values("newer_college", "m2dgr", "hilti_2022"));

// An independent reader: ROS's own Python module (python3-rosbag) finds topics, types, sizes,
// stamps.
TEST(SimulateCommand, RosReadsTheBagToo) {
  if (std::system("/usr/bin/python3 -c 'import rosbag' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "python3-rosbag is not installed";
  const test::TemporaryFolder folder("rosbag");
  const std::string output = folder.path();
  ASSERT_EQ(RunMlvi("simulate corridor-easy --rig newer_college --seconds 0.4 --image-rate 10 "
                    "--cameras cam0,cam3 -o " +
                    output),
            0);
  const std::string script = output + "/read.py";
  std::ofstream(script) << R"(
import rosbag, sys
seen = {}
with rosbag.Bag(sys.argv[1]) as bag:
    for topic, message, receipt in bag.read_messages():
        seen.setdefault(topic, []).append((message, receipt))
for camera in ("cam0", "cam3"):
    images = seen["/alphasense_driver_ros/%s/compressed" % camera]
    assert len(images) == 4, len(images)
    for message, receipt in images:
        assert message._type == "sensor_msgs/CompressedImage", message._type
        assert message.format.startswith("mono8; jpeg compressed"), message.format
        assert list(message.data[:3]) == [255, 216, 255] and list(message.data[-2:]) == [255, 217]
        assert 0 <= (receipt - message.header.stamp).to_sec() < 0.01
assert len(seen["/alphasense_driver_ros/imu"]) == 81
clouds = seen["/os_cloud_node/points"]
assert len(clouds) == 4 and clouds[0][0].height == 128 and clouds[0][0].width == 1024
assert [f.name for f in clouds[0][0].fields][:5] == ["x", "y", "z", "intensity", "t"]
)";
  EXPECT_EQ(
      std::system(("/usr/bin/python3 " + script + " " + output + "/corridor-easy.bag").c_str()), 0);
}

TEST(SimulateCommand, WritesContactSheets) {
  const test::TemporaryFolder folder("sheets");
  const std::string output = folder.path();
  ASSERT_EQ(RunMlvi("simulate corridor-easy --seconds 0.2 --cameras cam0 --image-rate 10 "
                    "--contact-sheet -o " +
                    output),
            0);
  EXPECT_GT(std::filesystem::file_size(output + "/contact_sheet_2.png"), 100'000U);
  EXPECT_EQ(RunMlvi("simulate corridor-easy --seconds 0.2 --cameras cam9 -o " + output), 1);
}

// Truth, bag and description of an interrupted recording end together, and nothing claims that it
// was finished.
TEST(SimulateCommand, InterruptionKeepsWhatWasSimulated) {
  const test::TemporaryFolder folder("interrupted");
  const std::string output = folder.path() / "out";
  const test::ProcessResult result = test::InterruptMlvi(
      "simulate courtyard-easy --rig m2dgr --cameras none --seconds 60 --threads 1 -o " + output,
      folder.path() / "log", "simulate courtyard-easy: 1");
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_THAT(result.output, ::testing::Not(::testing::HasSubstr(" 100 %")));
  EXPECT_THAT(result.output, ::testing::HasSubstr("(interrupted) in " + output));
  const Rig rig = LoadRig(output + "/rig.yaml").value();
  const auto source = RosBagSource::Open({output + "/courtyard-easy.bag"}, rig);
  ASSERT_TRUE(source) << source.error().message;
  Time last;
  for (const Measurement& measurement : ReadAll(**source))
    last = std::max(last, AvailableAt(measurement));
  const Trajectory truth = ReadTum(output + "/groundtruth.tum").value();
  const double seconds = (truth.back().stamp - truth.front().stamp).seconds();
  EXPECT_GT(seconds, 5.9);
  EXPECT_LT(seconds, 59.0);
  EXPECT_GE(truth.back().stamp, last - Duration::FromMilliseconds(10));
  EXPECT_LE(truth.back().stamp, last + Duration::FromMilliseconds(20));
  std::ifstream file(output + "/sequence.json");
  EXPECT_EQ(nlohmann::json::parse(file).at("status"), "interrupted");
}

TEST(SimulateCommand, AnswersWrongUseWithExitCode1) {
  const test::TemporaryFolder folder("usage");
  EXPECT_EQ(RunMlvi("simulate courtyard-esay -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy"), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy --seconds -3 -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate --list"), 0);
}

#endif

}  // namespace
}  // namespace mlvi
