// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Faults from the command line to the reader: each is recorded in sequence.json, changes in the bag
// what it should, and nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/sim/sequence.h"
#include "temporary_folder.h"

#ifdef MLVI_BINARY

namespace mlvi {
namespace {

// What a reader makes of a simulated recording.
struct Recorded {
  nlohmann::json description;
  std::vector<ImuSample> imu;
  std::vector<LidarSweep> sweeps;
  std::map<std::string, std::vector<Image>> images;  // by camera
  std::map<std::string, StreamCounts> counts;        // by topic
  Rig rig;
};

Recorded Record(const std::string& name, const std::string& arguments,
                const std::vector<std::string>& cameras = {}) {
  const test::TemporaryFolder folder(name);
  const std::string output = folder.path();
  const std::string command = std::string(MLVI_BINARY) + " simulate corridor-easy " + arguments +
                              " -o " + output + " >/dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  Recorded recorded;
  std::ifstream file(output + "/sequence.json");
  recorded.description = nlohmann::json::parse(file);
  recorded.rig = LoadRig(output + "/rig.yaml").value();
  auto source =
      RosBagSource::Open({output + "/corridor-easy.bag"}, recorded.rig, {.cameras = cameras})
          .value();
  while (auto next = source->Next().value()) {
    if (const auto* imu = std::get_if<ImuSample>(&*next)) recorded.imu.push_back(*imu);
    if (auto* sweep = std::get_if<LidarSweep>(&*next)) recorded.sweeps.push_back(std::move(*sweep));
    if (auto* image = std::get_if<Image>(&*next)) {
      const auto camera = static_cast<std::size_t>(image->camera);
      recorded.images[recorded.rig.cameras[camera].name].push_back(std::move(*image));
    }
  }
  recorded.counts = source->Counts();
  return recorded;
}

constexpr const char* kLidarAndImu = "--rig m2dgr --cameras none --seconds 2 --rest 0 --seed 4 ";

// Of `recorded`, counted from the beginning of the simulation.
double SecondsOf(Time time) { return (time - SequenceOptions().begin).seconds(); }

const Recorded& Intact() {
  static const Recorded recorded = Record("intact", kLidarAndImu);
  return recorded;
}

bool SamePoints(const LidarSweep& a, const LidarSweep& b) {
  return std::ranges::equal(a.points, b.points, [](const LidarPoint& p, const LidarPoint& q) {
    return p.position == q.position && p.offset_ns == q.offset_ns && p.ring == q.ring;
  });
}

// The sweeps of the intact recording without those of index `missing`.
std::vector<LidarSweep> Without(std::vector<LidarSweep> sweeps, std::vector<std::size_t> missing) {
  for (auto i = missing.rbegin(); i != missing.rend(); ++i)
    sweeps.erase(sweeps.begin() + static_cast<std::ptrdiff_t>(*i));
  return sweeps;
}

TEST(FaultRecording, MissingSweepsAndSamples) {
  const Recorded faulty =
      Record("gaps", std::string(kLidarAndImu) + "--lidar-gap 0.35,0.2 --imu-gap 1.5,0.2");
  EXPECT_EQ(faulty.description["faults"]["lidar_gap"]["start_s"], 0.35);
  EXPECT_EQ(faulty.description["faults"]["imu_gap"]["length_s"], 0.2);
  const auto expected = Without(Intact().sweeps, {4, 5});
  ASSERT_EQ(faulty.sweeps.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_TRUE(SamePoints(faulty.sweeps[i], expected[i])) << i;
  std::vector<Time> stamps, intact_stamps;
  for (const ImuSample& sample : faulty.imu) stamps.push_back(sample.stamp);
  for (const ImuSample& sample : Intact().imu) {
    const double t = SecondsOf(sample.stamp);
    if (t < 1.5 - 1e-6 || t >= 1.7 - 1e-6) intact_stamps.push_back(sample.stamp);
  }
  EXPECT_EQ(stamps, intact_stamps);
  EXPECT_EQ(faulty.imu.size(), Intact().imu.size() - 30);  // 150 Hz
}

TEST(FaultRecording, EmptyCorruptedAndSpoiltSweeps) {
  const Recorded faulty = Record(
      "sweeps", std::string(kLidarAndImu) +
                    "--empty-sweeps 0.35,0.2 --corrupted-sweeps 0.95,0.3 --nan-points 1.45,0.1");
  const auto& faults = faulty.description["faults"];
  EXPECT_EQ(faults["empty_sweeps"]["length_s"], 0.2);
  EXPECT_EQ(faults["corrupted_sweeps"]["start_s"], 0.95);
  EXPECT_EQ(faults["nan_points"]["start_s"], 1.45);
  const StreamCounts& counts = faulty.counts.at(faulty.rig.lidar->topic);
  EXPECT_EQ(counts.messages, 20);
  std::int64_t dropped = 0;
  for (const auto& [reason, count] : counts.dropped) dropped += count;
  std::vector<LidarSweep> filled;
  for (const LidarSweep& sweep : faulty.sweeps) {
    if (!sweep.points.empty()) filled.push_back(sweep);
  }
  EXPECT_EQ(counts.delivered + dropped, 20);
  EXPECT_GE(dropped, 3);  // those that were cut off
  const auto expected = Without(Intact().sweeps, {4, 5, 10, 11, 12});
  ASSERT_EQ(filled.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (i != 10) {  // sweep 15
      EXPECT_TRUE(SamePoints(filled[i], expected[i])) << i;
      continue;
    }
    const auto n = static_cast<double>(expected[i].points.size());
    EXPECT_NEAR(static_cast<double>(filled[i].points.size()), 0.9 * n, 5.0 * std::sqrt(0.09 * n));
  }
}

TEST(FaultRecording, UnreadableImuMessages) {
  const Recorded faulty = Record(
      "imu_messages", std::string(kLidarAndImu) + "--nan-imu 0.5,0.1 --corrupted-imu 1.2,0.2");
  EXPECT_EQ(faulty.description["faults"]["nan_imu"]["start_s"], 0.5);
  EXPECT_EQ(faulty.description["faults"]["corrupted_imu"]["length_s"], 0.2);
  const StreamCounts& counts = faulty.counts.at(faulty.rig.imu.topic);
  EXPECT_EQ(counts.messages, static_cast<std::int64_t>(Intact().imu.size()));
  EXPECT_EQ(counts.dropped.at("NaN or infinite"), 15);  // 150 Hz
  EXPECT_EQ(counts.dropped.at("unreadable message"), 30);
  std::vector<ImuSample> rest = Intact().imu;
  std::erase_if(rest, [](const ImuSample& sample) {
    const double t = SecondsOf(sample.stamp) + 1e-6;
    return (t >= 0.5 && t < 0.6) || (t >= 1.2 && t < 1.4);
  });
  ASSERT_EQ(faulty.imu.size(), rest.size());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    EXPECT_EQ(faulty.imu[i].stamp, rest[i].stamp);
    EXPECT_EQ(faulty.imu[i].linear_acceleration, rest[i].linear_acceleration);
  }
}

// Velodyne's stamps and times are written with less than 250 ns of error.
TEST(FaultRecording, ClocksThatAreOffAndDrift) {
  const Recorded faulty =
      Record("clocks", std::string(kLidarAndImu) + "--clock lidar,0.02,500 --clock imu,-0.003");
  const auto& clocks = faulty.description["faults"]["clocks"];
  EXPECT_EQ(clocks["lidar"]["offset_s"], 0.02);
  EXPECT_EQ(clocks["lidar"]["drift_ppm"], 500.0);
  EXPECT_EQ(clocks["imu"]["offset_s"], -0.003);
  ASSERT_EQ(faulty.sweeps.size(), Intact().sweeps.size());
  for (std::size_t i = 0; i < faulty.sweeps.size(); ++i) {
    const Time intact = Intact().sweeps[i].stamp;
    const double t = 0.1 * static_cast<double>(i);
    EXPECT_NEAR((faulty.sweeps[i].stamp - intact).seconds(), 0.02 + 500e-6 * t, 1e-6) << i;
  }
  ASSERT_EQ(faulty.imu.size(), Intact().imu.size());
  for (std::size_t i = 0; i < faulty.imu.size(); ++i)
    EXPECT_NEAR((faulty.imu[i].stamp - Intact().imu[i].stamp).seconds(), -0.003, 1e-8);
}

TEST(FaultRecording, AClockThatJumps) {
  const Recorded faulty = Record("jump", std::string(kLidarAndImu) + "--time-jump 1,0.4");
  EXPECT_EQ(faulty.description["faults"]["time_jump"]["back_s"], 0.4);
  ASSERT_EQ(faulty.imu.size(), Intact().imu.size());
  for (std::size_t i = 0; i < faulty.imu.size(); ++i) {
    const double late = (faulty.imu[i].stamp - Intact().imu[i].stamp).seconds();
    const double t = static_cast<double>(i) / 150.0;
    EXPECT_NEAR(late, t < 1.0 - 1e-9 ? 0.0 : -0.4, 1e-8) << t;
  }
}

TEST(FaultRecording, AnImuThatSaturates) {
  const Recorded faulty =
      Record("saturation", std::string(kLidarAndImu) + "--imu-saturation 9.7,0.1");
  EXPECT_EQ(faulty.description["faults"]["imu_saturation"]["rate_rad_s"], 0.1);
  ASSERT_EQ(faulty.imu.size(), Intact().imu.size());
  std::size_t clipped = 0;
  for (std::size_t i = 0; i < faulty.imu.size(); ++i) {
    const ImuSample &a = faulty.imu[i], &b = Intact().imu[i];
    EXPECT_EQ(a.linear_acceleration, b.linear_acceleration.cwiseMax(-9.7).cwiseMin(9.7));
    EXPECT_EQ(a.angular_velocity, b.angular_velocity.cwiseMax(-0.1).cwiseMin(0.1));
    clipped += a.linear_acceleration != b.linear_acceleration;
  }
  EXPECT_GT(clipped, faulty.imu.size() / 10);
}

TEST(FaultRecording, AnImuAsBadAsARealOne) {
  const Recorded faulty =
      Record("imu_errors",
             std::string(kLidarAndImu) +
                 "--imu-vibration 0.5,0.05 --imu-warm-up 0.02,0.001,30 --imu-scale 0.005,0.01");
  const auto& errors = faulty.description["noise"]["imu_errors"];
  EXPECT_EQ(errors["vibration"]["acceleration_m_s2"], 0.5);
  EXPECT_EQ(errors["vibration"]["rate_rad_s"], 0.05);
  EXPECT_EQ(errors["warm_up"]["time_constant_s"], 30.0);
  EXPECT_EQ(errors["largest_scale_error"]["gyroscope"], 0.01);
  ASSERT_EQ(faulty.imu.size(), Intact().imu.size());
  double squares = 0.0;
  for (std::size_t i = 0; i < faulty.imu.size(); ++i)
    squares += (faulty.imu[i].angular_velocity - Intact().imu[i].angular_velocity).squaredNorm();
  // Four modes that ring for 0.25 s each, in 2 s: a tenth of the rms, one sigma.
  EXPECT_NEAR(std::sqrt(squares / (3.0 * static_cast<double>(faulty.imu.size()))), 0.05, 0.015);
  const auto bias = [](const Recorded& recorded, const char* when, int axis) {
    return recorded.description[when]["gyroscope_rad_s"][axis].get<double>();
  };
  double moved = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(bias(faulty, "bias_at_begin", axis), bias(Intact(), "bias_at_begin", axis));
    moved += std::pow(bias(faulty, "bias_at_end", axis) - bias(Intact(), "bias_at_end", axis), 2);
  }
  EXPECT_NEAR(std::sqrt(moved), -1e-3 * std::expm1(-2.0 / 30.0), 1e-9);
}

TEST(FaultRecording, MountsThatAreOff) {
  const Recorded faulty = Record("mounts",
                                 "--rig m2dgr --cameras none --seconds 0.2 "
                                 "--extrinsics-error 1.5,0.05");
  EXPECT_NEAR(faulty.description["faults"]["extrinsics_error"]["rotation_deg"], 1.5, 1e-12);
  const auto pose = [&](const char* name) {
    const auto& json = faulty.description[name];
    const auto t = json["t"].get<std::vector<double>>(),
               q = json["q_xyzw"].get<std::vector<double>>();
    return Pose3(Eigen::Quaterniond(q[3], q[0], q[1], q[2]), {t[0], t[1], t[2]});
  };
  const Pose3 truth = pose("true_T_body_lidar"), told = pose("estimator_T_body_lidar");
  EXPECT_NEAR(truth.rotation().angularDistance(told.rotation()) * 180.0 / std::numbers::pi, 1.5,
              1e-6);
  EXPECT_NEAR((truth.translation() - told.translation()).norm(), 0.05, 1e-9);
  EXPECT_LT((told.translation() - faulty.rig.lidar->T_body_lidar.translation()).norm(), 1e-9);
}

double MeanOf(const Image& image) {
  double sum = 0.0;
  for (const std::uint8_t pixel : image.pixels) sum += pixel;
  return sum / static_cast<double>(image.pixels.size());
}

// Images at 0.0, 0.2, ... 0.8 s of two cameras through JPEG and back.
TEST(FaultRecording, CamerasThatFail) {
  const std::string arguments =
      "--rig newer_college --cameras cam0,cam1 --image-rate 5 --seconds 1 --seed 4 ";
  const std::vector<std::string> cameras = {"cam0", "cam1"};
  const Recorded intact = Record("cameras_intact", arguments, cameras);
  const Recorded faulty = Record("cameras",
                                 arguments +
                                     "--camera-dead cam0,0.3,0.2 --camera-frozen cam1,0.1,0.4 "
                                     "--lens-patch cam0,0.5,0.5,0.1 --exposure-jump 0.5,0.2,0.4 "
                                     "--lights-off 0.7,0.3",
                                 cameras);
  const auto& faults = faulty.description["faults"];
  EXPECT_EQ(faults["cameras"][0]["failure"], "dead");
  EXPECT_EQ(faults["cameras"][1]["failure"], "frozen");
  EXPECT_EQ(faults["lens_patches"][0]["radius"], 0.1);
  EXPECT_EQ(faults["exposure_jump"]["factor"], 0.4);
  EXPECT_EQ(faults["lights_off"]["start_s"], 0.7);
  const std::vector<Image>&whole = intact.images.at("cam0"), &dirty = faulty.images.at("cam0"),
        &sound = intact.images.at("cam1"), &frozen = faulty.images.at("cam1");
  ASSERT_EQ(whole.size(), 5U);
  ASSERT_EQ(dirty.size(), 4U);
  for (const std::size_t i : {0, 1}) EXPECT_EQ(dirty[i].stamp, whole[i].stamp);
  for (const std::size_t i : {2, 3}) EXPECT_EQ(dirty[i].stamp, whole[i + 1].stamp);
  // Behind the dirt it is darker, elsewhere nothing has changed but for JPEG's blocks.
  const auto at = [](const Image& image, int u, int v) {
    return static_cast<int>(image.pixels[static_cast<std::size_t>(v * image.width + u)]);
  };
  EXPECT_LT(at(dirty[0], 360, 270), 0.7 * at(whole[0], 360, 270));
  EXPECT_NEAR(at(dirty[0], 360, 60), at(whole[0], 360, 60), 8);
  ASSERT_EQ(frozen.size(), 5U);
  EXPECT_EQ(frozen[2].pixels, frozen[1].pixels);
  EXPECT_NE(sound[2].pixels, sound[1].pixels);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(frozen[i].stamp, sound[i].stamp) << i;
  EXPECT_EQ(frozen[0].pixels, sound[0].pixels);
  EXPECT_LT(MeanOf(frozen[3]), 0.9 * MeanOf(sound[3]));  // exposed too short
  EXPECT_LT(MeanOf(frozen[4]), 0.7 * MeanOf(sound[4]));  // in the dark
  const Recorded gap = Record("image_gap", arguments + "--image-gap 0.3,0.4", cameras);
  EXPECT_EQ(gap.description["faults"]["image_gap"]["length_s"], 0.4);
  for (const std::string& camera : cameras) EXPECT_EQ(gap.images.at(camera).size(), 3U) << camera;
  const Recorded cut_off =
      Record("cut_off", arguments + "--corrupted-images cam0,0.3,0.4", cameras);
  EXPECT_EQ(cut_off.description["faults"]["cameras"][0]["failure"], "corrupted");
  const auto counts = [&](std::size_t camera) -> const StreamCounts& {
    return cut_off.counts.at(cut_off.rig.cameras[camera].topic);
  };
  EXPECT_EQ(counts(0).dropped.at("unreadable message"), 2);
  EXPECT_EQ(counts(1).delivered, 5);
  const std::vector<Image>& left = cut_off.images.at("cam0");
  ASSERT_EQ(left.size(), 3U);
  for (const std::size_t i : {0, 1, 2})
    EXPECT_EQ(left[i].pixels, whole[i < 2 ? i : i + 2].pixels) << i;
}

}  // namespace
}  // namespace mlvi

#endif
