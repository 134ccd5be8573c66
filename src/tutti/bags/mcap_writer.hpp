// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti::bags {

struct McapWriterOptions {
  std::string profile = "ros2";                    ///< Empty where channels are not ROS's.
  bool zstd = true;                                ///< Chunks are packed; otherwise they stand as they are.
  std::size_t chunk_bytes = std::size_t{1} << 20;  ///< A chunk ends with the message that makes it this long.
};

/// What a topic's messages are.
struct McapTopic {
  std::string topic;
  std::string type;              ///< "nav_msgs/msg/Odometry"
  std::string schema;            ///< Of the type, in the words of schema_encoding.
  std::string schema_encoding;   ///< "ros2msg", "jsonschema"
  std::string message_encoding;  ///< "cdr", "json"
  std::map<std::string, std::string> metadata;
};

/// Writes MCAP files (https://mcap.dev/spec): chunked, indexed, with statistics and every CRC. Holds one chunk and 30
/// bytes an index entry of it; of each chunk that is written, what its index says. A file that was not closed is cut
/// off, and can be read so. Errors name the file; after the first one the file is of no use.
class McapWriter {
 public:
  static Result<McapWriter> create(const std::string& path, const McapWriterOptions& options = {});
  /// `name` is for the errors.
  static Result<McapWriter> create(std::unique_ptr<std::ostream> stream, std::string name,
                                   const McapWriterOptions& options = {});

  /// For write(). Topics of one type share its schema, which must then be the same.
  std::uint16_t add(const McapTopic& topic);
  /// Log and publish time are `stamp`, not before 1970. Any order; in order of time they are found faster.
  Status write(std::uint16_t channel, Timestamp stamp, std::string_view data);
  /// Index, statistics and what else stands at the end. Nothing may be written after it.
  Status close();

 private:
  /// First and last stamps; 0 and 0 of nothing, as the specification has it.
  struct Span {
    std::uint64_t first = 0, last = 0;
    void take(std::uint64_t ns, bool is_first);
  };
  struct ChunkIndex {
    Span span;
    std::uint64_t offset = 0, length = 0, index_length = 0, packed_size = 0, size = 0;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };

  McapWriter(std::unique_ptr<std::ostream> stream, std::string name, const McapWriterOptions& options)
      : stream_(std::move(stream)), name_(std::move(name)), options_(options) {}
  Status put(std::string_view bytes);
  Status put_chunk();
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] std::string summary(std::uint64_t begin) const;

  std::unique_ptr<std::ostream> stream_;
  std::string name_;
  McapWriterOptions options_;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;                        ///< Of all that is written.
  std::vector<std::string> schemas_, channels_;  ///< Their records; ids are their places, from 1 on.
  std::map<std::string, std::uint16_t> schema_ids_;
  std::vector<std::uint64_t> counts_;  ///< Messages of each channel.
  Span span_;
  std::uint64_t messages_ = 0;
  std::string chunk_;  ///< Records of the one that is being filled,
  Span chunk_span_;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;  ///< stamp, offset in it.
  std::vector<ChunkIndex> chunks_;
};

}  // namespace tutti::bags
