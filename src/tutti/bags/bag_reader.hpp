// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

/// Reads recordings of robots message by message, whichever format they are stored in.
namespace tutti::bags {

struct BagChannel {
  std::string topic;
  std::string type;  ///< Message type in ROS 2's words, "nav_msgs/msg/Odometry"; empty if the file does not have it.
  std::string message_encoding;  ///< "cdr", or "ros1"
  friend auto operator<=>(const BagChannel&, const BagChannel&) = default;
};

/// Where a message is in a bag, for BagReader::seek().
struct BagPosition {
  std::uint32_t file = 0;    ///< Position of the file among those of the bag.
  std::uint64_t at = 0;      ///< Byte of its record or chunk in the file; in SQLite the row.
  std::uint64_t inside = 0;  ///< Byte in the decompressed chunk.
  friend auto operator<=>(const BagPosition&, const BagPosition&) = default;
};

struct BagMessage {
  const BagChannel* channel = nullptr;  ///< Owned by the reader.
  Timestamp log_time, publish_time;
  std::string_view data;  ///< Valid until the next call of the reader.
  BagPosition position;
};

/// Gives messages in the order in which they are stored, holding one chunk of them at most. An error names file, place
/// and what was expected, and costs one record or chunk: the next call goes on behind it. One thread at a time.
class BagReader {
 public:
  virtual ~BagReader() = default;
  /// The next message; no value at the end.
  virtual Result<std::optional<BagMessage>> next() = 0;
  /// Makes the message at `position`, taken from a BagMessage, the next one. Cheap within the chunk that was read last;
  /// a file without an index may be read up to the position once.
  virtual Status seek(const BagPosition& position) = 0;
  /// The channels met so far and those that an index names. The pointers live as long as the reader.
  [[nodiscard]] virtual std::vector<const BagChannel*> channels() const = 0;
  /// Number of messages by the bag's own statistics, if it has any.
  [[nodiscard]] virtual std::optional<std::uint64_t> stated_messages() const { return std::nullopt; }
  /// Oddities that do not prevent reading, such as where the bag is cut off.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
  /// The format in words, as far as the bag was read: "MCAP, 3 chunks".
  [[nodiscard]] virtual std::string storage() const = 0;

 protected:
  BagReader() = default;
  BagReader(const BagReader&) = default;
  BagReader(BagReader&&) = default;
  BagReader& operator=(const BagReader&) = default;
  BagReader& operator=(BagReader&&) = default;
};

/// Opens a file (MCAP, SQLite as rosbag2 writes it, or a ROS 1 bag, distinguished by their first bytes; each may be
/// compressed as a whole by zstd) or a folder of rosbag2 with one or several such files, with or without metadata.yaml.
/// Messages that are compressed one by one (rosbag2's compression_mode MESSAGE) come out decompressed. A file that is
/// compressed as a whole is decompressed into the system's folder for temporary files, one file at a time.
Result<std::unique_ptr<BagReader>> open_bag(const std::string& path);

}  // namespace tutti::bags
