// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace tutti::bags::internal {

inline constexpr std::string_view kNoFile = " (neither JPEG nor PNG)";

/// "h264 (neither JPEG nor PNG)", where neither the format nor the data is of a file that is read; else "". One message
/// that is broken makes no other format.
inline std::string other_encoding(std::string_view format, std::string_view data) {
  const auto has = [&](const char* name) { return format.find(name) != std::string_view::npos; };
  const bool is_file = data.starts_with("\xff\xd8") || data.starts_with("\x89PNG");
  if (is_file || data.empty() || has("jpeg") || has("jpg") || has("JPEG") || has("png") || has("PNG")) return "";
  return std::string(format.substr(0, 16)).append(kNoFile);
}
inline bool is_packed_picture(std::string_view encoding) { return !encoding.ends_with(kNoFile); }

}  // namespace tutti::bags::internal
