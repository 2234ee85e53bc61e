// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/bag_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <cstring>

#include "mlvi/io/bag_fixtures.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

struct Record {
  std::string topic;
  std::int64_t receipt = 0;
  std::vector<std::uint8_t> data;
  bool operator==(const Record&) const = default;
};

struct Reading {
  std::vector<Record> records;
  std::string error;
};

Reading ReadBag(const std::string& path) {
  Reading reading;
  auto reader = BagReader::Open(path);
  if (!reader) {
    reading.error = reader.error().message;
    return reading;
  }
  while (true) {
    const auto message = (*reader)->Next();
    if (!message) {
      EXPECT_TRUE(reading.error.empty());
      reading.error = message.error().message;
      continue;
    }
    if (!*message) break;
    const BagMessage& m = **message;
    reading.records.push_back(
        {m.connection->topic, m.receipt.nanoseconds(), {m.data.begin(), m.data.end()}});
  }
  return reading;
}

// What rosbag_storage says is in the bag.
std::vector<Record> ReadWithRosbag(const std::string& path) {
  std::vector<Record> records;
  rosbag::Bag bag(path);
  rosbag::View view(bag);
  for (const rosbag::MessageInstance& message : view) {
    Record record{message.getTopic(), static_cast<std::int64_t>(message.getTime().toNSec()), {}};
    record.data.resize(message.size());
    ros::serialization::OStream stream(record.data.data(), message.size());
    message.write(stream);
    records.push_back(std::move(record));
  }
  return records;
}

// A bag of many chunks: rosbag closes one after 768 KB, and images of 200 kB fill them.
std::string WriteChunks(BagCompression compression, int messages = 20) {
  const std::string path = test::TemporaryPath("chunks.bag");
  auto writer = RawBagWriter::Create(path, compression);
  EXPECT_TRUE(writer);
  RandomStream random(5);
  for (int i = 0; i < messages; ++i) {
    Image image;
    image.stamp = test::kStart + Duration::FromMilliseconds(100) * i;
    image.width = 500;
    image.height = 400;
    for (int pixel = 0; pixel < image.width * image.height; ++pixel) {
      image.pixels.push_back(static_cast<std::uint8_t>(random.NextBits() % 16));
    }
    EXPECT_TRUE((*writer)->Write("/image", image.stamp, ImageMessage(image, "camera")));
    EXPECT_TRUE((*writer)->Write("/imu", image.stamp + Duration::FromMilliseconds(1),
                                 ImuMessage(test::MakeImu(20 * i))));
  }
  EXPECT_TRUE((*writer)->Close());
  return path;
}

class Compressions : public ::testing::TestWithParam<BagCompression> {};
INSTANTIATE_TEST_SUITE_P(All, Compressions,
                         ::testing::Values(BagCompression::kNone, BagCompression::kBz2,
                                           BagCompression::kLz4));

TEST_P(Compressions, AgreesWithRosbag) {
  const std::string path = WriteChunks(GetParam());
  const Reading reading = ReadBag(path);
  EXPECT_EQ(reading.error, "");
  ASSERT_EQ(reading.records.size(), 40u);
  EXPECT_TRUE(reading.records == ReadWithRosbag(path));
}

TEST(BagReader, AgreesWithRosbagOnRealBags) {
  for (const char* name :
       {"imu_bags/sparkfun_razor.bag", "evo/ROS_example.bag", "evo/tf_example.bag"}) {
    const std::string path = test::SharedData(name);
    MLVI_SKIP_WITHOUT(path);
    const Reading reading = ReadBag(path);
    EXPECT_EQ(reading.error, "") << name;
    std::vector<Record> expected = ReadWithRosbag(path), found = reading.records;
    // The order of messages with equal receipt times is open.
    const auto order = [](const Record& a, const Record& b) {
      return std::tie(a.receipt, a.topic, a.data) < std::tie(b.receipt, b.topic, b.data);
    };
    for (std::size_t i = 1; i < found.size(); ++i)
      ASSERT_LE(found[i - 1].receipt, found[i].receipt);
    std::sort(expected.begin(), expected.end(), order);
    std::sort(found.begin(), found.end(), order);
    EXPECT_TRUE(found == expected) << name;
  }
}

TEST(BagReader, ChunksThatOverlapInTimeAreMerged) {
  // All of one topic, then all of the other, over the same time: as tools that convert topic by
  // topic write it.
  const std::string path = test::TemporaryPath("overlap.bag");
  auto writer = RawBagWriter::Create(path, BagCompression::kLz4);
  ASSERT_TRUE(writer);
  for (const char* topic : {"/a", "/b"}) {
    for (int i = 0; i < 5000; ++i) {
      ASSERT_TRUE((*writer)->Write(topic, test::MakeImu(i).stamp, ImuMessage(test::MakeImu(i))));
    }
  }
  ASSERT_TRUE((*writer)->Close());
  const Reading reading = ReadBag(path);
  ASSERT_EQ(reading.records.size(), 10000u);
  for (std::size_t i = 1; i < 10000; ++i)
    ASSERT_LE(reading.records[i - 1].receipt, reading.records[i].receipt);
}

// Cut off anywhere, a bag yields a true beginning of its messages and then one error.
TEST_P(Compressions, TruncatedBagYieldsItsIntactPart) {
  const std::string path = WriteChunks(GetParam());
  const std::vector<Record> whole = ReadBag(path).records;
  const std::vector<char> bytes = test::ReadBytes(path);
  const std::string cut = test::TemporaryPath("cut.bag");
  std::size_t last_count = 0;
  for (const double share : {0.01, 0.2, 0.4, 0.5, 0.73, 0.95, 0.9999}) {
    test::WriteBytes(
        cut, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(share * bytes.size())});
    const Reading reading = ReadBag(cut);
    EXPECT_THAT(reading.error, HasSubstr("is damaged")) << share;
    ASSERT_LE(reading.records.size(), whole.size());
    for (std::size_t i = 0; i < reading.records.size(); ++i)
      ASSERT_TRUE(reading.records[i] == whole[i]) << share;
    EXPECT_GE(reading.records.size(), last_count);
    // All chunks but the one that is cut: five at most hold less than 8 of the 40 messages each.
    EXPECT_GE(reading.records.size() + 9, share * whole.size()) << share;
    last_count = reading.records.size();
  }
  EXPECT_EQ(last_count, whole.size());  // only the index was cut
}

TEST_P(Compressions, CorruptChunkInTheMiddleIsSkippedAndReported) {
  const std::string path = WriteChunks(GetParam());
  const std::vector<Record> whole = ReadBag(path).records;
  std::vector<char> bytes = test::ReadBytes(path);
  const std::size_t middle = bytes.size() / 2;
  for (std::size_t i = 0; i < 2000; ++i) bytes[middle + i] = static_cast<char>(i * 37);
  const std::string bad = test::TemporaryPath("corrupt.bag");
  test::WriteBytes(bad, bytes);
  const Reading reading = ReadBag(bad);
  // Without compression there is no checksum that could tell; the bytes of an image differ.
  const char* expected = GetParam() == BagCompression::kNone ? "" : "chunk does not unpack";
  EXPECT_THAT(reading.error, HasSubstr(expected));
  EXPECT_GE(reading.records.size(), whole.size() - 10);
  EXPECT_TRUE(reading.records.front() == whole.front());
  EXPECT_TRUE(reading.records.back() == whole.back());
}

// Where the records of chunks begin in a bag that rosbag wrote: "compression" is their first field.
std::vector<std::ptrdiff_t> ChunkRecords(const std::vector<char>& bytes) {
  const std::string name = "compression=";
  std::vector<std::ptrdiff_t> records;
  for (auto at = bytes.begin();
       at = std::search(at, bytes.end(), name.begin(), name.end()), at != bytes.end(); ++at)
    records.push_back(at - bytes.begin() - 8);
  return records;
}

std::uint32_t SizeAt(const std::vector<char>& bytes, std::ptrdiff_t position) {
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data() + position, sizeof(size));
  return size;
}

// Other recorders write the fields of a record's header in another order.
void ReverseFields(std::vector<char>& bytes, std::ptrdiff_t record) {
  const std::ptrdiff_t begin = record + 4, end = begin + SizeAt(bytes, record);
  std::vector<char> reversed;
  for (std::ptrdiff_t field = begin; field < end;) {
    const std::ptrdiff_t next = field + 4 + SizeAt(bytes, field);
    reversed.insert(reversed.begin(), bytes.begin() + field, bytes.begin() + next);
    field = next;
  }
  std::ranges::copy(reversed, bytes.begin() + begin);
}

// A bag without index is damaged within a chunk, or at the beginning of a chunk's record, which then
// cannot be read or claims a wrong size: reading goes on with the next chunk.
TEST_P(Compressions, WithoutIndexReadingGoesOnBehindDamage) {
  const std::string path = WriteChunks(GetParam());
  const std::vector<Record> whole = ReadBag(path).records;
  const std::vector<char> sound = test::ReadBytes(path);
  const std::vector<std::ptrdiff_t> chunks = ChunkRecords(sound);
  ASSERT_GE(chunks.size(), 4u);
  const std::ptrdiff_t size_of_data = chunks[1] + 4 + SizeAt(sound, chunks[1]);
  for (const bool reversed : {false, true}) {
    for (const std::ptrdiff_t damaged : {chunks[1], size_of_data, size_of_data + 5000}) {
      std::vector<char> bad = sound;
      if (reversed) std::ranges::for_each(chunks, [&](auto c) { ReverseFields(bad, c); });
      bad.resize(static_cast<std::size_t>(0.99 * bad.size()));  // no index
      bad[damaged + 2] ^= 0x20;                                 // two million bytes more
      if (damaged > size_of_data) std::fill_n(bad.begin() + damaged, 3000, '\x55');
      const std::string copy = test::TemporaryPath("resync.bag");
      test::WriteBytes(copy, bad);
      const Reading reading = ReadBag(copy);
      EXPECT_THAT(reading.error, HasSubstr("is damaged"));
      // All but the chunk that is damaged and the one that is cut off, of 10 messages at most each
      // (rosbag closes a chunk by the bytes that its compressor has let go).
      EXPECT_GE(reading.records.size() + 20, whole.size()) << reversed << " " << damaged;
      // In their order, each once. Without compression no checksum tells; one image differs then.
      auto next = whole.begin();
      std::size_t same = 0;
      for (const Record& record : reading.records) {
        const auto found = std::find(next, whole.end(), record);
        if (found == whole.end()) continue;
        next = found + 1;
        ++same;
      }
      EXPECT_GE(same + 1, reading.records.size()) << reversed << " " << damaged;
      EXPECT_LT(same, whole.size());
    }
  }
}

// A recorder that is killed leaves its last chunk without end, and both of its sizes at zero.
TEST_P(Compressions, AnUnfinishedChunkIsReadAsFarAsItGoes) {
  const std::string path = WriteChunks(GetParam());
  const std::vector<Record> whole = ReadBag(path).records;
  std::vector<char> bytes = test::ReadBytes(path);
  const std::vector<std::ptrdiff_t> chunks = ChunkRecords(bytes);
  ASSERT_GE(chunks.size(), 4u);
  const std::ptrdiff_t last = chunks[2], size_of_data = last + 4 + SizeAt(bytes, last);
  const std::uint32_t data_size = SizeAt(bytes, size_of_data);
  bytes.resize(static_cast<std::size_t>(size_of_data + 4 + 0.9 * data_size));
  std::fill_n(bytes.begin() + size_of_data - 4, 8, '\0');  // "size", the last field, and the data's
  const std::string killed = test::TemporaryPath("killed.bag");
  test::WriteBytes(killed, bytes);
  const Reading reading = ReadBag(killed);
  EXPECT_THAT(reading.error, HasSubstr("is damaged"));
  bytes.resize(last);
  const std::string without = test::TemporaryPath("without.bag");
  test::WriteBytes(without, bytes);
  const std::size_t before = ReadBag(without).records.size();
  // bz2 gives nothing of a block of 900 kB before its end.
  const bool in_blocks = GetParam() == BagCompression::kBz2;
  EXPECT_GE(reading.records.size(), before + (in_blocks ? 0 : 4));
  ASSERT_LT(reading.records.size(), whole.size());
  EXPECT_TRUE(std::equal(reading.records.begin(), reading.records.end(), whole.begin()));
}

// No mutation crashes the reader, hangs it or makes it use more memory than the file justifies.
TEST_P(Compressions, SurvivesMutatedBytes) {
  const std::string path = WriteChunks(GetParam(), 6);
  const std::vector<char> bytes = test::ReadBytes(path);
  const std::string bad = test::TemporaryPath("mutated.bag");
  RandomStream random(11);
  int damaged = 0;
  for (int round = 0; round < 40; ++round) {
    std::vector<char> mutated = bytes;
    const int count = 1 + static_cast<int>(random.Uniform(0.0, 20.0));
    for (int i = 0; i < count; ++i) {
      // Half of the mutations hit the headers at the beginning and the index at the end.
      const double where = random.Uniform();
      const double at = round % 2 == 0 ? where
                        : where < 0.5  ? where * 0.01
                                       : 1.0 - (1.0 - where) * 0.01;
      mutated[static_cast<std::size_t>(at * (bytes.size() - 1))] =
          static_cast<char>(random.NextBits());
    }
    test::WriteBytes(bad, mutated);
    const Reading reading = ReadBag(bad);
    EXPECT_LE(reading.records.size(), 24u);
    damaged += reading.error.empty() ? 0 : 1;
  }
  EXPECT_GT(damaged, 0);
}

TEST(BagReader, ProgressGrowsToTheEnd) {
  auto reader = BagReader::Open(WriteChunks(BagCompression::kLz4));
  ASSERT_TRUE(reader);
  double last = 0.0;
  for (auto message = (*reader)->Next(); message && *message; message = (*reader)->Next()) {
    EXPECT_GE((*reader)->Progress(), last);
    last = (*reader)->Progress();
  }
  EXPECT_GT(last, 0.95);
  EXPECT_LE(last, 1.0);
}

}  // namespace
}  // namespace mlvi
