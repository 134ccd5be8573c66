// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>

#include "tutti/base/result.hpp"

/// Files that a program keeps in a folder of its own. The folder may have been made by somebody else, so a name in it
/// may be a link to what this program must not touch: none of these functions follows one.
namespace tutti {

/// Opens a file, which must be a regular one, as open(2) does with `flags`, O_NOFOLLOW and O_CLOEXEC; a
/// new one gets mode 0640 under the program's umask, or `mode`. Returns the descriptor, which the caller closes.
Result<int> open_own_file(const std::filesystem::path& file, int flags, unsigned mode = 0640);

/// The file that replace_file() writes first: `file` with ".new" behind it.
std::filesystem::path beside_of(const std::filesystem::path& file);

/// Writes a new file beside `file` and renames it, so that readers see either all of the old text or all of the new.
/// `durable` syncs the new file to the disk before it is renamed.
Status replace_file(const std::filesystem::path& file, std::string_view text, bool durable, unsigned mode = 0640);

}  // namespace tutti
