// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/method_id.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/base/content_hash.hpp"

namespace tutti {

std::uint64_t settings_hash(std::string_view settings) { return std::max<std::uint64_t>(content_hash(settings), 1); }

std::string to_string(const MethodId& id) {
  const std::string who = fmt::format("{} {}", id.name.empty() ? "unnamed" : id.name, id.version);
  return id.settings == 0 ? who : fmt::format("{} (settings {:016x})", who, id.settings);
}

}  // namespace tutti
