// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/internal/sqlite.hpp"

#include <fmt/format.h>

namespace tutti::storage::internal {

std::int64_t hash_of(std::string_view key, std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const std::string_view part : {key, bytes})
    for (const char c : part) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return static_cast<std::int64_t>(hash);
}

std::string hex(std::string_view key) {
  std::string text;
  for (const char c : key) text += fmt::format("{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace tutti::storage::internal
