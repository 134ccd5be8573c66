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

/// What robots have recorded, whatever it is stored in.
namespace tutti::bags {

struct BagChannel {
  std::string topic;
  std::string type;              ///< "nav_msgs/msg/Odometry", as ROS 2 has it; empty where nothing says it.
  std::string message_encoding;  ///< "cdr", or "ros1"
  friend auto operator<=>(const BagChannel&, const BagChannel&) = default;
};

/// Where a message stands.
struct BagPosition {
  std::uint32_t file = 0;    ///< Of a bag of several.
  std::uint64_t at = 0;      ///< Byte of its record or chunk in the file; of SQLite the row.
  std::uint64_t inside = 0;  ///< Byte in the unpacked chunk.
  friend auto operator<=>(const BagPosition&, const BagPosition&) = default;
};

struct BagMessage {
  const BagChannel* channel = nullptr;  ///< The reader's.
  Timestamp log_time, publish_time;
  std::string_view data;  ///< Valid until the reader is asked for anything else.
  BagPosition position;
};

/// Gives messages in the order in which they are stored, and never holds more than one chunk of them. An error names
/// file, place and what was expected, and costs one record or chunk: whoever asks again gets what comes behind it.
class BagReader {
 public:
  virtual ~BagReader() = default;
  /// Nothing at the end.
  virtual Result<std::optional<BagMessage>> next() = 0;
  /// The next message is the one at a position that a message had. Cheap within the chunk that was read last.
  virtual Status seek(const BagPosition& position) = 0;
  /// Those that were met so far, or that an index names.
  [[nodiscard]] virtual std::vector<const BagChannel*> channels() const = 0;
  /// By the bag's own statistics.
  [[nodiscard]] virtual std::optional<std::uint64_t> stated_messages() const { return std::nullopt; }
  /// What is odd about it without being in the way, such as where it is cut off.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
  /// In what it is stored, in words, as far as it was read: "MCAP, 3 chunks".
  [[nodiscard]] virtual std::string storage() const = 0;

 protected:
  BagReader() = default;
  BagReader(const BagReader&) = default;
  BagReader(BagReader&&) = default;
  BagReader& operator=(const BagReader&) = default;
  BagReader& operator=(BagReader&&) = default;
};

/// A file (.mcap; .db3, SQLite as rosbag2 writes it; either packed as a whole by zstd) or a folder of rosbag2's, with
/// or without metadata.yaml, of one or several files. What it is is told by its first bytes, not by its name. Messages
/// that are packed one by one (rosbag2's compression_mode MESSAGE) come out unpacked. What is packed as a whole is
/// unpacked into the system's folder for temporary files, one file at a time.
Result<std::unique_ptr<BagReader>> open_bag(const std::string& path);

}  // namespace tutti::bags
