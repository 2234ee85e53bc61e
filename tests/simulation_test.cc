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

// What drivers stamp, as it stands in the bag: the rig's own time offsets are not added yet.
struct Stamps {
  std::vector<Time> imu, lidar;
  std::map<std::string, std::vector<Time>> images;  // by camera
};

Stamps StampsInBag(const std::string& path, Rig rig, const std::vector<std::string>& cameras) {
  rig.imu.time_offset = rig.lidar->time_offset = Duration();
  for (CameraSpec& camera : rig.cameras) camera.time_offset = Duration();
  Stamps stamps;
  const auto source = RosBagSource::Open({path}, rig, {.cameras = cameras}).value();
  for (const Measurement& measurement : ReadAll(*source)) {
    if (const auto* imu = std::get_if<ImuSample>(&measurement)) stamps.imu.push_back(imu->stamp);
    if (const auto* sweep = std::get_if<LidarSweep>(&measurement))
      stamps.lidar.push_back(sweep->stamp);
    if (const auto* image = std::get_if<Image>(&measurement))
      stamps.images[rig.cameras[static_cast<std::size_t>(image->camera)].name].push_back(
          image->stamp);
  }
  return stamps;
}

// How late stamps are against true instants, s: evenly distributed within these.
struct Lateness {
  std::string rig, sequence, camera;
  double imu_from, imu_to, lidar_from, lidar_to, image_from, image_to;
};

class ClocksOfRig : public ::testing::TestWithParam<Lateness> {};

// Newer College and Hilti: LiDAR and cameras on one clock, the IMU behind it by what the cameras'
// calibrations say. M2DGR: what arrives at a computer when.
TEST_P(ClocksOfRig, StampAsItsDriversDo) {
  const Lateness& expected = GetParam();
  const Rig rig = LoadRig(expected.rig).value();
  SequenceOptions options = StandardSequence(expected.sequence, rig, 0.3);
  options.carried = false;  // nobody hides the beginning of sweeps, which readers take stamps from
  options.cameras = {expected.camera};
  options.image_rate = 12.0;
  const test::TemporaryFolder folder("clocks_of_rig");
  const std::string bag = folder.path() / "clocks.bag";
  Recording messages(options, RecordingForm::kMessages);
  const auto writer = BagWriter::Create(bag, messages.rig()).value();
  while (auto message = messages.Next().value()) ASSERT_TRUE(writer->Write(*message).has_value());
  ASSERT_TRUE(writer->Close().has_value());
  const Stamps stamps = StampsInBag(bag, rig, options.cameras);
  const std::vector<Time>& images = stamps.images.at(expected.camera);
  ASSERT_EQ(stamps.imu.size(), messages.imu().size());
  ASSERT_EQ(stamps.lidar.size(), 3U);
  ASSERT_EQ(images.size(), messages.cameras()[0].size());
  ASSERT_FALSE(images.empty());
  constexpr double kText = 1e-6;  // Velodyne's and Hesai's times, and the rig file's
  const auto expect = [&](Time stamp, Time instant, double from, double to) {
    EXPECT_GE((stamp - instant).seconds(), from - kText);
    EXPECT_LE((stamp - instant).seconds(), to + kText);
  };
  for (std::size_t i = 0; i < stamps.imu.size(); ++i)
    expect(stamps.imu[i], messages.imu().StampOf(i), expected.imu_from, expected.imu_to);
  for (std::size_t i = 0; i < stamps.lidar.size(); ++i) {
    const Time instant = messages.begin() + Duration::FromMilliseconds(100 * static_cast<int>(i));
    expect(stamps.lidar[i], instant, expected.lidar_from, expected.lidar_to);
  }
  for (std::size_t i = 0; i < images.size(); ++i)
    expect(images[i], messages.cameras()[0].TimeOf(i), expected.image_from, expected.image_to);
  // What sequence.json says of it, and where a stamp's truth is looked up.
  EXPECT_NEAR(
      messages.TrueTimeOffset(expected.camera).seconds(),
      0.5 * (expected.imu_from + expected.imu_to) - 0.5 * (expected.image_from + expected.image_to),
      kText);
  const double jitter = 0.5 * (expected.lidar_to - expected.lidar_from);
  for (std::size_t i = 0; i < stamps.lidar.size(); ++i) {
    const Time instant = messages.begin() + Duration::FromMilliseconds(100 * static_cast<int>(i));
    EXPECT_NEAR((messages.TrueTime(stamps.lidar[i], "lidar") - instant).seconds(), 0.0,
                jitter + kText);
    // Truth made of registered sweeps has their stamps, that of other instruments their own.
    const double shift = (messages.TruthStamp(instant) - instant).seconds();
    EXPECT_NEAR(shift, jitter > 0.0 ? 0.0 : expected.lidar_from, kText);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, ClocksOfRig,
    ::testing::Values(Lateness{"newer_college", "quad-easy", "cam0", 0.0, 0.0, -1.819e-3, -1.819e-3,
                               -1.832126e-3, -1.832126e-3},
                      Lateness{"hilti_2022", "basement-2", "cam0", 0.0, 0.0, -1.70246e-3,
                               -1.70246e-3, -1.7e-3, -1.7e-3},
                      Lateness{"m2dgr", "room-01", "left", 4e-3, 6e-3, 1e-3, 1.5e-3, 5e-3, 6e-3}),
    [](const auto& tested) { return tested.param.rig; });

// Rigs are carried as their front cameras look.
TEST(Simulation, WalksAheadWithEveryRig) {
  for (const std::string name : {"newer_college", "hilti_2022", "m2dgr", "euroc_os0"}) {
    const Rig rig = LoadRig(name).value();
    SequenceOptions options = StandardSequence("quad-easy", rig, 5.0);
    options.rest = 0.0;
    const Recording recording(options);
    const Pose3& front = rig.cameras.front().T_body_camera;
    double ahead = 0.0, all = 0.0;
    for (int i = 0; i < 50; ++i) {
      const NavState state =
          recording.GroundTruth(recording.begin() + Duration::FromMilliseconds(100 * i));
      const Eigen::Vector3d in_camera =
          (state.T_world_body * front).rotation().conjugate() * state.v_world_body;
      ahead += in_camera.z();
      all += state.v_world_body.norm();
    }
    EXPECT_GT(ahead, 0.97 * all) << name;
  }
}

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

nlohmann::json DescriptionIn(const std::filesystem::path& folder) {
  std::ifstream file(folder / "sequence.json");
  return nlohmann::json::parse(file);
}

// Each switch takes away what it is named after, in the description and in the bag.
TEST(SimulateCommand, SwitchesTakeAwayWhatTheyAreNamedAfter) {
  const auto simulate = [](const std::string& extra) {
    const test::TemporaryFolder folder("switches");
    const std::string output = folder.path();
    EXPECT_EQ(
        RunMlvi("simulate basement-2 --cameras none --seconds 0.2 " + extra + " -o " + output), 0);
    const Rig rig = LoadRig(output + "/rig.yaml").value();
    return std::pair(DescriptionIn(output),
                     ReadAll(*RosBagSource::Open({output + "/basement-2.bag"}, rig).value()));
  };
  const auto sweep_of = [](const std::vector<Measurement>& all) {
    for (const Measurement& m : all)
      if (const auto* sweep = std::get_if<LidarSweep>(&m)) return *sweep;
    return LidarSweep{};
  };
  const auto imu_of = [](const std::vector<Measurement>& all) {
    return std::get<ImuSample>(all.front()).linear_acceleration;
  };
  const auto same = [](const LidarSweep& a, const LidarSweep& b) {
    return std::ranges::equal(a.points, b.points, {}, &LidarPoint::position, &LidarPoint::position);
  };
  const auto [usual, all] = simulate("");
  const LidarSweep sweep = sweep_of(all);
  EXPECT_NEAR(usual["clocks"]["lidar"]["offset_s"], -1.70246e-3, 1e-8);
  EXPECT_NEAR(usual["lidar_time_offset"]["true_s"], 1.70246e-3, 1e-8);
  EXPECT_EQ(usual["lidar_time_offset"]["rig_s"], 0.0);
  EXPECT_EQ(usual["ground_truth_clock"], "lidar");
  EXPECT_EQ(usual["operator"], true);
  EXPECT_FALSE(usual["noise"]["lidar"]["surface_relief"].empty());
  EXPECT_EQ(usual["noise"]["lidar"]["first_surface"], false);
  EXPECT_GT(usual["noise"]["imu_errors"]["vibration"]["acceleration_m_s2"], 0.0);
  EXPECT_NE(usual["true_T_body_lidar"], usual["estimator_T_body_lidar"]);
  {
    const auto [json, read] = simulate("--exact-clocks");
    EXPECT_TRUE(json["clocks"].empty());
    EXPECT_EQ(json["lidar_time_offset"]["true_s"], 0.0);
    EXPECT_NEAR((sweep_of(read).stamp - sweep.stamp).seconds(), 1.70246e-3, 1e-6);
    EXPECT_TRUE(same(sweep_of(read), sweep));
  }
  {
    const auto [json, read] = simulate("--no-operator");
    EXPECT_EQ(json["operator"], false);
    EXPECT_GT(sweep_of(read).points.size(), sweep.points.size() + sweep.points.size() / 40);
  }
  {
    const auto [json, read] = simulate("--plane-surfaces");
    EXPECT_TRUE(json["noise"]["lidar"]["surface_relief"].empty());
    EXPECT_FALSE(same(sweep_of(read), sweep));
  }
  {
    const auto [json, read] = simulate("--ideal-lidar");
    EXPECT_EQ(json["noise"]["lidar"]["first_surface"], true);
    EXPECT_EQ(json["noise"]["lidar"]["incidence_bias"], 0.0);
    EXPECT_FALSE(same(sweep_of(read), sweep));
  }
  {
    const auto [json, read] = simulate("--ideal-imu");
    EXPECT_EQ(json["noise"]["imu_errors"]["vibration"]["acceleration_m_s2"], 0.0);
    EXPECT_NE(imu_of(read), imu_of(all));
    EXPECT_TRUE(same(sweep_of(read), sweep));
  }
  {
    const auto [json, read] = simulate("--exact-extrinsics");
    EXPECT_EQ(json["true_T_body_lidar"], json["estimator_T_body_lidar"]);
    EXPECT_FALSE(same(sweep_of(read), sweep));
  }
}

// The rig of the bag and the description tell what is in it and how it was made.
TEST(SimulateCommand, SaysHowARecordingWasMade) {
  const test::TemporaryFolder folder("how");
  const std::string output = folder.path();
  const test::ProcessResult result = test::RunMlvi(
      "simulate room-01 --cameras left --image-rate 12 --jpeg-quality 60 --seconds 0.2 "
      "--rolling-shutter 0.02 --velodyne-stamp last --compression lz4 --clock left,0.03,0,0.01 "
      "-o " +
      output);
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto json = DescriptionIn(output);
  EXPECT_EQ(json["bag"]["velodyne_stamp"], "last");
  EXPECT_EQ(json["bag"]["compression"], "lz4");
  EXPECT_EQ(json["bag"]["jpeg_quality"], 60);
  EXPECT_EQ(json["bag"]["bytes"], std::filesystem::file_size(output + "/room-01.bag"));
  EXPECT_THAT(result.output, ::testing::ContainsRegex("bag of [0-9.]+ MB"));
  EXPECT_EQ(json["ground_truth_clock"], "true");
  EXPECT_EQ(json["cameras"]["left"]["rate_hz"], 12.0);
  EXPECT_NEAR(json["cameras"]["left"]["row_time_s"], 0.02 / 1024.0, 1e-9);
  // IMU 5 ms late on average, the camera 35 ms.
  EXPECT_NEAR(json["cameras"]["left"]["time_offset"]["true_s"], -0.03, 1e-9);
  EXPECT_EQ(json["cameras"]["left"]["time_offset"]["rig_s"], 0.0);
  EXPECT_NEAR(json["cameras"]["left"]["time_offset"]["jitter_s"], 0.012, 1e-12);
  const Rig rig = LoadRig(output + "/rig.yaml").value();
  ASSERT_EQ(rig.cameras.size(), 1U);
  EXPECT_EQ(rig.cameras[0].name, "left");
  EXPECT_EQ(rig.cameras[0].rate_hz, 12.0);
}

TEST(SimulateCommand, NamesTheSequencesOfThePaper) {
  EXPECT_THAT(test::RunMlvi("simulate --list").output, ::testing::HasSubstr("[Quad-Easy]"));
}

TEST(SimulateCommand, AnswersWrongUseWithExitCode1) {
  const test::TemporaryFolder folder("usage");
  EXPECT_EQ(RunMlvi("simulate courtyard-esay -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy"), 1);
  EXPECT_EQ(RunMlvi("simulate courtyard-easy --seconds -3 -o " + folder.path().string()), 1);
  EXPECT_EQ(RunMlvi("simulate --list"), 0);
  const auto refusal = [&](const std::string& arguments) {
    const auto result =
        test::RunMlvi("simulate quad-easy " + arguments + " -o " + folder.path().string());
    EXPECT_EQ(result.exit_code, 1) << arguments;
    return result.output;
  };
  EXPECT_THAT(refusal("--cameras cam0 --seconds 0.1 --image-rate 10 --lights-off 0,1"),
              ::testing::HasSubstr("has no lamps"));
  EXPECT_THAT(refusal("--cameras none --clock lidar,0.1 --clock lidar,0.2"),
              ::testing::HasSubstr("second clock"));
  EXPECT_THAT(refusal("--cameras none --seconds 0.5 --lidar-gap 100,5"),
              ::testing::HasSubstr("ends after 0.5 s"));
}

#endif

}  // namespace
}  // namespace mlvi
