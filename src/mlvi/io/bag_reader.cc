// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/bag_reader.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <limits>
#include <tuple>

#include "mlvi/io/bag_compression.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;
constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
// A chunk claims its unpacked size; recorders cut chunks at 0.8 MB or after one large message.
constexpr std::size_t kLargestChunk = std::size_t{1} << 30;
constexpr std::size_t kLargestHeader = std::size_t{1} << 24;
// What free threads may unpack while the estimator works: so many chunks, or so many bytes if fewer.
constexpr std::size_t kChunksAhead = 4;
constexpr std::size_t kBytesAhead = std::size_t{64} << 20;

enum class Op : std::uint8_t {
  kMessage = 2,
  kBag = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

// A header is a list of blocks "name=value".
std::optional<ByteSpan> Field(ByteSpan header, std::string_view name) {
  WireReader reader(header);
  while (reader.ok() && reader.remaining() > 0) {
    const ByteSpan block = reader.Block();
    const std::string_view text(reinterpret_cast<const char*>(block.data()), block.size());
    if (text.size() > name.size() && text.starts_with(name) && text[name.size()] == '=') {
      return block.subspan(name.size() + 1);
    }
  }
  return std::nullopt;
}

template <typename T>
std::optional<T> NumberField(ByteSpan header, std::string_view name) {
  const auto field = Field(header, name);
  if (!field || field->size() != sizeof(T)) return std::nullopt;
  return WireReader(*field).Read<T>();
}

std::string TextField(ByteSpan header, std::string_view name) {
  const auto field = Field(header, name);
  return field ? std::string(field->begin(), field->end()) : std::string();
}

std::optional<Time> TimeField(ByteSpan header, std::string_view name) {
  const auto field = Field(header, name);
  if (!field || field->size() != 8) return std::nullopt;
  return WireReader(*field).ReadTime();
}

bool IsOp(ByteSpan header, Op op) {
  return NumberField<std::uint8_t>(header, "op") == static_cast<std::uint8_t>(op);
}

// Whether it is the header of any record that bags have.
bool HasOp(ByteSpan header) {
  const auto op = NumberField<std::uint8_t>(header, "op");
  return op && *op >= static_cast<std::uint8_t>(Op::kMessage) &&
         *op <= static_cast<std::uint8_t>(Op::kConnection);
}

// What the file may be instead of a ROS 1 bag.
std::string_view GuessFormat(std::string_view begin) {
  if (begin.starts_with("#ROSBAG V1"))
    return "a ROS bag of format 1.x; convert it with `rosbag fix`";
  if (begin.starts_with("SQLite format 3"))
    return "an SQLite file, probably a ROS 2 bag (db3); convert it to ROS 1";
  if (begin.starts_with("\x89MCAP"))
    return "an MCAP file, probably a ROS 2 bag; convert it to ROS 1";
  return "something else; is it a partial download or an error page?";
}

}  // namespace

Expected<std::unique_ptr<BagReader>> BagReader::Open(const std::string& path) {
  std::unique_ptr<BagReader> reader(new BagReader(path));
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return MakeError(kKind, "'{}' is a folder: name the bag files in it, in the order of recording",
                     path);
  }
  reader->file_.open(path, std::ios::binary);
  if (!reader->file_) {
    return MakeError(kKind, "cannot open bag '{}': does the file exist, may you read it?", path);
  }
  reader->file_size_ = std::filesystem::file_size(path, error);
  if (reader->file_size_ == 0) {
    return MakeError(kKind, "bag '{}' is empty (0 bytes): a failed download or a full disk?", path);
  }
  if (auto valid = reader->ReadPreamble(); !valid) return tl::unexpected(valid.error());
  return reader;
}

Expected<void> BagReader::ReadPreamble() {
  std::vector<std::uint8_t> magic;
  ReadBytes(0, std::min<std::uint64_t>(16, file_size_), magic);
  const std::string_view begin(reinterpret_cast<const char*>(magic.data()), magic.size());
  if (!begin.starts_with(kMagic)) {
    return MakeError(kKind, "'{}' is no ROS 1 bag: it does not begin with '#ROSBAG V2.0'; it is {}",
                     path_, GuessFormat(begin));
  }
  scan_position_ = kMagic.size();
  const auto record = ReadRecord(kMagic.size());
  if (!record || !IsOp(record->header, Op::kBag)) return {};  // scanned; damage shows there
  if (!TextField(record->header, "encryptor").empty()) {
    return MakeError(kKind, "bag '{}' is encrypted ({}): decrypt it with `rosbag decrypt` first",
                     path_, TextField(record->header, "encryptor"));
  }
  const auto index = NumberField<std::uint64_t>(record->header, "index_pos");
  const auto connections = NumberField<std::uint32_t>(record->header, "conn_count");
  const auto chunks = NumberField<std::uint32_t>(record->header, "chunk_count");
  scan_position_ = record->end();
  indexed_ = index && connections && chunks && *index >= scan_position_ &&
             ReadIndex(*index, *connections, *chunks);
  if (!indexed_) {
    connections_.clear();
    chunk_infos_.clear();
  }
  return {};
}

bool BagReader::ReadIndex(std::uint64_t position, std::uint32_t connections, std::uint32_t chunks) {
  for (std::uint64_t i = 0; i < std::uint64_t{connections} + chunks; ++i) {
    const auto record = ReadRecord(position);
    std::vector<std::uint8_t> data;
    if (!record || record->end() > file_size_) return false;
    if (IsOp(record->header, Op::kConnection)) {
      if (!ReadBytes(record->data_position, record->data_size, data)) return false;
      AddConnection(record->header, data);
    } else {
      const auto chunk = NumberField<std::uint64_t>(record->header, "chunk_pos");
      const auto start = TimeField(record->header, "start_time");
      const auto end = TimeField(record->header, "end_time");
      if (!IsOp(record->header, Op::kChunkInfo) || !chunk || !start || !end) return false;
      chunk_infos_.push_back({.position = *chunk, .start = *start, .end = *end});
    }
    position = record->end();
  }
  std::sort(chunk_infos_.begin(), chunk_infos_.end());
  return chunk_infos_.size() == chunks;
}

bool BagReader::ReadBytes(std::uint64_t position, std::size_t size,
                          std::vector<std::uint8_t>& bytes) {
  if (position > file_size_ || size > file_size_ - position) return false;
  bytes.resize(size);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(position));
  file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  return file_.good();
}

// The record may reach beyond the end of the file; its header does not.
std::optional<BagReader::Record> BagReader::ReadRecord(std::uint64_t position) {
  std::vector<std::uint8_t> number;
  Record record;
  if (!ReadBytes(position, 4, number)) return std::nullopt;
  const auto header_size = WireReader(number).Read<std::uint32_t>();
  if (header_size == 0 || header_size > kLargestHeader) return std::nullopt;
  if (!ReadBytes(position + 4, header_size, record.header)) return std::nullopt;
  if (!ReadBytes(position + 4 + header_size, 4, number)) return std::nullopt;
  record.data_size = WireReader(number).Read<std::uint32_t>();
  record.data_position = position + 8 + header_size;
  return record;
}

void BagReader::AddConnection(ByteSpan header, ByteSpan data) {
  const auto id = NumberField<std::uint32_t>(header, "conn");
  if (!id || connections_.contains(*id)) return;
  connections_[*id] = {.id = *id,
                       .topic = TextField(header, "topic"),
                       .type = TextField(data, "type"),
                       .definition = TextField(data, "message_definition")};
}

void BagReader::ReportDamage(std::uint64_t position, const std::string& what) {
  ++damaged_places_;
  if (!damage_) damage_ = fmt::format("at byte {} of {}, {}", position, file_size_, what);
}

// The chunk record at `position`, or what is wrong with it.
tl::expected<PackedChunk, std::string> BagReader::ReadPacked(std::uint64_t position) {
  const auto record = ReadRecord(position);
  const auto size = record ? NumberField<std::uint32_t>(record->header, "size") : std::nullopt;
  if (!size || !IsOp(record->header, Op::kChunk))
    return tl::unexpected<std::string>("a chunk should be here, but there is none");
  PackedChunk chunk{.compression = TextField(record->header, "compression"), .size = *size};
  if (chunk.compression != "none" && chunk.compression != "bz2" && chunk.compression != "lz4")
    return tl::unexpected(fmt::format("a chunk of unknown compression '{}'", chunk.compression));
  if (*size > kLargestChunk)
    return tl::unexpected(fmt::format("a chunk that claims {} bytes", *size));
  // Of a chunk that the end of the file cuts off, the first part is read. A recorder that is killed
  // leaves both sizes of its last chunk at zero; it fills them in at the chunk's end.
  const std::uint64_t rest = file_size_ - std::min(file_size_, record->data_position);
  const bool unfinished = *size == 0 && record->data_size == 0 && rest > 0;
  const std::uint64_t present =
      unfinished ? rest : std::min<std::uint64_t>(record->data_size, rest);
  if (unfinished) chunk.size = chunk.compression == "none" ? present : kLargestChunk;
  chunk.packed_size = present;
  chunk.cut_off = unfinished || present < record->data_size;
  if (!ReadBytes(record->data_position, present, chunk.bytes))
    return tl::unexpected<std::string>("the file cannot be read here");
  return chunk;
}

// Has free threads unpack the chunks that the index names next.
void BagReader::UnpackAhead() {
  std::size_t bytes = 0;
  const std::size_t end = std::min(next_chunk_ + kChunksAhead, chunk_infos_.size());
  for (std::size_t i = next_chunk_; i < end && bytes < kBytesAhead; ++i) {
    const std::uint64_t position = chunk_infos_[i].position;
    if (!ahead_.contains(position)) {
      // What is wrong with it is said when its turn comes.
      auto packed = ReadPacked(position);
      if (!packed || packed->compression == "none") continue;
      ahead_.emplace(position, ChunkJob(background_, *std::move(packed)));
    }
    bytes += ahead_.at(position).packed().size;
  }
}

void BagReader::LoadChunk(std::uint64_t position) {
  if (!ahead_.contains(position)) {
    auto packed = ReadPacked(position);
    if (!packed) return ReportDamage(position, packed.error());
    ahead_.emplace(position, ChunkJob(background_, *std::move(packed)));
  }
  const auto job = ahead_.extract(position);
  UnpackAhead();
  const PackedChunk& packed = job.mapped().packed();
  Decompressed unpacked = job.mapped().Take();
  auto chunk = std::make_unique<Chunk>();
  chunk->position = position;
  chunk->bytes = std::move(unpacked.bytes);
  ParseChunk(*chunk, unpacked.complete && !packed.cut_off);
  if (packed.cut_off) {
    ReportDamage(position,
                 "the file ends within a chunk: the recording or a copy of it was cut off");
  } else if (!unpacked.complete) {
    ReportDamage(position, fmt::format("a {} chunk does not unpack: {} of {} bytes",
                                       packed.compression, chunk->bytes.size(), packed.size));
  }
  bytes_consumed_ += packed.packed_size;
  if (!chunk->entries.empty()) open_chunks_.push_back(std::move(chunk));
}

void BagReader::ParseChunk(Chunk& chunk, bool complete) {
  WireReader reader(chunk.bytes);
  while (reader.remaining() > 0) {
    const ByteSpan header = reader.Block();
    const ByteSpan data = reader.Block();
    if (!reader.ok()) {
      if (complete) ReportDamage(chunk.position, "a record in a chunk has an impossible length");
      break;
    }
    if (IsOp(header, Op::kConnection)) AddConnection(header, data);
    if (!IsOp(header, Op::kMessage)) continue;
    const auto connection = NumberField<std::uint32_t>(header, "conn");
    const auto receipt = TimeField(header, "time");
    if (!connection || !receipt || !connections_.contains(*connection)) {
      ReportDamage(chunk.position, "a message in a chunk belongs to no topic");
      continue;
    }
    chunk.entries.push_back({.receipt = *receipt,
                             .connection = *connection,
                             .offset = static_cast<std::size_t>(data.data() - chunk.bytes.data()),
                             .size = data.size()});
  }
  std::stable_sort(chunk.entries.begin(), chunk.entries.end(),
                   [](const Entry& a, const Entry& b) { return a.receipt < b.receipt; });
}

// Where the next chunk record behind `position` begins; the size of the file without one.
std::uint64_t BagReader::FindChunk(std::uint64_t position) {
  constexpr std::string_view kName = "compression=";
  // Recorders write the fields of a header in any order: those before the name, with their sizes.
  constexpr std::uint64_t kBefore = 64;
  constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
  std::vector<std::uint8_t> bytes;
  for (++position; position < file_size_; position += kBlock) {
    const std::uint64_t size = std::min(kBlock + kBefore + kName.size(), file_size_ - position);
    if (!ReadBytes(position, size, bytes)) continue;  // the medium does not give it
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (auto at = text.find(kName); at != text.npos; at = text.find(kName, at + 1)) {
      for (std::size_t begin = at - std::min(at, kBefore); begin + 8 <= at; ++begin) {
        std::uint32_t header_size = 0;
        std::memcpy(&header_size, bytes.data() + begin, sizeof(header_size));
        if (begin + header_size < at || header_size > 2 * kBefore) continue;
        const auto record = ReadRecord(position + begin);
        if (record && IsOp(record->header, Op::kChunk)) return position + begin;
      }
    }
  }
  return file_size_;
}

bool BagReader::IsRecord(const std::optional<Record>& record) const {
  return record && record->end() <= file_size_ && HasOp(record->header);
}

// Opens the next chunk in the order of the file; false at the end.
bool BagReader::ScanNextChunk() {
  while (scan_position_ < file_size_) {
    const std::uint64_t position = scan_position_;
    const auto record = ReadRecord(position);
    const bool is_chunk = record && IsOp(record->header, Op::kChunk);
    if (is_chunk) {
      LoadChunk(position);
      scanned_chunk_ = position;
    } else if (!IsRecord(record)) {
      ReportDamage(position, "no readable record: a damaged medium, or the end of what was copied");
    }
    // Sizes may be damaged, too, that of the chunk before a record included.
    const bool leads_on =
        record && (record->end() == file_size_ || IsRecord(ReadRecord(record->end())));
    scan_position_ = leads_on ? record->end() : FindChunk(scanned_chunk_);
    if (!open_chunks_.empty()) return true;
  }
  return false;
}

// Opens chunks until none that is still closed could hold an earlier message than the open ones.
void BagReader::LoadDueChunks() {
  const auto earliest = [&] {
    Time time = Time::FromNanoseconds(std::numeric_limits<std::int64_t>::max());
    for (const auto& chunk : open_chunks_)
      time = std::min(time, chunk->entries[chunk->next].receipt);
    return time;
  };
  while (next_chunk_ < chunk_infos_.size() &&
         (open_chunks_.empty() || chunk_infos_[next_chunk_].start < earliest())) {
    LoadChunk(chunk_infos_[next_chunk_++].position);
  }
}

Expected<std::optional<BagMessage>> BagReader::Next() {
  last_.reset();
  if (indexed_) {
    LoadDueChunks();
  } else if (open_chunks_.empty()) {
    ScanNextChunk();
  }
  if (open_chunks_.empty()) {
    if (!indexed_ && !damage_)
      damage_ = "it has no index: the recorder did not end properly, or the end is missing";
    if (!damage_ || damage_reported_) return std::nullopt;
    damage_reported_ = true;
    return MakeError(
        kKind,
        "bag '{}' is damaged: {}{}; everything readable was used. `rosbag reindex` or a new copy "
        "may help",
        path_, *damage_,
        damaged_places_ > 1 ? fmt::format(" (and {} more places)", damaged_places_ - 1) : "");
  }
  const auto chunk =
      std::min_element(open_chunks_.begin(), open_chunks_.end(), [](const auto& a, const auto& b) {
        const Entry &first = a->entries[a->next], &second = b->entries[b->next];
        return std::tie(first.receipt, a->position) < std::tie(second.receipt, b->position);
      });
  const Entry& entry = (*chunk)->entries[(*chunk)->next++];
  const BagMessage message{.connection = &connections_.at(entry.connection),
                           .receipt = entry.receipt,
                           .data = ByteSpan((*chunk)->bytes).subspan(entry.offset, entry.size)};
  if ((*chunk)->next == (*chunk)->entries.size()) {
    last_ = std::move(*chunk);
    open_chunks_.erase(chunk);
  }
  return message;
}

std::optional<std::pair<Time, Time>> BagReader::span() const {
  if (chunk_infos_.empty()) return std::nullopt;
  Time end;
  for (const ChunkInfo& chunk : chunk_infos_) end = std::max(end, chunk.end);
  return std::pair(chunk_infos_.front().start, end);
}

double BagReader::Progress() const {
  const std::uint64_t consumed = indexed_ ? bytes_consumed_ : scan_position_;
  return std::min(1.0, static_cast<double>(consumed) / static_cast<double>(file_size_));
}

}  // namespace mlvi
