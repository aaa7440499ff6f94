#pragma once
/// \file Files of time-stamped messages in the container MCAP, version 0 (mcap.dev/spec).
///
/// A file is written whole: messages in uncompressed chunks, each with a checksum and with an index of its messages by time;
/// then a summary that repeats schemas and channels, counts messages and tells where everything is, so that readers go to any
/// time without reading the rest; checksums (CRC-32) of the data and of the summary.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace bielle {

struct McapSchema {
  std::string name, encoding, data;  ///< e.g. "foxglove.Log", "protobuf", a FileDescriptorSet
};

struct McapChannel {
  std::string topic, message_encoding;
  int schema = 0;  ///< index into the schemas
};

struct McapMessage {
  int channel = 0;         ///< index into the channels
  std::uint64_t time = 0;  ///< ns
  std::string data;
};

struct McapFile {
  std::string library;  ///< that writes it
  std::vector<McapSchema> schemas;
  std::vector<McapChannel> channels;
  std::vector<McapMessage> messages;
  std::map<std::string, std::map<std::string, std::string>> metadata;  ///< records of keys and values, by name
};

/// The bytes of the file. Messages are written in the order of their times; those of one time keep theirs.
std::string formatMcapFile(McapFile file);

}  // namespace bielle
