// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_bag_source.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "mlvi/base/config.h"
#include "mlvi/base/suggestion.h"
#include "mlvi/io/livox.h"
#include "mlvi/io/ros_messages.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;
constexpr char kUnreadable[] = "unreadable message";
// A stream of which the first messages are all unreadable will stay so: stop instead of reading to
// the end.
constexpr std::int64_t kHopelessMessages = 10;
// Messages read ahead of the caller when there are images to decode: about two sets of six cameras
// and the IMU between.
constexpr std::size_t kReadAhead = 32;
// Parts of one recording follow one another; a recorder's buffers may hold a little of both.
constexpr double kLargestOverlap = 1.0;  // s

using TopicTypes = std::map<std::string, std::string>;

std::string TopicList(const TopicTypes& types) {
  std::string list;
  for (const auto& [topic, type] : types) list += fmt::format("\n  {} ({})", topic, type);
  return list.empty() ? " none" : list;
}

// Of the topics with messages of that sensor: the only one, or the one with the nearest name; else
// "".
std::string NearestTopic(const std::string& topic, const TopicTypes& types, auto&& fits) {
  std::vector<std::string> fitting;
  for (const auto& [name, type] : types) {
    if (fits(type)) fitting.push_back(name);
  }
  return fitting.size() == 1 ? fitting.front() : NearestName(topic, fitting);
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

// "'no valid point' 10, 'unreadable message' 4"
std::string ReasonList(const StreamCounts& counts) {
  std::string list;
  for (const auto& [reason, count] : counts.dropped) {
    list += fmt::format("{}'{}' {}", list.empty() ? "" : ", ", reason, count);
  }
  return list;
}

}  // namespace

RosBagSource::RosBagSource(std::vector<std::string> paths, const Rig& rig,
                           const RosBagSourceOptions& options)
    : paths_(std::move(paths)),
      rig_(rig),
      options_(options),
      schedule_(options.max_image_rate, options.image_tolerance) {}

Expected<std::unique_ptr<RosBagSource>> RosBagSource::Open(const std::vector<std::string>& paths,
                                                           const Rig& rig,
                                                           const RosBagSourceOptions& options) {
  MLVI_CHECK(!paths.empty(), "no bag given");
  std::unique_ptr<RosBagSource> source(new RosBagSource(paths, rig, options));
  if (auto selected = source->SelectStreams(); !selected) return tl::unexpected(selected.error());
  if (auto inspected = source->Inspect(); !inspected) return tl::unexpected(inspected.error());
  return source;
}

Expected<void> RosBagSource::SelectStreams() {
  const auto select = [this](Sensor sensor, const std::string& topic, std::string field,
                             int camera = -1) {
    streams_[topic] = {
        .sensor = sensor, .topic = topic, .rig_field = std::move(field), .camera = camera};
    counts_[topic];
  };
  select(Sensor::kImu, rig_.imu.topic, "imu.topic");
  if (options_.use_lidar && !rig_.lidar) {
    return MakeError(ErrorKind::kConfiguration,
                     "rig '{}' has no lidar; leave it out with --no-lidar", rig_.name);
  }
  if (options_.use_lidar) {
    select(Sensor::kLidar, rig_.lidar->topic, "lidar.topic");
    lidar_.emplace(*rig_.lidar);
  }
  const std::vector<std::string> names = rig_.CameraNames();
  for (const std::string& name : options_.cameras) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      return MakeError(ErrorKind::kConfiguration, "rig '{}' has no camera '{}'{}", rig_.name, name,
                       DidYouMean(name, names));
    }
    const auto index = static_cast<std::size_t>(found - names.begin());
    select(Sensor::kCamera, rig_.cameras[index].topic, fmt::format("cameras[{}].topic", index),
           static_cast<int>(index));
  }
  return {};
}

// Opens every bag once: better now than after an hour.
Expected<void> RosBagSource::Inspect() {
  bool complete = true;
  std::vector<std::optional<std::pair<Time, Time>>> spans;
  for (const std::string& path : paths_) {
    auto reader = BagReader::Open(path);
    if (!reader) return tl::unexpected(reader.error());
    bytes_total_ += (*reader)->file_size();
    complete = complete && (*reader)->indexed();
    spans.push_back((*reader)->span());
    for (const auto& [id, connection] : (*reader)->connections())
      topics_[connection.topic] = connection.type;
  }
  if (auto ordered = PutInOrder(spans); !ordered) return ordered;
  imu_.emplace(rig_.imu, FirstSamples());
  if (!options_.cameras_required) {
    if (auto left = LeaveOutAbsentCameras(complete); !left) return left;
  }
  return CheckTopics(topics_, complete);
}

Expected<void> RosBagSource::PutInOrder(
    const std::vector<std::optional<std::pair<Time, Time>>>& spans) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (!spans[i]) return {};  // without all indices nobody knows
    order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return spans[a]->first < spans[b]->first; });
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < order.size(); ++i) {
    paths.push_back(paths_[order[i]]);
    if (i == 0) continue;
    const double overlap = (spans[order[i - 1]]->second - spans[order[i]]->first).seconds();
    if (overlap > kLargestOverlap) {
      return MakeError(ErrorKind::kConfiguration,
                       "bags '{}' and '{}' overlap by {:.1f} s: several bags must be the parts of "
                       "one recording, one "
                       "after the other. Give each of them once; if they hold different topics of "
                       "one time, merge them "
                       "into one bag first",
                       paths[i - 1], paths[i], overlap);
    }
  }
  if (paths != paths_) {
    notes_.push_back(
        fmt::format("bags are read in the order of their times: {}", fmt::join(paths, ", ")));
    paths_ = paths;
  }
  return {};
}

// Of the first bag that has any.
std::vector<ImuSample> RosBagSource::FirstSamples() const {
  for (const std::string& path : paths_) {
    auto reader = BagReader::Open(path);
    if (!reader) continue;  // it was there a moment ago; reading it will tell
    if (auto samples = FirstImuSamples(**reader, rig_.imu.topic); !samples.empty()) return samples;
  }
  return {};
}

Expected<void> RosBagSource::LeaveOutAbsentCameras(bool complete) {
  if (!complete) return {};  // a bag without index may still show them
  const auto absent = [&](const CameraSpec& camera) {
    return streams_.contains(camera.topic) && !topics_.contains(camera.topic);
  };
  std::vector<CameraSpec> present;
  for (const CameraSpec& camera : rig_.cameras) {
    if (!absent(camera)) {
      if (const auto stream = streams_.find(camera.topic); stream != streams_.end()) {
        stream->second.camera = static_cast<int>(present.size());
      }
      present.push_back(camera);
      continue;
    }
    streams_.erase(camera.topic);
    counts_.erase(camera.topic);
    notes_.push_back(fmt::format("{}: topic '{}' is not in the recording; the camera is not used",
                                 camera.name, camera.topic));
  }
  const bool none = present.empty() && !rig_.cameras.empty();
  if (none && !options_.use_lidar) {
    return MakeError(kKind,
                     "none of the topics of rig '{}' with images is in '{}', and there is no LiDAR "
                     "to do without "
                     "them: correct cameras[].topic in the rig file. Topics there:{}",
                     rig_.name, paths_.front(), TopicList(topics_));
  }
  rig_.cameras = std::move(present);
  return {};
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
    return MakeError(
        kKind, "{} topic '{}' of rig '{}' {}{} Check {} in the rig file. Topics there:{}",
        stream.sensor == Sensor::kImu     ? "IMU"
        : stream.sensor == Sensor::kLidar ? "LiDAR"
                                          : "camera",
        topic, rig_.name,
        found == types.end()
            ? fmt::format("is not in '{}'", paths_.front())
            : fmt::format("has type {}, which is no message of that sensor", found->second),
        nearest.empty() ? "." : fmt::format("; did you mean '{}'?", nearest), stream.rig_field,
        TopicList(types));
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
  ReadAhead();
  while (!pending_.empty()) {
    Pending pending = std::move(pending_.front());
    pending_.pop_front();
    if (auto measurement = Complete(std::move(pending))) return measurement;
    ReadAhead();
  }
  if (auto error = TakeFinalError()) return tl::unexpected(*error);
  return std::nullopt;
}

void RosBagSource::ReadAhead() {
  const bool images = std::any_of(streams_.begin(), streams_.end(), [](const auto& entry) {
    return entry.second.sensor == Sensor::kCamera;
  });
  const std::size_t wanted = images ? kReadAhead : 1;
  while (!all_read_ && pending_.size() < wanted) {
    const auto message = NextMessage();
    if (!message) {
      all_read_ = true;
      return;
    }
    const auto stream = streams_.find(message->connection->topic);
    if (stream == streams_.end()) continue;
    pending_.push_back(Prepare(*message, stream->second));
    all_read_ = IsHopeless(stream->second, *pending_.back().counts);
  }
}

// The next message of all bags; damage is kept for the end.
std::optional<BagMessage> RosBagSource::NextMessage() {
  while (true) {
    auto message = reader_ ? reader_->Next() : Expected<std::optional<BagMessage>>();
    if (message && *message) return **message;
    if (!message) {
      if (!damage_) {
        damage_ = message.error();
        ending_ = reader_->indexed() ? Ending::kDamaged : Ending::kTruncated;
      }
      continue;  // the reader is at its end now
    }
    const auto opened = OpenNextBag();
    if (opened && *opened) continue;
    if (!opened && !damage_) {
      damage_ = opened.error();
      ending_ = Ending::kTruncated;
    }
    return std::nullopt;
  }
}

bool RosBagSource::IsHopeless(const Stream& stream, const StreamCounts& counts) const {
  return stream.sensor != Sensor::kCamera && counts.delivered == 0 &&
         counts.messages >= kHopelessMessages && unreadable_.contains(stream.topic);
}

// No other sensor than the cameras can tell where the rig is.
bool RosBagSource::CamerasDecide() const {
  std::int64_t images = 0;
  for (const auto& [topic, stream] : streams_) {
    if (stream.sensor == Sensor::kLidar) return false;
    if (stream.sensor == Sensor::kCamera) images += counts_.at(topic).delivered;
  }
  return images == 0;
}

std::string RosBagSource::NothingUsable(const std::string& topic,
                                        const StreamCounts& counts) const {
  if (const auto why = unreadable_.find(topic); why != unreadable_.end()) {
    return fmt::format("no message of topic '{}' can be read: {}", topic, why->second);
  }
  std::string text = fmt::format("no message of topic '{}' can be used: {} of {} were dropped ({})",
                                 topic, counts.messages, counts.messages, ReasonList(counts));
  if (lidar_ && topic == rig_.lidar->topic)
    text += fmt::format(". {}", fmt::join(lidar_->notes(), ". "));
  return text;
}

// What is wrong with the recording as a whole, once.
std::optional<Error> RosBagSource::TakeFinalError() {
  if (finished_) return std::nullopt;
  finished_ = true;
  const bool cameras_decide = CamerasDecide();
  const auto matters = [&](const std::string& topic) {
    return streams_.at(topic).sensor != Sensor::kCamera || cameras_decide;
  };
  for (const auto& [topic, counts] : counts_) {
    if (counts.delivered == 0 && !counts.dropped.empty() && matters(topic)) {
      ending_ = Ending::kUnusable;
      return Error{kKind, NothingUsable(topic, counts)};
    }
  }
  if (damage_) return damage_;
  for (const auto& [topic, counts] : counts_) {
    if (counts.messages == 0 && matters(topic)) {
      ending_ = Ending::kUnusable;
      return Error{kKind, fmt::format("no message on topic '{}' (rig field {}) in '{}'", topic,
                                      streams_.at(topic).rig_field, paths_.front())};
    }
  }
  return std::nullopt;
}

RosBagSource::Pending RosBagSource::Prepare(const BagMessage& message, const Stream& stream) {
  StreamCounts& counts = counts_.at(stream.topic);
  ++counts.messages;
  Pending pending;
  pending.stream = &stream;
  pending.counts = &counts;
  if (stream.sensor == Sensor::kImu) pending.measurement = DecodeImu(message, counts);
  if (stream.sensor == Sensor::kLidar) pending.measurement = DecodeLidar(message, counts);
  if (pending.measurement) ++counts.delivered;
  if (stream.sensor == Sensor::kCamera) {
    if (auto job = StartImage(message, stream, counts)) pending.image.emplace(std::move(*job));
  }
  return pending;
}

std::optional<Measurement> RosBagSource::Complete(Pending pending) {
  if (!pending.image) return std::move(pending.measurement);
  auto measurement = FinishImage(*pending.image, *pending.stream, *pending.counts);
  if (measurement) ++pending.counts->delivered;
  return measurement;
}

std::optional<Measurement> RosBagSource::DecodeImu(const BagMessage& message,
                                                   StreamCounts& counts) {
  auto sample = ParseImu(message.data);
  if (!sample) {
    Drop(message.connection->topic, kUnreadable, sample.error(), counts);
    return std::nullopt;
  }
  switch (imu_->Normalize(*sample)) {
    case ImuNormalizer::Fate::kDelivered: return *sample;
    case ImuNormalizer::Fate::kNotFinite: ++counts.dropped["NaN or infinite"]; return std::nullopt;
    case ImuNormalizer::Fate::kDuplicate: ++counts.dropped["duplicate stamp"]; return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Measurement> RosBagSource::DecodeLidar(const BagMessage& message,
                                                     StreamCounts& counts) {
  const auto cloud = IsLivoxType(message.connection->type)
                         ? ViewLivoxPoints(message.data, message.connection->definition)
                         : ParsePointCloud2(message.data);
  auto raw = cloud.and_then(
      [&](const PointCloud2View& view) { return ExtractPoints(view, lidar_->filter()); });
  if (!raw) {
    Drop(message.connection->topic, kUnreadable, raw.error(), counts);
    return std::nullopt;
  }
  auto sweep = lidar_->Normalize(std::move(*raw));
  if (!sweep) {
    ++counts.dropped[sweep.error().message];
    return std::nullopt;
  }
  return std::move(*sweep);
}

// Empty when the image is not needed, or not readable at all.
std::optional<ImageJob> RosBagSource::StartImage(const BagMessage& message, const Stream& stream,
                                                 StreamCounts& counts) {
  const bool compressed = message.connection->type == kCompressedImageType;
  const auto view = compressed ? ParseCompressedImage(message.data) : ParseImage(message.data);
  if (!view) {
    Drop(stream.topic, kUnreadable, view.error(), counts);
    return std::nullopt;
  }
  const CameraSpec& camera = rig_.cameras[static_cast<std::size_t>(stream.camera)];
  if (!schedule_.Keep(stream.camera, view->header.stamp + camera.time_offset)) {
    ++counts.thinned;
    return std::nullopt;
  }
  return ImageJob(background_, message.data, compressed);
}

std::optional<Measurement> RosBagSource::FinishImage(ImageJob& job, const Stream& stream,
                                                     StreamCounts& counts) {
  auto image = job.Take();
  if (!image) {
    Drop(stream.topic, kUnreadable, image.error(), counts);
    return std::nullopt;
  }
  const CameraSpec& camera = rig_.cameras[static_cast<std::size_t>(stream.camera)];
  const CameraModel& lens = *camera.model;
  if (image->width != lens.width() || image->height != lens.height()) {
    Drop(stream.topic, "wrong size",
         Error{kKind, fmt::format("image of {} x {} px, camera {} of rig '{}' has {} x {}: scaled "
                                  "by the recorder, or "
                                  "the calibration of another mode; correct {}",
                                  image->width, image->height, camera.name, rig_.name, lens.width(),
                                  lens.height(),
                                  fmt::format("cameras[{}].size and intrinsics", stream.camera))},
         counts);
    return std::nullopt;
  }
  image->camera = stream.camera;
  image->stamp = image->stamp + camera.time_offset;
  return std::move(*image);
}

void RosBagSource::Drop(const std::string& topic, const std::string& reason, const Error& error,
                        StreamCounts& counts) {
  ++counts.dropped[reason];
  unreadable_.try_emplace(topic, error.message);
}

double RosBagSource::Progress() const {
  const double current =
      reader_ ? reader_->Progress() * static_cast<double>(reader_->file_size()) : 0.0;
  return std::min(1.0,
                  (static_cast<double>(bytes_done_) + current) / static_cast<double>(bytes_total_));
}

std::map<std::string, StreamCounts> RosBagSource::Counts() const {
  std::map<std::string, StreamCounts> counts = counts_;
  for (const auto& [topic, stream] : streams_) {
    if (stream.sensor == Sensor::kLidar) counts[topic].repaired = lidar_->repaired();
    const bool rescaled = stream.sensor == Sensor::kImu && imu_->acceleration_scale() != 1.0;
    if (rescaled)
      counts[topic].repaired["messages: g converted to m/s^2"] = counts[topic].delivered;
  }
  return counts;
}

std::string RosBagSource::SensorName(const Stream& stream) const {
  if (stream.sensor == Sensor::kImu) return "imu";
  if (stream.sensor == Sensor::kLidar) return "lidar";
  return rig_.cameras[static_cast<std::size_t>(stream.camera)].name;
}

std::map<std::string, std::map<std::string, std::int64_t>> RosBagSource::Dropped() const {
  std::map<std::string, std::map<std::string, std::int64_t>> dropped;
  for (const auto& [topic, stream] : streams_)
    dropped[SensorName(stream)] = counts_.at(topic).dropped;
  return dropped;
}

std::vector<std::string> RosBagSource::Notes() const {
  std::vector<std::string> notes = imu_->notes();
  notes.insert(notes.end(), notes_.begin(), notes_.end());
  if (lidar_) notes.insert(notes.end(), lidar_->notes().begin(), lidar_->notes().end());
  for (const auto& [topic, stream] : streams_) {
    const StreamCounts& counts = counts_.at(topic);
    if (counts.dropped.empty()) continue;
    notes.push_back(fmt::format("{}: of {} messages these were dropped: {}", SensorName(stream),
                                counts.messages, ReasonList(counts)));
  }
  for (const auto& [topic, why] : unreadable_)
    notes.push_back(fmt::format("{}: unreadable message: {}", topic, why));
  if (damage_) notes.push_back(damage_->message);
  return notes;
}

}  // namespace mlvi
