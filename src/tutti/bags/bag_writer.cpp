// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_writer.hpp"

#include <algorithm>
#include <filesystem>

#include "tutti/bags/ros_definitions.hpp"
#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"

namespace tutti::bags {
namespace {

namespace fs = std::filesystem;

/// In rosbag2's numbers: history keep-last, reliable; durability 1 transient local, 2 volatile; no deadlines.
std::string qos(Durability durability, const char* indent) {
  return fmt::format(
      "- history: 1\n{0}  depth: 10\n{0}  reliability: 1\n{0}  durability: {1}\n{0}  deadline:\n{0}    sec: 0\n"
      "{0}    nsec: 0\n{0}  lifespan:\n{0}    sec: 0\n{0}    nsec: 0\n{0}  liveliness: 1\n"
      "{0}  liveliness_lease_duration:\n{0}    sec: 0\n{0}    nsec: 0\n{0}  avoid_ros_namespace_conventions: false",
      indent, durability == Durability::latched ? 1 : 2);
}

std::string metadata(const RosWriter& bag, const std::string& file) {
  std::uint64_t messages = 0;
  std::string topics;
  for (const auto& [name, topic] : bag.topics()) {
    messages += topic.count;
    topics += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
        "        offered_qos_profiles: |-\n          {}\n        type_description_hash: {}\n      message_count: {}\n",
        name, topic.type, qos(topic.durability, "          "), ros_type_hash(topic.type), topic.count);
  }
  const std::int64_t start = messages > 0 ? bag.first().ns : 0;
  const std::int64_t duration = messages > 0 ? bag.last().ns - bag.first().ns : 0;
  constexpr const char* kTimes =
      "{0}duration:\n{0}  nanoseconds: {1}\n{0}starting_time:\n{0}  nanoseconds_since_epoch: {2}\n";
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n{}  message_count: {}\n"
      "  topics_with_message_count:{}\n{}  compression_format: \"\"\n  compression_mode: \"\"\n"
      "  relative_file_paths:\n    - {}\n  files:\n    - path: {}\n{}      message_count: {}\n"
      "  custom_data: ~\n  ros_distro: \"\"\n",
      fmt::format(fmt::runtime(kTimes), "  ", duration, start), messages, topics.empty() ? " []" : "", topics, file,
      file, fmt::format(fmt::runtime(kTimes), "      ", duration, start), messages);
}

}  // namespace

Result<RosWriter> RosWriter::create(const std::string& path, const McapWriterOptions& options) {
  auto writer = McapWriter::create(path, options);
  if (!writer) return tl::unexpected(writer.error());
  return RosWriter(std::move(*writer));
}

Status RosWriter::put(const McapTopic& definition, Durability durability, Timestamp stamp, std::string_view data) {
  Topic& topic = topics_[definition.topic];
  if (topic.channel == 0) topic = {writer_.add(definition), definition.type, durability, 0};
  TUTTI_CHECK(topic.type == definition.type, "{} is of {}, now of {}", definition.topic, topic.type, definition.type);
  if (auto ok = writer_.write(topic.channel, stamp, data); !ok) return ok;
  ++topic.count;
  first_ = std::min(first_, stamp);
  last_ = std::max(last_, stamp);
  return {};
}

Status RosWriter::write(const std::string& topic, const std::string& type, Timestamp stamp, std::string_view cdr,
                        Durability durability) {
  McapTopic definition{.topic = topic, .type = type, .schema_encoding = "ros2msg", .message_encoding = "cdr"};
  if (!topics_.contains(topic)) {
    definition.schema = ros_definition(type);
    definition.metadata = {{"offered_qos_profiles", qos(durability, "")}, {"topic_type_hash", ros_type_hash(type)}};
  }
  return put(definition, durability, stamp, cdr);
}

Status RosWriter::write_json(const std::string& topic, const std::string& type, const std::string& schema,
                             Timestamp stamp, std::string_view json) {
  return put({.topic = topic,
              .type = type,
              .schema = schema,
              .schema_encoding = "jsonschema",
              .message_encoding = "json",
              .metadata = {}},
             Durability::volatile_, stamp, json);
}

Result<BagWriter> BagWriter::create(const std::string& folder, const McapWriterOptions& options) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (!fs::is_directory(folder)) return fail(ErrorCode::io, "{}: the folder cannot be made", folder);
  if (!fs::is_empty(folder, failure) || failure)
    return fail(ErrorCode::io, "{}: expected a folder that is empty, or not there", folder);
  const fs::path path = fs::path(folder).lexically_normal();
  const std::string name = (path.has_filename() ? path : path.parent_path()).filename().string() + "_0.mcap";
  auto writer = RosWriter::create((path / name).string(), options);
  if (!writer) return tl::unexpected(writer.error());
  return BagWriter(folder, name, std::move(*writer));
}

Status BagWriter::close() {
  if (auto ok = writer_.close(); !ok) return ok;
  return write_file((fs::path(folder_) / "metadata.yaml").string(), metadata(writer_, file_));
}

}  // namespace tutti::bags
