// The only file that uses zlib. Records are an opcode, a length and a content; integers are little-endian.
#include "results/mcap_file.h"

#include <zlib.h>

#include <algorithm>

namespace bielle {
namespace {

constexpr char kMagicBytes[] = "\x89MCAP0\r\n";
constexpr size_t kChunkSize = 1 << 18;  // of records, at which a chunk ends, bytes

enum class Opcode : std::uint8_t {
  Header = 1,
  Footer = 2,
  Schema = 3,
  Channel = 4,
  Message = 5,
  Chunk = 6,
  MessageIndex = 7,
  ChunkIndex = 8,
  Statistics = 11,
  Metadata = 12,
  MetadataIndex = 13,
  SummaryOffset = 14,
  DataEnd = 15
};

template <typename T>
void appendNumber(T value, std::string& out) {
  for (size_t i = 0; i < sizeof value; ++i)
    out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xff);
}

void appendText(const std::string& text, std::string& out) {
  appendNumber(static_cast<std::uint32_t>(text.size()), out);
  out += text;
}

void appendMap(const std::map<std::string, std::string>& map, std::string& out) {
  std::string pairs;
  for (const auto& [key, value] : map) {
    appendText(key, pairs);
    appendText(value, pairs);
  }
  appendText(pairs, out);  // its length in bytes, as that of a text
}

void appendRecord(Opcode opcode, const std::string& content, std::string& out) {
  out += static_cast<char>(opcode);
  appendNumber(std::uint64_t{content.size()}, out);
  out += content;
}

std::uint32_t calcChecksum(const std::string& bytes, size_t begin = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()) + begin, bytes.size() - begin));
}

struct ChunkPlace {
  std::uint64_t first_time = 0, last_time = 0, start = 0, length = 0, index_length = 0, size = 0;
  std::map<int, std::uint64_t> indices;  // where that of each channel is
};

struct MetadataPlace {
  std::uint64_t start = 0, length = 0;
};

class McapWriter {
 public:
  explicit McapWriter(const McapFile& file) : file_(file) {}

  std::string write() {
    out_.assign(kMagicBytes, sizeof kMagicBytes - 1);
    std::string header;
    appendText("", header);  // no profile
    appendText(file_.library, header);
    appendRecord(Opcode::Header, header, out_);
    writeMetadata();
    // The first chunk holds schemas and channels; a reader meets them before any message.
    std::string records = formatSchemas() + formatChannels();
    for (size_t i = 0, end = 0; i < file_.messages.size() || end == 0; i = end) {
      end = writeChunk(i, records);
      records.clear();
    }
    std::string data_end;
    appendNumber(calcChecksum(out_), data_end);
    appendRecord(Opcode::DataEnd, data_end, out_);
    writeSummary();
    return out_ + std::string(kMagicBytes, sizeof kMagicBytes - 1);
  }

 private:
  std::string formatSchemas() const {
    std::string records;
    for (size_t i = 0; i < file_.schemas.size(); ++i) {
      std::string content;
      appendNumber(static_cast<std::uint16_t>(i + 1), content);  // 0 stands for no schema
      for (const std::string* text : {&file_.schemas[i].name, &file_.schemas[i].encoding, &file_.schemas[i].data})
        appendText(*text, content);
      appendRecord(Opcode::Schema, content, records);
    }
    return records;
  }

  std::string formatChannels() const {
    std::string records;
    for (size_t i = 0; i < file_.channels.size(); ++i) {
      const McapChannel& channel = file_.channels[i];
      std::string content;
      appendNumber(static_cast<std::uint16_t>(i), content);
      appendNumber(static_cast<std::uint16_t>(channel.schema + 1), content);
      appendText(channel.topic, content);
      appendText(channel.message_encoding, content);
      appendMap({}, content);
      appendRecord(Opcode::Channel, content, records);
    }
    return records;
  }

  void writeMetadata() {
    for (const auto& [name, values] : file_.metadata) {
      std::string content;
      appendText(name, content);
      appendMap(values, content);
      const size_t start = out_.size();
      appendRecord(Opcode::Metadata, content, out_);
      metadata_[name] = {start, out_.size() - start};
    }
  }

  // Of what is in `records` and the messages from `first` on; returns the message at which the next chunk begins.
  size_t writeChunk(size_t first, std::string records) {
    std::map<int, std::string> indices;
    size_t i = first;
    for (; i < file_.messages.size() && records.size() < kChunkSize; ++i) {
      const McapMessage& message = file_.messages[i];
      std::string& index = indices[message.channel];
      appendNumber(message.time, index);
      appendNumber(std::uint64_t{records.size()}, index);
      std::string content;
      appendNumber(static_cast<std::uint16_t>(message.channel), content);
      appendNumber(static_cast<std::uint32_t>(counts_[message.channel]++), content);  // the sequence
      appendNumber(message.time, content);                                            // when it was logged
      appendNumber(message.time, content);                                            // when it was published
      appendRecord(Opcode::Message, content + message.data, records);
    }
    ChunkPlace place;
    if (i > first) place.first_time = file_.messages[first].time, place.last_time = file_.messages[i - 1].time;
    place.start = out_.size();
    place.size = records.size();
    std::string content;
    appendNumber(place.first_time, content);
    appendNumber(place.last_time, content);
    appendNumber(place.size, content);
    appendNumber(calcChecksum(records), content);
    appendText("", content);  // no compression
    appendNumber(place.size, content);
    appendRecord(Opcode::Chunk, content + records, out_);
    place.length = out_.size() - place.start;
    for (const auto& [channel, index] : indices) {
      place.indices[channel] = out_.size();
      std::string entry;
      appendNumber(static_cast<std::uint16_t>(channel), entry);
      appendText(index, entry);
      appendRecord(Opcode::MessageIndex, entry, out_);
    }
    place.index_length = out_.size() - place.start - place.length;
    chunks_.push_back(place);
    return i;
  }

  std::string formatStatistics() const {
    std::string content, counts;
    for (const auto& [channel, count] : counts_) {
      appendNumber(static_cast<std::uint16_t>(channel), counts);
      appendNumber(count, counts);
    }
    appendNumber(std::uint64_t{file_.messages.size()}, content);
    appendNumber(static_cast<std::uint16_t>(file_.schemas.size()), content);
    appendNumber(static_cast<std::uint32_t>(file_.channels.size()), content);
    appendNumber(std::uint32_t{0}, content);  // attachments
    appendNumber(static_cast<std::uint32_t>(metadata_.size()), content);
    appendNumber(static_cast<std::uint32_t>(chunks_.size()), content);
    appendNumber(file_.messages.empty() ? std::uint64_t{0} : file_.messages.front().time, content);
    appendNumber(file_.messages.empty() ? std::uint64_t{0} : file_.messages.back().time, content);
    appendText(counts, content);
    std::string records;
    appendRecord(Opcode::Statistics, content, records);
    return records;
  }

  std::string formatChunkIndices() const {
    std::string records;
    for (const ChunkPlace& place : chunks_) {
      std::string content, offsets;
      for (const auto& [channel, offset] : place.indices) {
        appendNumber(static_cast<std::uint16_t>(channel), offsets);
        appendNumber(offset, offsets);
      }
      for (std::uint64_t value : {place.first_time, place.last_time, place.start, place.length})
        appendNumber(value, content);
      appendText(offsets, content);
      appendNumber(place.index_length, content);
      appendText("", content);
      appendNumber(place.size, content);
      appendNumber(place.size, content);
      appendRecord(Opcode::ChunkIndex, content, records);
    }
    return records;
  }

  std::string formatMetadataIndices() const {
    std::string records;
    for (const auto& [name, place] : metadata_) {
      std::string content;
      appendNumber(place.start, content);
      appendNumber(place.length, content);
      appendText(name, content);
      appendRecord(Opcode::MetadataIndex, content, records);
    }
    return records;
  }

  void writeSummary() {
    const size_t start = out_.size();
    std::string offsets;
    for (const std::string& group :
         {formatSchemas(), formatChannels(), formatStatistics(), formatChunkIndices(), formatMetadataIndices()}) {
      if (group.empty()) continue;
      std::string content = group.substr(0, 1);  // the opcode of its records
      appendNumber(std::uint64_t{out_.size()}, content);
      appendNumber(std::uint64_t{group.size()}, content);
      appendRecord(Opcode::SummaryOffset, content, offsets);
      out_ += group;
    }
    const std::uint64_t offset_start = out_.size();
    out_ += offsets;
    std::string footer;
    appendNumber(std::uint64_t{start}, footer);
    appendNumber(offset_start, footer);
    // The checksum is of the summary and of the footer up to itself.
    appendRecord(Opcode::Footer, footer + std::string(4, '\0'), out_);
    out_.resize(out_.size() - 4);
    appendNumber(calcChecksum(out_, start), out_);
  }

  const McapFile& file_;
  std::string out_;
  std::vector<ChunkPlace> chunks_;
  std::map<std::string, MetadataPlace> metadata_;
  std::map<int, std::uint64_t> counts_;  // messages of each channel
};

}  // namespace

std::string formatMcapFile(McapFile file) {
  std::stable_sort(file.messages.begin(), file.messages.end(),
                   [](const McapMessage& a, const McapMessage& b) { return a.time < b.time; });
  return McapWriter(file).write();
}

}  // namespace bielle
