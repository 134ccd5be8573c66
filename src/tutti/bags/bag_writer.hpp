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

/// How late a subscriber may come. Latched: who comes late is given the last message, as of /tf_static and of maps.
enum class Durability { volatile_, latched };

/// Writes ROS 2's messages as rosbag2 does: a topic begins with its first message, and each says its type, its
/// definition and that definition's hash.
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

  /// `cdr` of a type that ros_definitions.hpp knows ("nav_msgs/msg/Odometry"), the same for all of a topic.
  Status write(const std::string& topic, const std::string& type, Timestamp stamp, std::string_view cdr,
               Durability durability = Durability::volatile_);
  /// `json` as `schema`, JSON Schema of an object, says: what is no message of ROS's. Foxglove and PlotJuggler read it.
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

/// A bag as rosbag2 makes it: a folder NAME with NAME_0.mcap and metadata.yaml, for `ros2 bag play` and the like.
class BagWriter {
 public:
  /// The folder must not be there, or be empty; those above it are made.
  static Result<BagWriter> create(const std::string& folder, const McapWriterOptions& options = {});

  Status write(const std::string& topic, const std::string& type, Timestamp stamp, std::string_view cdr,
               Durability durability = Durability::volatile_) {
    return writer_.write(topic, type, stamp, cdr, durability);
  }
  /// Writes what stands at the end of the file, and metadata.yaml.
  Status close();

  [[nodiscard]] const RosWriter& written() const { return writer_; }

 private:
  BagWriter(std::string folder, std::string file, RosWriter writer)
      : folder_(std::move(folder)), file_(std::move(file)), writer_(std::move(writer)) {}

  std::string folder_, file_;
  RosWriter writer_;
};

}  // namespace tutti::bags
