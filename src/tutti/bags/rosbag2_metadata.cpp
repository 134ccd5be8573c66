// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/rosbag2_metadata.hpp"

#include <charconv>
#include <filesystem>

#include "tutti/base/config_io.hpp"

namespace tutti::bags {

Result<Rosbag2Metadata> parse_rosbag2_metadata(const std::string& text, const std::string& name) {
  const auto root = parse_yaml(text, name);
  if (!root) return tl::unexpected(root.error());
  const ConfigNode* const info = root->find("rosbag2_bagfile_information");
  if (info == nullptr || info->kind != ConfigNode::Kind::map)
    return fail(ErrorCode::parse, "{}: rosbag2_bagfile_information: missing, expected a map", name);
  const ConfigNode* const paths = info->find("relative_file_paths");
  if (paths == nullptr || paths->kind != ConfigNode::Kind::list || paths->list.empty())
    return fail(ErrorCode::parse, "{}: relative_file_paths: expected a list of files", name);
  Rosbag2Metadata out;
  for (const ConfigNode& path : paths->list) {
    out.files.push_back(std::filesystem::path(path.scalar).filename().string());
    if (path.kind != ConfigNode::Kind::scalar || out.files.back().empty() || out.files.back() == "..")
      return fail(ErrorCode::parse, "{}:{}: relative_file_paths: '{:.80}' names no file", name, path.line, path.scalar);
  }
  if (const ConfigNode* const count = info->find("message_count"); count != nullptr) {
    std::uint64_t messages = 0;
    const char* const end = count->scalar.data() + count->scalar.size();
    const auto [last, error] = std::from_chars(count->scalar.data(), end, messages);
    if (error == std::errc{} && last == end && !count->scalar.empty()) out.messages = messages;
  }
  return out;
}

}  // namespace tutti::bags
