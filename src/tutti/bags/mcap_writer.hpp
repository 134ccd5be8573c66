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
  std::string profile = "ros2";                    ///< The whole file's; empty if its channels are not ROS's.
  bool zstd = true;                                ///< Whether chunks are compressed.
  std::size_t chunk_bytes = std::size_t{1} << 20;  ///< A chunk ends with the message that makes it this long.
};

/// A topic and the type of its messages.
struct McapTopic {
  std::string topic;
  std::string type;              ///< "nav_msgs/msg/Odometry"
  std::string schema;            ///< Definition of the type, in the language schema_encoding.
  std::string schema_encoding;   ///< "ros2msg", "jsonschema"
  std::string message_encoding;  ///< "cdr", "json"
  std::map<std::string, std::string> metadata;
};

/// Writes MCAP files (https://mcap.dev/spec): chunked, indexed, with statistics and every CRC. Memory: one chunk, about
/// 30 bytes per message of it, and an index entry per chunk written. A file that was not closed can be read as one that
/// is cut off. Errors name the file; after the first one the file is of no use.
class McapWriter {
 public:
  static Result<McapWriter> create(const std::string& path, const McapWriterOptions& options = {});
  /// `name` stands for the stream in errors.
  static Result<McapWriter> create(std::unique_ptr<std::ostream> stream, std::string name,
                                   const McapWriterOptions& options = {});

  /// Adds a topic and returns its channel, for write(). Topics of one type share the schema of the first of them.
  std::uint16_t add(const McapTopic& topic);
  /// Writes a message whose log and publish time are `stamp`; a stamp before 1970 is an error. Messages may come in any
  /// order; in order of time a reader finds them faster.
  Status write(std::uint16_t channel, Timestamp stamp, std::string_view data);
  /// Writes index and statistics at the end. Nothing may be written after it.
  Status close();

 private:
  /// First and last stamp; 0 and 0 for no messages, as the specification has it.
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
  std::uint32_t crc_ = 0;                        ///< Over all bytes written.
  std::vector<std::string> schemas_, channels_;  ///< Their records; an id is the position, from 1 on.
  std::map<std::string, std::uint16_t> schema_ids_;
  std::vector<std::uint64_t> counts_;  ///< Messages of each channel.
  Span span_;
  std::uint64_t messages_ = 0;
  std::string chunk_;  ///< Records of the chunk that is being filled.
  Span chunk_span_;
  /// Per channel stamp and offset in chunk_.
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;
  std::vector<ChunkIndex> chunks_;
};

}  // namespace tutti::bags
