// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "support/bags/bag_writer.hpp"

/// Recordings as rosbag2 stores them, for tests.
namespace tutti::bags::test {

struct Sample {
  std::string topic, type;
  std::uint64_t ns = 0;
  std::string data;
};

inline void write_bytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline std::vector<std::pair<std::string, std::string>> topics_of(const std::vector<Sample>& samples) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const Sample& sample : samples)
    if (const std::pair topic{sample.topic, sample.type}; std::ranges::find(out, topic) == out.end())
      out.push_back(topic);
  return out;
}

inline std::uint16_t number_of(const std::vector<std::pair<std::string, std::string>>& topics, const Sample& sample) {
  return static_cast<std::uint16_t>(std::ranges::find(topics, std::pair{sample.topic, sample.type}) - topics.begin() +
                                    1);
}

/// `compression` of its chunks, of which each has so many messages at most.
inline std::string mcap_of(const std::vector<Sample>& samples, std::string_view compression = "zstd",
                           std::size_t per_chunk = 100) {
  const auto topics = topics_of(samples);
  std::string definitions;
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const auto id = static_cast<std::uint16_t>(i + 1);
    definitions += schema(id, topics[i].second) + channel(id, id, topics[i].first);
  }
  std::string data = kMagic + header(), records = definitions;
  std::uint32_t chunks = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    records += message(number_of(topics, samples[i]), samples[i].ns, samples[i].data);
    if ((i + 1) % per_chunk != 0 && i + 1 < samples.size()) continue;
    data += chunk(records, compression);
    records.clear();
    ++chunks;
  }
  return closed(data, definitions, samples.size(), chunks);
}

/// As rosbag2 lays out its .db3.
inline void write_db3(const std::filesystem::path& path, const std::vector<Sample>& samples) {
  sqlite3* db = nullptr;
  std::filesystem::remove(path);
  if (sqlite3_open(path.c_str(), &db) != SQLITE_OK) throw std::runtime_error("no database " + path.string());
  sqlite3_exec(db,
               "PRAGMA synchronous=OFF;CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT "
               "NULL,serialization_format "
               "TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);"
               "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, "
               "data BLOB NOT NULL);CREATE INDEX timestamp_idx ON messages (timestamp ASC);BEGIN",
               nullptr, nullptr, nullptr);
  const auto run = [db](const char* sql, const auto& bind) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(db, sql, -1, &statement, nullptr);
    bind(statement);
    const int code = sqlite3_step(statement);
    sqlite3_finalize(statement);
    if (code != SQLITE_DONE) throw std::runtime_error(sqlite3_errmsg(db));
  };
  const auto text = [](sqlite3_stmt* statement, int at, const std::string& value) {
    sqlite3_bind_text(statement, at, value.c_str(), -1, SQLITE_TRANSIENT);
  };
  const auto topics = topics_of(samples);
  for (const auto& topic : topics)
    run("INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) VALUES (?, ?, 'cdr', '')",
        [&](sqlite3_stmt* statement) {
          text(statement, 1, topic.first);
          text(statement, 2, topic.second);
        });
  for (const Sample& sample : samples)
    run("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", [&](sqlite3_stmt* statement) {
      sqlite3_bind_int64(statement, 1, number_of(topics, sample));
      sqlite3_bind_int64(statement, 2, static_cast<std::int64_t>(sample.ns));
      sqlite3_bind_blob64(statement, 3, sample.data.data(), sample.data.size(), SQLITE_TRANSIENT);
    });
  sqlite3_exec(db, "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_close(db);
}

/// The parts of a metadata.yaml that readers need.
inline std::string metadata_of(const std::vector<std::string>& files, std::size_t messages) {
  std::string out = "rosbag2_bagfile_information:\n  version: 5\n  message_count: " + std::to_string(messages) +
                    "\n  relative_file_paths:\n";
  for (const std::string& file : files) out += "    - " + file + "\n";
  return out;
}

enum class Storage { mcap, db3 };
enum class Packing { none, whole_files, messages };

/// A bag of files of at most so many messages. Returns their names, which metadata.yaml has if it is wanted.
inline std::vector<std::string> write_rosbag2(const std::filesystem::path& folder, std::vector<Sample> samples,
                                              Storage storage, Packing packing = Packing::none,
                                              std::size_t per_file = 1'000'000, bool with_metadata = true) {
  std::filesystem::create_directories(folder);
  const std::size_t count = samples.size();
  if (packing == Packing::messages)
    for (Sample& sample : samples) sample.data = packed(sample.data, "zstd");
  std::vector<std::string> files;
  for (std::size_t begin = 0; begin < count; begin += per_file) {
    const std::vector<Sample> some(samples.begin() + static_cast<std::ptrdiff_t>(begin),
                                   samples.begin() + static_cast<std::ptrdiff_t>(std::min(count, begin + per_file)));
    std::string name = "bag_" + std::to_string(files.size()) + (storage == Storage::mcap ? ".mcap" : ".db3");
    if (storage == Storage::mcap)
      write_bytes(folder / name, mcap_of(some));
    else
      write_db3(folder / name, some);
    if (packing == Packing::whole_files) {
      std::ifstream in(folder / name, std::ios::binary);
      const std::string bytes(std::istreambuf_iterator<char>(in), {});
      std::filesystem::remove(folder / name);
      name += ".zstd";
      write_bytes(folder / name, packed(bytes, "zstd"));
    }
    files.push_back(name);
  }
  if (with_metadata) write_bytes(folder / "metadata.yaml", metadata_of(files, count));
  return files;
}

}  // namespace tutti::bags::test
