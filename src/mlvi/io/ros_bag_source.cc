// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_bag_source.h"

#include <algorithm>

#include "mlvi/base/config.h"
#include "mlvi/io/image_decoder.h"
#include "mlvi/io/livox.h"
#include "mlvi/io/ros_messages.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;
// A stream of which the first messages are all unreadable will stay so: stop instead of reading to the end.
constexpr std::int64_t kHopelessMessages = 10;

using TopicTypes = std::map<std::string, std::string>;

std::string TopicList(const TopicTypes& types) {
  std::string list;
  for (const auto& [topic, type] : types) list += fmt::format("\n  {} ({})", topic, type);
  return list.empty() ? " none" : list;
}

std::string NearestTopic(const std::string& topic, const TopicTypes& types, auto&& fits) {
  std::vector<std::string> fitting, all;
  for (const auto& [name, type] : types) {
    all.push_back(name);
    if (fits(type)) fitting.push_back(name);
  }
  return NearestName(topic, fitting.empty() ? all : fitting);
}

// The IMU samples of the first second of the recording, as they stand in the bag.
std::vector<ImuSample> FirstImuSamples(BagReader& reader, const std::string& topic) {
  std::vector<ImuSample> samples;
  for (auto message = reader.Next(); message && *message; message = reader.Next()) {
    const BagMessage& m = **message;
    if (m.connection->topic != topic || m.connection->type != kImuType) continue;
    const auto sample = ParseImu(m.data);
    if (sample) samples.push_back(*sample);
    if (sample && sample->stamp - samples.front().stamp > Duration::FromMilliseconds(1000)) break;
  }
  return samples;
}

}  // namespace

RosBagSource::RosBagSource(std::vector<std::string> paths, const Rig& rig)
    : paths_(std::move(paths)), rig_(rig) {}

Expected<std::unique_ptr<RosBagSource>> RosBagSource::Open(const std::vector<std::string>& paths, const Rig& rig,
                                                           const RosBagSourceOptions& options) {
  MLVI_CHECK(!paths.empty(), "no bag given");
  std::unique_ptr<RosBagSource> source(new RosBagSource(paths, rig));
  if (auto selected = source->SelectStreams(options); !selected) return tl::unexpected(selected.error());
  if (auto inspected = source->Inspect(); !inspected) return tl::unexpected(inspected.error());
  return source;
}

Expected<void> RosBagSource::SelectStreams(const RosBagSourceOptions& options) {
  streams_[rig_.imu.topic] = {.sensor = Sensor::kImu, .rig_field = "imu.topic"};
  if (options.use_lidar && !rig_.lidar) {
    return MakeError(ErrorKind::kConfiguration, "rig '{}' has no lidar; leave it out with --no-lidar", rig_.name);
  }
  if (options.use_lidar) {
    streams_[rig_.lidar->topic] = {.sensor = Sensor::kLidar, .rig_field = "lidar.topic"};
    lidar_.emplace(*rig_.lidar);
  }
  for (const std::string& name : options.cameras) {
    std::vector<std::string> names;
    for (const CameraSpec& camera : rig_.cameras) names.push_back(camera.name);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      return MakeError(ErrorKind::kConfiguration, "rig '{}' has no camera '{}': did you mean '{}'?", rig_.name,
                       name, NearestName(name, names));
    }
    const int index = static_cast<int>(found - names.begin());
    streams_[rig_.cameras[static_cast<std::size_t>(index)].topic] = {
        .sensor = Sensor::kCamera, .rig_field = fmt::format("cameras[{}].topic", index), .camera = index};
  }
  for (const auto& [topic, stream] : streams_) counts_[topic];
  return {};
}

// Opens every bag once: better now than after an hour.
Expected<void> RosBagSource::Inspect() {
  bool complete = true;
  std::vector<ImuSample> first;
  for (const std::string& path : paths_) {
    auto reader = BagReader::Open(path);
    if (!reader) return tl::unexpected(reader.error());
    bytes_total_ += (*reader)->file_size();
    complete = complete && (*reader)->indexed();
    if (first.empty()) first = FirstImuSamples(**reader, rig_.imu.topic);
    for (const auto& [id, connection] : (*reader)->connections()) topics_[connection.topic] = connection.type;
  }
  imu_.emplace(rig_.imu, first);
  return CheckTopics(topics_, complete);
}

Expected<void> RosBagSource::CheckTopics(const TopicTypes& types, bool complete) const {
  for (const auto& [topic, stream] : streams_) {
    const auto fits = [sensor = stream.sensor](const std::string& type) {
      if (sensor == Sensor::kImu) return type == kImuType;
      if (sensor == Sensor::kLidar) return type == kPointCloud2Type || IsLivoxType(type);
      return type == kImageType || type == kCompressedImageType;
    };
    const auto found = types.find(topic);
    if (found == types.end() && !complete) continue;  // a bag without index may still show it
    if (found != types.end() && fits(found->second)) continue;
    const std::string nearest = NearestTopic(topic, types, fits);
    return MakeError(kKind, "{} topic '{}' of rig '{}' {}. Did you mean '{}'? Then change {} in the rig file. Topics there:{}",
                     stream.sensor == Sensor::kImu ? "IMU" : stream.sensor == Sensor::kLidar ? "LiDAR" : "camera",
                     topic, rig_.name,
                     found == types.end() ? fmt::format("is not in '{}'", paths_.front())
                                          : fmt::format("has type {}, which is no message of that sensor", found->second),
                     nearest, stream.rig_field, TopicList(types));
  }
  return {};
}

Expected<bool> RosBagSource::OpenNextBag() {
  if (reader_) bytes_done_ += reader_->file_size();
  reader_.reset();
  if (next_path_ == paths_.size()) return false;
  auto reader = BagReader::Open(paths_[next_path_++]);
  if (!reader) return tl::unexpected(reader.error());
  reader_ = std::move(*reader);
  return true;
}

Expected<std::optional<Measurement>> RosBagSource::Next() {
  while (!finished_) {
    auto message = reader_ ? reader_->Next() : Expected<std::optional<BagMessage>>();
    if (!message) {
      if (!damage_) damage_ = message.error();
      continue;
    }
    if (!*message) {
      const auto opened = OpenNextBag();
      if (!opened && !damage_) damage_ = opened.error();
      if (opened && *opened) continue;
      break;
    }
    const auto stream = streams_.find((*message)->connection->topic);
    if (stream == streams_.end()) continue;
    if (auto measurement = Decode(**message, stream->second)) return measurement;
    const StreamCounts& counts = counts_.at(stream->first);
    if (counts.delivered == 0 && counts.messages >= kHopelessMessages && unreadable_.contains(stream->first)) break;
  }
  if (auto error = TakeFinalError()) return tl::unexpected(*error);
  return std::nullopt;
}

// What is wrong with the recording as a whole, once.
std::optional<Error> RosBagSource::TakeFinalError() {
  if (finished_) return std::nullopt;
  finished_ = true;
  for (const auto& [topic, counts] : counts_) {
    if (counts.delivered == 0 && unreadable_.contains(topic)) {
      return Error{kKind, fmt::format("no message of topic '{}' can be read: {}", topic, unreadable_.at(topic))};
    }
  }
  if (damage_) return damage_;
  for (const auto& [topic, counts] : counts_) {
    if (counts.messages == 0) {
      return Error{kKind, fmt::format("no message on topic '{}' (rig field {}) in '{}'", topic,
                                      streams_.at(topic).rig_field, paths_.front())};
    }
  }
  return std::nullopt;
}

std::optional<Measurement> RosBagSource::Decode(const BagMessage& message, const Stream& stream) {
  StreamCounts& counts = counts_.at(message.connection->topic);
  ++counts.messages;
  std::optional<Measurement> measurement;
  if (stream.sensor == Sensor::kImu) measurement = DecodeImu(message, counts);
  if (stream.sensor == Sensor::kLidar) measurement = DecodeLidar(message, counts);
  if (stream.sensor == Sensor::kCamera) measurement = DecodeCamera(message, stream, counts);
  counts.delivered += measurement ? 1 : 0;
  return measurement;
}

std::optional<Measurement> RosBagSource::DecodeImu(const BagMessage& message, StreamCounts& counts) {
  auto sample = ParseImu(message.data);
  if (!sample) {
    CountUnreadable(message, sample.error(), counts);
    return std::nullopt;
  }
  switch (imu_->Normalize(*sample)) {
    case ImuNormalizer::Fate::kDelivered:
      return *sample;
    case ImuNormalizer::Fate::kNotFinite:
      ++counts.dropped["NaN or infinite"];
      return std::nullopt;
    case ImuNormalizer::Fate::kDuplicate:
      ++counts.dropped["duplicate stamp"];
      return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Measurement> RosBagSource::DecodeLidar(const BagMessage& message, StreamCounts& counts) {
  const auto cloud = IsLivoxType(message.connection->type)
                         ? ViewLivoxPoints(message.data, message.connection->definition)
                         : ParsePointCloud2(message.data);
  auto raw = cloud.and_then([&](const PointCloud2View& view) { return ExtractPoints(view, lidar_->filter()); });
  if (!raw) {
    CountUnreadable(message, raw.error(), counts);
    return std::nullopt;
  }
  auto sweep = lidar_->Normalize(std::move(*raw));
  if (!sweep) {
    ++counts.dropped[sweep.error().message];
    return std::nullopt;
  }
  return std::move(*sweep);
}

std::optional<Measurement> RosBagSource::DecodeCamera(const BagMessage& message, const Stream& stream,
                                                      StreamCounts& counts) {
  const bool compressed = message.connection->type == kCompressedImageType;
  const auto view = compressed ? ParseCompressedImage(message.data) : ParseImage(message.data);
  auto image = view.and_then([&](const ImageView& v) { return compressed ? DecodeCompressedImage(v) : DecodeImage(v); });
  if (!image) {
    CountUnreadable(message, image.error(), counts);
    return std::nullopt;
  }
  image->camera = stream.camera;
  image->stamp = image->stamp + rig_.cameras[static_cast<std::size_t>(stream.camera)].time_offset;
  return std::move(*image);
}

void RosBagSource::CountUnreadable(const BagMessage& message, const Error& error, StreamCounts& counts) {
  ++counts.dropped["unreadable message"];
  unreadable_.try_emplace(message.connection->topic, error.message);
}

double RosBagSource::Progress() const {
  const double current = reader_ ? reader_->Progress() * static_cast<double>(reader_->file_size()) : 0.0;
  return std::min(1.0, (static_cast<double>(bytes_done_) + current) / static_cast<double>(bytes_total_));
}

std::map<std::string, StreamCounts> RosBagSource::Counts() const {
  std::map<std::string, StreamCounts> counts = counts_;
  for (const auto& [topic, stream] : streams_) {
    if (stream.sensor == Sensor::kLidar) counts[topic].repaired = lidar_->repaired();
    const bool rescaled = stream.sensor == Sensor::kImu && imu_->acceleration_scale() != 1.0;
    if (rescaled) counts[topic].repaired["messages: g converted to m/s^2"] = counts[topic].delivered;
  }
  return counts;
}

std::vector<std::string> RosBagSource::Notes() const {
  std::vector<std::string> notes = imu_->notes();
  if (lidar_) notes.insert(notes.end(), lidar_->notes().begin(), lidar_->notes().end());
  for (const auto& [topic, why] : unreadable_) notes.push_back(fmt::format("{}: unreadable message: {}", topic, why));
  if (damage_) notes.push_back(damage_->message);
  return notes;
}

}  // namespace mlvi
