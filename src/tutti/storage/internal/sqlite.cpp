// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/internal/sqlite.hpp"

#include <fmt/format.h>

#include "tutti/base/content_hash.hpp"

namespace tutti::storage::internal {

std::int64_t hash_of(std::string_view key, std::string_view bytes) {
  return static_cast<std::int64_t>(content_hash(bytes, content_hash(key)));
}

std::string hex(std::string_view key) {
  std::string text;
  for (const char c : key) text += fmt::format("{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace tutti::storage::internal
