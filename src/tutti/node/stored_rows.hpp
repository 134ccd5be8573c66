// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>

#include <cstddef>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/storage/table_store.hpp"

/// Rows of a map's store that a server finds when it starts.
namespace tutti::node {

/// Of one table, left as they are: in versions that this program does not read, as those of a newer one that had the
/// map before; or it threw at them.
struct UnreadRows {
  std::size_t count = 0;
  std::string why;  ///< Of the last.
};

/// What the call threw, which is a defect of ours at what this row holds, and no reason to be without all others;
/// nothing: it has not. Memory that is lacking is thrown on.
template <class Call>
std::optional<std::string> thrown_by(Call&& call) {
  try {
    call();
    return std::nullopt;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return fmt::format("this program threw at it: {}", error.what());
  }
}

/// Rows of a table, decoded; `leave` gets the keys of those that are left as they are (UnreadRows), and why. Any other
/// error ends it.
template <class Decode, class Take, class Leave>
Status read_rows(const storage::TableStore& store, const char* table, Decode&& decode, Take&& take, Leave&& leave) {
  Status ok;
  const auto read_row = [&](std::string_view key, std::string_view bytes) {
    auto decoded = decode(bytes);
    if (decoded)
      take(std::move(*decoded));
    else if (decoded.error().code == ErrorCode::unsupported)
      leave(key, decoded.error().message);
    else
      ok = in_context(fmt::format("the map's table '{}'", table), decoded.error());
  };
  const auto visit = [&](std::string_view key, std::string_view bytes) {
    if (const auto why = thrown_by([&] { read_row(key, bytes); })) leave(key, *why);
    return ok.has_value();
  };
  if (auto scanned = store.scan(table, {}, visit); !scanned) return scanned;
  return ok;
}

}  // namespace tutti::node
