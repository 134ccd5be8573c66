// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/folder.hpp"

#include <system_error>

namespace tutti {

Status make_folder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot make the folder: {}", folder.string(), failure.message());
  return {};
}

Status make_folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? make_folder(file.parent_path()) : Status();
}

}  // namespace tutti
