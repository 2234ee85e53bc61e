// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Helpers of the tests of this module: small recordings with known content.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/io/bag_writer.h"
#include "mlvi/io/ros_bag_source.h"

// Skips the test when a file of the shared data is not there.
#define MLVI_SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not on this machine"

namespace mlvi::test {

inline std::string SharedData(const std::string& path) {
  return std::string(MLVI_SHARED_DATA_DIR) + "/" + path;
}

// A path in the folder for temporary files, different for each test.
inline std::string TemporaryPath(const std::string& name) {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string prefix = fmt::format("{}_{}_", info->test_suite_name(), info->name());
  std::replace(prefix.begin(), prefix.end(), '/', '_');
  return ::testing::TempDir() + prefix + name;
}

inline const Time kStart = Time::FromNanoseconds(1'625'132'069'158'812'160);

// A valid rig without cameras around a LiDAR model.
inline Rig MakeRig(const std::string& model, int rings) {
  Rig rig;
  rig.name = "test";
  rig.imu.topic = "/imu";
  rig.imu.rate_hz = 200.0;
  rig.imu.noise = {1e-3, 2e-4, 3e-5, 8e-6};
  rig.lidar.emplace();
  rig.lidar->topic = "/points";
  rig.lidar->model = model;
  rig.lidar->rings = rings;
  return rig;
}

// One turn of `columns` firings of `rings` lasers within 0.1 s at ranges of 2 to 20 m, in firing
// order; the turn is clockwise. `share` of the points, drawn at random, are no returns (zero).
inline LidarSweep MakeSweep(Time stamp, int rings, int columns, double share,
                            std::uint64_t seed = 1) {
  LidarSweep sweep;
  sweep.stamp = stamp;
  sweep.has_times = sweep.has_rings = sweep.has_intensity = true;
  RandomStream random(seed, "sweep");
  for (int column = 0; column < columns; ++column) {
    const auto offset = static_cast<std::int32_t>(std::llround(1e8 * column / columns));
    for (int ring = 0; ring < rings; ++ring) {
      const double azimuth = -2.0 * std::numbers::pi * column / columns + 0.3;
      const double elevation = 0.6 - 1.2 * ring / rings, range = random.Uniform(2.0, 20.0);
      LidarPoint point{.intensity = static_cast<float>(std::floor(random.Uniform(0.0, 255.0))),
                       .offset_ns = offset};
      point.ring = static_cast<std::uint16_t>(ring);
      const Eigen::Vector3d direction(std::cos(azimuth) * std::cos(elevation),
                                      std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      if (random.Uniform() >= share) point.position = (range * direction).cast<float>();
      sweep.points.push_back(point);
      sweep.span = Duration::FromNanoseconds(offset);
    }
  }
  return sweep;
}

inline ImuSample MakeImu(int index, double scale = 1.0) {
  ImuSample sample;
  sample.stamp = kStart + Duration::FromMilliseconds(5) * index;
  sample.angular_velocity = {0.1, -0.2, 0.01 * std::sin(index)};
  sample.linear_acceleration = scale * Eigen::Vector3d(0.1, 0.2 * std::cos(index), -9.8);
  return sample;
}

// Writes IMU samples at 200 Hz and sweeps at 10 Hz over `seconds`, in the order of arrival.
// `make_sweep(index, stamp)`.
inline void WriteRecording(const std::string& path, const Rig& rig, const BagWriterOptions& options,
                           double seconds, const std::function<LidarSweep(int, Time)>& make_sweep,
                           double imu_scale = 1.0) {
  auto writer = BagWriter::Create(path, rig, options);
  ASSERT_TRUE(writer) << writer.error().message;
  int sweeps = 0;
  for (int i = 0; i < seconds * 200; ++i) {
    ASSERT_TRUE((*writer)->Write(MakeImu(i, imu_scale)));
    if (rig.lidar && i % 20 == 19) {
      const LidarSweep sweep =
          make_sweep(sweeps, kStart + Duration::FromMilliseconds(100) * sweeps);
      ASSERT_TRUE((*writer)->Write(sweep));
      ++sweeps;
    }
  }
  ASSERT_TRUE((*writer)->Close());
}

// Everything that a source delivers.
struct Content {
  std::vector<ImuSample> imu;
  std::vector<LidarSweep> sweeps;
  std::vector<Image> images;
  std::string error;  // of Next(), if any
  std::map<std::string, StreamCounts> counts;
  std::vector<std::string> notes;
};

inline Content ReadAll(MeasurementSource& source) {
  Content content;
  while (true) {
    auto next = source.Next();
    if (!next) {
      EXPECT_TRUE(content.error.empty()) << "a second error: " << next.error().message;
      content.error = next.error().message;
      continue;
    }
    if (!*next) break;
    if (auto* imu = std::get_if<ImuSample>(&**next)) content.imu.push_back(*imu);
    if (auto* sweep = std::get_if<LidarSweep>(&**next)) content.sweeps.push_back(std::move(*sweep));
    if (auto* image = std::get_if<Image>(&**next)) content.images.push_back(std::move(*image));
  }
  content.counts = source.Counts();
  content.notes = source.Notes();
  return content;
}

inline std::vector<char> ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void WriteBytes(const std::string& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace mlvi::test
