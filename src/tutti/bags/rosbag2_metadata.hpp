// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::bags {

/// The fields of rosbag2's metadata.yaml that BagFiles needs. How files are stored and compressed is not read: that is
/// in the files themselves.
struct Rosbag2Metadata {
  std::vector<std::string> files;  ///< Names in the bag's folder, in the order of recording.
  std::optional<std::uint64_t> messages;
};

/// Reads metadata.yaml; `name` stands for the text in errors, which name what is missing. Only the last part of a
/// file's path is taken: older versions put the folder's name before it, and a bag must not name files outside of its
/// folder.
Result<Rosbag2Metadata> parse_rosbag2_metadata(const std::string& text, const std::string& name);

}  // namespace tutti::bags
