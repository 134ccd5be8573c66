// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "tutti/bags/mcap_writer.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti::bags {

/// Whether a subscriber that comes late gets the last message (latched, as of /tf_static and maps) or not.
enum class Durability { volatile_, latched };

/// Writes ROS 2 messages into one MCAP file as rosbag2 does: a topic's record comes with its first message and states
/// its type, the type's definition and the definition's hash. Errors are those of McapWriter.
class RosWriter {
 public:
  struct Topic {
    std::uint16_t channel = 0;
    std::string type;
    Durability durability = Durability::volatile_;
    std::uint64_t count = 0;
  };

  explicit RosWriter(McapWriter writer) : writer_(std::move(writer)) {}
  static Result<RosWriter> create(const std::string& path, const McapWriterOptions& options = {});

  /// `cdr`: a message of a `type` that ros_definitions.hpp knows ("nav_msgs/msg/Odometry"); all messages of a topic
  /// have one type (checked).
  Status write(const std::string& topic, const std::string& type, Timestamp stamp, std::string_view cdr,
               Durability durability = Durability::volatile_);
  /// Writes data that is no ROS message: `json`, an object of `schema` (JSON Schema). Foxglove and PlotJuggler
  /// show it.
  Status write_json(const std::string& topic, const std::string& type, const std::string& schema, Timestamp stamp,
                    std::string_view json);
  Status close() { return writer_.close(); }

  [[nodiscard]] const std::map<std::string, Topic>& topics() const { return topics_; }
  [[nodiscard]] Timestamp first() const { return first_; }
  [[nodiscard]] Timestamp last() const { return last_; }

 private:
  Status put(const McapTopic& definition, Durability durability, Timestamp stamp, std::string_view data);

  McapWriter writer_;
  std::map<std::string, Topic> topics_;
  Timestamp first_ = kLastTimestamp, last_ = kFirstTimestamp;
};

/// Writes a bag as rosbag2 does: a folder NAME with NAME_0.mcap and metadata.yaml, for `ros2 bag play` and the like.
class BagWriter {
 public:
  /// `folder` must be missing or empty; missing folders above it are made.
  static Result<BagWriter> create(const std::string& folder, const McapWriterOptions& options = {});

  Status write(const std::string& topic, const std::string& type, Timestamp stamp, std::string_view cdr,
               Durability durability = Durability::volatile_) {
    return writer_.write(topic, type, stamp, cdr, durability);
  }
  /// Writes the end of the file and metadata.yaml; nothing may be written after it.
  Status close();

  [[nodiscard]] const RosWriter& written() const { return writer_; }

 private:
  BagWriter(std::string folder, std::string file, RosWriter writer)
      : folder_(std::move(folder)), file_(std::move(file)), writer_(std::move(writer)) {}

  std::string folder_, file_;
  RosWriter writer_;
};

}  // namespace tutti::bags
