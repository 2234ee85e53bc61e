// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/raw_bag_writer.h"

#include <rosbag/bag.h>

#include "mlvi/io/whole_file.h"

namespace mlvi {

// What rosbag::Bag::write asks of a message type; found there by these names.
class RosbagMessage {
 public:
  explicit RosbagMessage(const RosMessage& message) : message_(message) {}
  const std::string& __getMD5Sum() const { return message_.type.md5; }
  const std::string& __getDataType() const { return message_.type.name; }
  const std::string& __getMessageDefinition() const { return message_.type.definition; }
  const std::vector<std::uint8_t>& bytes() const { return message_.bytes; }

 private:
  const RosMessage& message_;
};

}  // namespace mlvi

template <>
struct ros::serialization::Serializer<mlvi::RosbagMessage> {
  template <typename Stream>
  static void write(Stream& stream, const mlvi::RosbagMessage& message) {
    const std::vector<std::uint8_t>& bytes = message.bytes();
    std::memcpy(stream.advance(static_cast<std::uint32_t>(bytes.size())), bytes.data(),
                bytes.size());
  }
  static std::uint32_t serializedLength(const mlvi::RosbagMessage& message) {
    return static_cast<std::uint32_t>(message.bytes().size());
  }
};

namespace mlvi {

class RawBagWriter::Impl {
 public:
  explicit Impl(std::string path) : path_(std::move(path)), bag_(std::make_unique<rosbag::Bag>()) {}
  ~Impl() { static_cast<void>(Close()); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // Runs an action on the bag; what it throws becomes an Error, and the bag is given up with its
  // file and buffers: rosbag's destructor would write again, and terminate the program where that
  // throws (a full disk).
  template <typename Action>
  Expected<void> Try(const Action& action) {
    auto error = CannotWrite(path_);
    if (!bag_) return error;
    try {
      action(*bag_);
      return {};
    } catch (const rosbag::BagException& e) {
      static_cast<void>(bag_.release());
      error.value().message += fmt::format(" ({})", e.what());
      return error;
    }
  }
  Expected<void> Close() {
    return Try([](rosbag::Bag& bag) { bag.close(); });
  }

 private:
  std::string path_;
  std::unique_ptr<rosbag::Bag> bag_;
};

RawBagWriter::RawBagWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RawBagWriter::~RawBagWriter() = default;

Expected<std::unique_ptr<RawBagWriter>> RawBagWriter::Create(const std::string& path,
                                                             BagCompression compression) {
  auto impl = std::make_unique<Impl>(path);
  const auto opened = impl->Try([&](rosbag::Bag& bag) {
    bag.open(path, rosbag::bagmode::Write);
    constexpr rosbag::CompressionType kTypes[] = {
        rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4};
    bag.setCompression(kTypes[static_cast<int>(compression)]);
  });
  if (!opened) return tl::unexpected(opened.error());
  return std::unique_ptr<RawBagWriter>(new RawBagWriter(std::move(impl)));
}

Expected<void> RawBagWriter::Write(const std::string& topic, Time receipt,
                                   const RosMessage& message) {
  const std::int64_t ns = receipt.nanoseconds();
  // rosbag refuses times before 0.000000001 s.
  MLVI_CHECK(ns > 0 && ns / 1'000'000'000 <= 0xffffffffLL,
             "receipt time {} ns does not fit a ROS time", ns);
  const ros::Time time(static_cast<std::uint32_t>(ns / 1'000'000'000),
                       static_cast<std::uint32_t>(ns % 1'000'000'000));
  return impl_->Try([&](rosbag::Bag& bag) { bag.write(topic, time, RosbagMessage(message)); });
}

Expected<void> RawBagWriter::Close() { return impl_->Close(); }

}  // namespace mlvi
