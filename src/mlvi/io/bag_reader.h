// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Streaming reader of ROS 1 bags (format 2.0; wiki.ros.org/Bags/Format/2.0). A few chunks are in
// memory (the one that is read, those that overlap it in time, and with an index the next ones,
// which free threads unpack ahead), whatever the length of the bag. With its
// index a bag is read in order of receipt time; without one (recording killed, file cut off: no
// index at the end) it is scanned front to back and everything intact is delivered. Damage never
// ends the reading early: what can be read is read, and an Error that describes the first damage
// follows the last message.
//
// Why not rosbag::View: it holds the index entries of all messages in memory (64 bytes each),
// refuses bags without index, and trusts every length in the file.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "mlvi/base/background_tasks.h"
#include "mlvi/base/error.h"
#include "mlvi/io/chunk_job.h"
#include "mlvi/io/wire_reader.h"

namespace mlvi {

struct BagConnection {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;        // "sensor_msgs/Imu"
  std::string definition;  // the message definition that the recorder stored
};

struct BagMessage {
  const BagConnection* connection = nullptr;  // lives as long as the reader
  Time receipt;                               // when the recorder got it
  ByteSpan data;                              // valid until the next call of Next()
};

class BagReader {
 public:
  // Errors (kInput): no such file, empty file, no ROS 1 bag, encrypted bag.
  static Expected<std::unique_ptr<BagReader>> Open(const std::string& path);

  // The next message; empty at the end. A damaged bag yields one Error after its last readable
  // message, then the end.
  Expected<std::optional<BagMessage>> Next();

  // Known so far: all of the bag when `indexed()`, else those met up to now.
  const std::map<std::uint32_t, BagConnection>& connections() const { return connections_; }
  // Whether the bag has a readable index.
  bool indexed() const { return indexed_; }
  // Receipt times of the first and the last message by the index; empty without index, or without
  // messages.
  std::optional<std::pair<Time, Time>> span() const;
  const std::string& path() const { return path_; }
  std::uint64_t file_size() const { return file_size_; }
  // Share of the file consumed, in [0, 1].
  double Progress() const;

 private:
  struct ChunkInfo {
    std::uint64_t position = 0;  // of the chunk record in the file
    Time start, end;             // earliest and latest receipt time
    auto operator<=>(const ChunkInfo& other) const {
      if (const auto order = start <=> other.start; order != 0) return order;
      return position <=> other.position;
    }
    bool operator==(const ChunkInfo&) const = default;
  };
  struct Entry {
    Time receipt;
    std::uint32_t connection = 0;
    std::size_t offset = 0;
    std::size_t size = 0;
  };
  struct Chunk {
    std::uint64_t position = 0;
    std::vector<std::uint8_t> bytes;
    std::vector<Entry> entries;  // by receipt time
    std::size_t next = 0;
  };
  // A record of the file: header fields and where its data lies.
  struct Record {
    std::vector<std::uint8_t> header;
    std::uint64_t data_position = 0;
    std::uint32_t data_size = 0;
    std::uint64_t end() const { return data_position + data_size; }
  };

  explicit BagReader(std::string path) : path_(std::move(path)) {}
  Expected<void> ReadPreamble();
  bool ReadIndex(std::uint64_t position, std::uint32_t connections, std::uint32_t chunks);
  std::optional<Record> ReadRecord(std::uint64_t position);
  bool ReadBytes(std::uint64_t position, std::size_t size, std::vector<std::uint8_t>& bytes);
  void AddConnection(ByteSpan header, ByteSpan data);
  tl::expected<PackedChunk, std::string> ReadPacked(std::uint64_t position);
  void UnpackAhead();
  void LoadChunk(std::uint64_t position);
  void ParseChunk(Chunk& chunk, bool complete);
  void LoadDueChunks();
  bool IsRecord(const std::optional<Record>& record) const;
  bool ScanNextChunk();
  std::uint64_t FindChunk(std::uint64_t position);
  void ReportDamage(std::uint64_t position, const std::string& what);

  std::string path_;
  std::ifstream file_;
  std::uint64_t file_size_ = 0;
  std::map<std::uint32_t, BagConnection> connections_;
  bool indexed_ = false;
  std::vector<ChunkInfo> chunk_infos_;  // by start time; empty without index
  std::size_t next_chunk_ = 0;
  BackgroundTasks background_;
  std::map<std::uint64_t, ChunkJob> ahead_;  // by position of the chunk
  std::uint64_t scan_position_ = 0;
  std::uint64_t scanned_chunk_ = 0;  // position of the last one
  std::uint64_t bytes_consumed_ = 0;
  std::vector<std::unique_ptr<Chunk>> open_chunks_;
  // Keeps the data of the last message alive when its chunk is used up.
  std::unique_ptr<Chunk> last_;
  std::optional<std::string> damage_;
  int damaged_places_ = 0;
  bool damage_reported_ = false;
};

}  // namespace mlvi
