// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/io/bag_reader.h"
#include "mlvi/io/imu_normalizer.h"
#include "mlvi/io/sweep_normalizer.h"
#include "mlvi/sensors/measurement_source.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

struct RosBagSourceOptions {
  bool use_lidar = true;
  std::vector<std::string> cameras = {};  // names of the rig's cameras to decode; empty: none
};

// Reads one or several ROS 1 bags, the parts of one recording in their order: each is opened when the one before has
// ended. Memory does not depend on their length.
//
// IMU: sensor_msgs/Imu. LiDAR: sensor_msgs/PointCloud2 of any layout, or Livox CustomMsg. Cameras: sensor_msgs/Image
// (8-bit) or CompressedImage, as grey images.
//
// Damaged bags: everything readable is delivered, then Next() returns one Error (kInput) that tells where the damage is.
class RosBagSource : public MeasurementSource {
 public:
  // Looks at all bags (indices only) before it starts. Errors (kInput): a file that is missing, empty or no bag; a topic
  // of the rig that no bag holds. Errors (kConfiguration): a camera that the rig does not have, a LiDAR that it has not.
  static Expected<std::unique_ptr<RosBagSource>> Open(const std::vector<std::string>& paths, const Rig& rig,
                                                      const RosBagSourceOptions& options = {});

  Expected<std::optional<Measurement>> Next() override;
  double Progress() const override;
  std::map<std::string, StreamCounts> Counts() const override;
  std::vector<std::string> Notes() const override;

 private:
  // A topic to read: the sensor it belongs to.
  enum class Sensor { kImu, kLidar, kCamera };
  struct Stream {
    Sensor sensor = Sensor::kImu;
    std::string rig_field;  // "imu.topic"
    int camera = -1;        // index in the rig
  };

  RosBagSource(std::vector<std::string> paths, const Rig& rig);
  Expected<void> SelectStreams(const RosBagSourceOptions& options);
  Expected<void> Inspect();
  Expected<void> CheckTopics(const std::map<std::string, std::string>& types, bool complete) const;
  Expected<bool> OpenNextBag();
  // What a message yields; empty when it was dropped (and counted).
  std::optional<Measurement> Decode(const BagMessage& message, const Stream& stream);
  std::optional<Measurement> DecodeImu(const BagMessage& message, StreamCounts& counts);
  std::optional<Measurement> DecodeLidar(const BagMessage& message, StreamCounts& counts);
  std::optional<Measurement> DecodeCamera(const BagMessage& message, const Stream& stream, StreamCounts& counts);
  void CountUnreadable(const BagMessage& message, const Error& error, StreamCounts& counts);
  std::optional<Error> TakeFinalError();

  std::vector<std::string> paths_;
  Rig rig_;
  std::map<std::string, Stream> streams_;  // by topic
  std::unique_ptr<BagReader> reader_;
  std::size_t next_path_ = 0;
  std::uint64_t bytes_total_ = 0;
  std::uint64_t bytes_done_ = 0;  // of the bags before the current one
  std::optional<ImuNormalizer> imu_;
  std::optional<SweepNormalizer> lidar_;
  std::map<std::string, StreamCounts> counts_;
  std::map<std::string, std::string> unreadable_;  // topic -> why the first unreadable message was so
  std::map<std::string, std::string> topics_;      // of all bags: topic -> type
  std::optional<Error> damage_;
  bool finished_ = false;
};

}  // namespace mlvi
