// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mlvi/base/background_tasks.h"
#include "mlvi/io/bag_reader.h"
#include "mlvi/io/image_job.h"
#include "mlvi/io/imu_normalizer.h"
#include "mlvi/io/sweep_normalizer.h"
#include "mlvi/sensors/image_schedule.h"
#include "mlvi/sensors/measurement_source.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

struct RosBagSourceOptions {
  bool use_lidar = true;
  std::vector<std::string> cameras = {};  // names of the rig's cameras to decode; empty: none
  bool cameras_required = true;    // false: a camera whose topic is in no bag is noted and left out
  double max_image_rate = 0.0;     // Hz, per camera; 0: all images
  double image_tolerance = 0.005;  // s, between images of one instant (ImageSchedule)
};

// Reads one or several ROS 1 bags, the parts of one recording: each is opened when the one before
// has ended. Bags with an index are put in the order of their times. Memory does not depend on
// their length.
//
// IMU: sensor_msgs/Imu. LiDAR: sensor_msgs/PointCloud2 of any layout, or Livox CustomMsg. Cameras:
// sensor_msgs/Image (8-bit) or CompressedImage, as grey images of the size that the rig states;
// they are decoded ahead by free threads. A camera that delivers nothing usable is counted and
// noted; it ends the recording only when no other sensor than the IMU delivers.
//
// Damaged bags: everything readable is delivered, then Next() returns one Error (kInput) that tells
// where the damage is.
class RosBagSource : public MeasurementSource {
 public:
  // Looks at all bags (indices only) before it starts. Errors (kInput): a file that is missing,
  // empty or no bag; a topic of the rig that no bag holds. Errors (kConfiguration): a camera that
  // the rig does not have, a LiDAR that it has not, bags that overlap in time (one given twice,
  // topics parted into several bags).
  static Expected<std::unique_ptr<RosBagSource>> Open(const std::vector<std::string>& paths,
                                                      const Rig& rig,
                                                      const RosBagSourceOptions& options = {});

  Expected<std::optional<Measurement>> Next() override;
  double Progress() const override;
  std::map<std::string, StreamCounts> Counts() const override;
  std::vector<std::string> Notes() const override;

  // The rig without the cameras that were left out because no bag holds them: images count its
  // cameras.
  const Rig& rig() const { return rig_; }
  // What the messages dropped here belong to: reason -> count, by "imu", "lidar" or the camera's
  // name.
  std::map<std::string, std::map<std::string, std::int64_t>> Dropped() const;

  // How the reading ended, once Next() has returned an Error or the end.
  enum class Ending {
    kWhole,
    kUnusable,   // a sensor that matters delivered nothing usable
    kTruncated,  // a bag without index: its end is missing
    kDamaged,    // damage within a bag
  };
  Ending ending() const { return ending_; }

 private:
  // A topic to read: the sensor it belongs to.
  enum class Sensor { kImu, kLidar, kCamera };
  struct Stream {
    Sensor sensor = Sensor::kImu;
    std::string topic;
    std::string rig_field;  // "imu.topic"
    int camera = -1;        // index in the rig
  };

  // A message read ahead: what it yielded, or the image that is being decoded.
  struct Pending {
    std::optional<Measurement> measurement;
    std::optional<ImageJob> image;
    const Stream* stream = nullptr;
    StreamCounts* counts = nullptr;
  };

  RosBagSource(std::vector<std::string> paths, const Rig& rig, const RosBagSourceOptions& options);
  Expected<void> SelectStreams();
  Expected<void> Inspect();
  Expected<void> PutInOrder(const std::vector<std::optional<std::pair<Time, Time>>>& spans);
  std::vector<ImuSample> FirstSamples() const;
  Expected<void> LeaveOutAbsentCameras(bool complete);
  std::string SensorName(const Stream& stream) const;
  Expected<void> CheckTopics(const std::map<std::string, std::string>& types, bool complete) const;
  Expected<bool> OpenNextBag();
  void ReadAhead();
  std::optional<BagMessage> NextMessage();
  Pending Prepare(const BagMessage& message, const Stream& stream);
  std::optional<Measurement> Complete(Pending pending);
  std::optional<Measurement> DecodeImu(const BagMessage& message, StreamCounts& counts);
  std::optional<Measurement> DecodeLidar(const BagMessage& message, StreamCounts& counts);
  std::optional<ImageJob> StartImage(const BagMessage& message, const Stream& stream,
                                     StreamCounts& counts);
  std::optional<Measurement> FinishImage(ImageJob& job, const Stream& stream, StreamCounts& counts);
  void Drop(const std::string& topic, const std::string& reason, const Error& error,
            StreamCounts& counts);
  bool IsHopeless(const Stream& stream, const StreamCounts& counts) const;
  bool CamerasDecide() const;
  std::string NothingUsable(const std::string& topic, const StreamCounts& counts) const;
  std::optional<Error> TakeFinalError();

  std::vector<std::string> paths_;
  Rig rig_;
  RosBagSourceOptions options_;
  std::map<std::string, Stream> streams_;  // by topic
  std::unique_ptr<BagReader> reader_;
  std::size_t next_path_ = 0;
  std::uint64_t bytes_total_ = 0;
  std::uint64_t bytes_done_ = 0;  // of the bags before the current one
  std::optional<ImuNormalizer> imu_;
  std::optional<SweepNormalizer> lidar_;
  ImageSchedule schedule_;
  BackgroundTasks background_;
  std::deque<Pending> pending_;  // in order of arrival
  bool all_read_ = false;
  std::map<std::string, StreamCounts> counts_;
  std::map<std::string, std::string>
      unreadable_;                             // topic -> why the first unreadable message was so
  std::vector<std::string> notes_;             // on bags and cameras
  std::map<std::string, std::string> topics_;  // of all bags: topic -> type
  std::optional<Error> damage_;
  Ending ending_ = Ending::kWhole;
  bool finished_ = false;
};

}  // namespace mlvi
