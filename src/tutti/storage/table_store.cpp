// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/table_store.hpp"

#include "tutti/storage/map_tables.hpp"

namespace tutti::storage {

const Schema& map_schema() {
  static const Schema schema{.kind = "map",
                             .tables = {map_tables::kSubmaps, map_tables::kVerdicts, map_tables::kAnswers,
                                        map_tables::kDecisions, map_tables::kMeta}};
  return schema;
}

const Schema& robot_schema() {
  static const Schema schema{.kind = "robot", .tables = {"checkpoint", "journal", "outbox", "archive", "meta"}};
  return schema;
}

std::string key_of(std::initializer_list<std::uint64_t> numbers) {
  std::string key;
  for (const std::uint64_t number : numbers)
    for (int shift = 56; shift >= 0; shift -= 8) key.push_back(static_cast<char>((number >> shift) & 0xffU));
  return key;
}

std::optional<std::vector<std::uint64_t>> numbers_of(std::string_view key, std::size_t count) {
  if (key.size() != count * sizeof(std::uint64_t)) return std::nullopt;
  std::vector<std::uint64_t> numbers(count, 0);
  for (std::size_t i = 0; i < key.size(); ++i)
    numbers[i / sizeof(std::uint64_t)] = numbers[i / sizeof(std::uint64_t)] << 8U | static_cast<unsigned char>(key[i]);
  return numbers;
}

}  // namespace tutti::storage
