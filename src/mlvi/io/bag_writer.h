// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/io/raw_bag_writer.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// What a Velodyne driver makes the header's stamp of: the first packet of a turn (times are
// positive) or the last one (times are negative; the driver's default).
enum class VelodyneStamp : int { kFirstPacket = 0, kLastPacket = 1 };

struct BagWriterOptions {
  BagCompression compression = BagCompression::kNone;
  VelodyneStamp velodyne_stamp = VelodyneStamp::kFirstPacket;
  int jpeg_quality = 80;  // 1 to 100; 80 is image_transport's default
};

// Writes ROS 1 bags with the topics of a rig and the messages of the real drivers, by
// LidarSpec::model:
//   "OS0-128"      Ouster: organised 128 x 1024, missing returns as zeros, t uint32 ns from the header's stamp (start)
//   "VLP-32C"      Velodyne XYZIRT: time float32 s from the header's stamp (see VelodyneStamp)
//   "PandarXT-32"  Hesai: timestamp float64, absolute s; header's stamp is the start
// Values are written as they are (units, NaN, stamps without the rig's time offsets): what a driver
// would send. Images become sensor_msgs/CompressedImage (JPEG) on topics that end in "/compressed",
// else sensor_msgs/Image; mono8 or bgr8, by their channels.
class BagWriter {
 public:
  // Errors: a file that cannot be written (CannotWrite), a LiDAR model without a layout
  // (kConfiguration).
  static Expected<std::unique_ptr<BagWriter>> Create(const std::string& path, const Rig& rig,
                                                     const BagWriterOptions& options = {});

  // Messages are to be written in the order of arrival; the receipt time is
  // AvailableAt(measurement), later only where that would fall behind the message before.
  Expected<void> Write(const Measurement& measurement) { return Write(measurement, false); }
  // The message of that measurement with only the first half of its bytes; of an image, a whole
  // message with the first half of its data (JPEG or pixels).
  Expected<void> WriteCutOff(const Measurement& measurement) { return Write(measurement, true); }
  // Writes the index and ends the file; a bag that was not closed has none.
  Expected<void> Close() { return bag_->Close(); }

 private:
  BagWriter(std::unique_ptr<RawBagWriter> bag, const Rig& rig, const BagWriterOptions& options)
      : bag_(std::move(bag)), rig_(rig), options_(options) {}
  const std::string& TopicOf(const Measurement& measurement) const;
  Expected<RosMessage> MessageOf(const Measurement& measurement, bool cut_off) const;
  Time ReceiptOf(const Measurement& measurement);
  RosMessage SweepMessage(const LidarSweep& sweep) const;
  Expected<RosMessage> CameraMessage(const Image& image, bool cut_off) const;
  Expected<void> Write(const Measurement& measurement, bool cut_off);

  std::unique_ptr<RawBagWriter> bag_;
  Time last_receipt_ = Time::FromNanoseconds(0);
  Rig rig_;
  BagWriterOptions options_;
};

}  // namespace mlvi
