// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "support/bags/rosbag2_writer.hpp"

/// ROS 1 bags for tests, record by record as format 2.0 lists them.
namespace tutti::bags::test {

using Fields = std::vector<std::pair<std::string, std::string>>;
inline std::string fields_of(const Fields& fields) {
  std::string out;
  for (const auto& [name, value] : fields) out += counted(name + "=" + value);
  return out;
}
inline std::string ros1_record(char op, Fields fields, std::string_view data) {
  fields.insert(fields.begin(), {"op", std::string(1, op)});
  return counted(fields_of(fields)) + counted(data);
}
inline std::string ros1_connection(std::uint32_t id, const std::string& topic, const std::string& type) {
  return ros1_record(7, {{"conn", little(id)}, {"topic", topic}},
                     fields_of({{"topic", topic}, {"type", type}, {"md5sum", "*"}, {"message_definition", ""}}));
}
inline std::string ros1_time(std::uint64_t ns) {
  return little(static_cast<std::uint32_t>(ns / 1'000'000'000)) +
         little(static_cast<std::uint32_t>(ns % 1'000'000'000));
}
inline std::string ros1_message(std::uint32_t connection, std::uint64_t ns, std::string_view data) {
  return ros1_record(2, {{"conn", little(connection)}, {"time", ros1_time(ns)}}, data);
}
inline std::string ros1_chunk(std::string_view records, const std::string& compression) {
  return ros1_record(5, {{"compression", compression}, {"size", little(static_cast<std::uint32_t>(records.size()))}},
                     packed(records, compression));
}
inline constexpr std::size_t kRos1HeaderBytes = 4096;
inline std::string ros1_bag_header(std::uint64_t index_at, std::uint32_t chunks = 0, std::uint32_t connections = 1) {
  const std::string header = fields_of({{"op", "\3"},
                                        {"index_pos", little(index_at)},
                                        {"conn_count", little(connections)},
                                        {"chunk_count", little(chunks)}});
  return counted(header) + counted(std::string(kRos1HeaderBytes - 8 - header.size(), ' '));
}

/// A whole bag; `compression`: none, bz2 or lz4. Types as in ROS 2: they are given their old names. Each connection
/// is defined in the chunk in which it is used first, and in the index.
inline std::string ros1_bag(const std::vector<Sample>& samples, const std::string& compression,
                            std::size_t per_chunk = 100, bool closed = true) {
  const auto topics = topics_of(samples);
  const auto connection = [&](std::size_t i) {
    std::string type = topics[i].second;
    if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
    return ros1_connection(static_cast<std::uint32_t>(i + 1), topics[i].first, type);
  };
  const std::string magic = "#ROSBAG V2.0\n";
  const auto topic_count = static_cast<std::uint32_t>(topics.size());
  std::string data, records, infos;
  std::uint32_t chunks = 0;
  std::vector<bool> defined(topics.size());
  std::map<std::uint32_t, std::string> entries;  // of this chunk, by connection: times, and where messages are
  std::uint64_t first_ns = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::uint32_t topic = number_of(topics, samples[i]);
    if (!defined[topic - 1U]) records += connection(topic - 1U);
    defined[topic - 1U] = true;
    if (i % per_chunk == 0) first_ns = samples[i].ns;
    entries[topic] += ros1_time(samples[i].ns) + little(static_cast<std::uint32_t>(records.size()));
    records += ros1_message(topic, samples[i].ns, samples[i].data);
    if ((i + 1) % per_chunk != 0 && i + 1 < samples.size()) continue;
    const std::uint64_t at = magic.size() + kRos1HeaderBytes + data.size();
    data += ros1_chunk(records, compression);
    std::string counts;
    for (const auto& [of, places] : entries) {
      const std::string count = little(static_cast<std::uint32_t>(places.size() / 12));
      data += ros1_record(4, {{"ver", little(std::uint32_t{1})}, {"conn", little(of)}, {"count", count}}, places);
      counts += little(of) + count;
    }
    infos += ros1_record(6,
                         {{"ver", little(std::uint32_t{1})},
                          {"chunk_pos", little(at)},
                          {"start_time", ros1_time(first_ns)},
                          {"end_time", ros1_time(samples[i].ns)},
                          {"count", little(static_cast<std::uint32_t>(entries.size()))}},
                         counts);
    records.clear();
    entries.clear();
    ++chunks;
  }
  std::string index;
  for (std::size_t i = 0; i < topics.size(); ++i) index += connection(i);
  if (!closed) return magic + ros1_bag_header(0) + data;
  return magic + ros1_bag_header(magic.size() + kRos1HeaderBytes + data.size(), chunks, topic_count) + data + index +
         infos;
}

}  // namespace tutti::bags::test
