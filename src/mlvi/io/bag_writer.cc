// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/bag_writer.h"

#include "mlvi/io/image_encoder.h"
#include "mlvi/io/sweep_messages.h"

namespace mlvi {
namespace {

constexpr char kOuster[] = "OS0-128", kVelodyne[] = "VLP-32C", kHesai[] = "PandarXT-32";

}  // namespace

Expected<std::unique_ptr<BagWriter>> BagWriter::Create(const std::string& path, const Rig& rig,
                                                       const BagWriterOptions& options) {
  const std::string model = rig.lidar ? rig.lidar->model : kOuster;
  if (model != kOuster && model != kVelodyne && model != kHesai) {
    return MakeError(ErrorKind::kConfiguration,
                     "lidar.model '{}' has no message layout to write; {}, {} and {} have", model,
                     kOuster, kVelodyne, kHesai);
  }
  auto bag = RawBagWriter::Create(path, options.compression);
  if (!bag) return tl::unexpected(bag.error());
  return std::unique_ptr<BagWriter>(new BagWriter(std::move(*bag), rig, options));
}

const std::string& BagWriter::TopicOf(const Measurement& measurement) const {
  if (std::holds_alternative<ImuSample>(measurement)) return rig_.imu.topic;
  if (std::holds_alternative<LidarSweep>(measurement)) {
    MLVI_CHECK(rig_.lidar.has_value(), "a sweep to write, but rig '{}' has no lidar", rig_.name);
    return rig_.lidar->topic;
  }
  const auto camera = static_cast<std::size_t>(std::get<Image>(measurement).camera);
  MLVI_CHECK(camera < rig_.cameras.size(), "camera {} of {}", camera, rig_.cameras.size());
  return rig_.cameras[camera].topic;
}

Expected<RosMessage> BagWriter::MessageOf(const Measurement& measurement, bool cut_off) const {
  if (const auto* image = std::get_if<Image>(&measurement)) return CameraMessage(*image, cut_off);
  const auto* imu = std::get_if<ImuSample>(&measurement);
  RosMessage message =
      imu != nullptr ? ImuMessage(*imu) : SweepMessage(std::get<LidarSweep>(measurement));
  if (cut_off) message.bytes.resize(message.bytes.size() / 2);
  return message;
}

// The recorder's own clock goes on when a sensor's stamps jump back.
Time BagWriter::ReceiptOf(const Measurement& measurement) {
  last_receipt_ = std::max(AvailableAt(measurement), last_receipt_ + Duration::FromNanoseconds(1));
  return last_receipt_;
}

Expected<void> BagWriter::Write(const Measurement& measurement, bool cut_off) {
  const std::string& topic = TopicOf(measurement);
  const auto message = MessageOf(measurement, cut_off);
  if (!message) return tl::unexpected(message.error());
  return bag_->Write(topic, ReceiptOf(measurement), *message);
}

Expected<RosMessage> BagWriter::CameraMessage(const Image& image, bool cut_off) const {
  const CameraSpec& camera = rig_.cameras[static_cast<std::size_t>(image.camera)];
  if (!camera.topic.ends_with("/compressed")) {
    if (!cut_off) return ImageMessage(image, camera.name);
    Image half = image;
    half.pixels.resize(half.pixels.size() / 2);
    return ImageMessage(half, camera.name);
  }
  auto jpeg = EncodeJpeg(image, options_.jpeg_quality);
  if (!jpeg) return tl::unexpected(jpeg.error());
  if (cut_off) jpeg->resize(jpeg->size() / 2);
  // As image_transport's compressed plugin writes it: what the data decode to follows for colour.
  const std::string format =
      fmt::format("{0}; jpeg compressed {1}", EncodingOf(image), image.channels == 3 ? "bgr8" : "");
  return CompressedImageMessage(image.stamp, camera.name, format, *jpeg);
}

RosMessage BagWriter::SweepMessage(const LidarSweep& sweep) const {
  if (rig_.lidar->model == kVelodyne) {
    return PointCloud2Message(
        VelodyneCloud(sweep, options_.velodyne_stamp == VelodyneStamp::kLastPacket));
  }
  if (rig_.lidar->model == kHesai) return PointCloud2Message(HesaiCloud(sweep));
  return PointCloud2Message(OusterCloud(sweep, Duration::FromSeconds(1.0 / rig_.lidar->rate_hz)));
}

}  // namespace mlvi
