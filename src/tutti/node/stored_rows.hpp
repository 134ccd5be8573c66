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

/// Reads the rows of a map's store when a server starts.
namespace tutti::node {

/// Rows of one table that are left as they are: because a newer program, which had the map before, wrote them in a
/// version that this program cannot read, or because this program threw while reading them.
struct UnreadRows {
  std::size_t count = 0;
  std::string why;  ///< Why the last one was left.
};

/// The message of what the call threw; nothing when it did not throw. An exception on one row is a defect of this
/// program, and no reason to lose all other rows. std::bad_alloc is thrown on.
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

/// Decodes the rows of a table. `leave` gets the key of each row that is left as it is (UnreadRows), with the reason.
/// Any other error ends the reading.
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
