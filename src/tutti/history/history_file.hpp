// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tutti/history/history.hpp"

namespace tutti::history {

inline constexpr const char* kHistoryFile = "history.tutti";

/// A history, whatever is at its place.
struct OpenedHistory {
  std::unique_ptr<History> history;  ///< Never null.
  std::string said;                  ///< A sentence that the operator should read; empty: none.
};

/// Opens or makes a history in a file of at most kMostFile bytes. A file that is damaged, of a newer version or no
/// history is set aside as FILE.aside, where the last one of these stays, and a new one begins. Where no file can be
/// had, as on a full disk, it is kept in memory, in a tenth of the room. `file` empty: in memory, and nothing is said.
OpenedHistory open_history(const std::filesystem::path& file, const HistoryOptions& options = {});

}  // namespace tutti::history
