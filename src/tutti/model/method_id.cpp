// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/method_id.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tutti {

/// FNV-1a of 64 bits.
std::uint64_t settings_hash(std::string_view settings) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : settings) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return std::max<std::uint64_t>(hash, 1);
}

std::string to_string(const MethodId& id) {
  const std::string who = fmt::format("{} {}", id.name.empty() ? "unnamed" : id.name, id.version);
  return id.settings == 0 ? who : fmt::format("{} (settings {:016x})", who, id.settings);
}

}  // namespace tutti
