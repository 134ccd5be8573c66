// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::bags {

/// What a reader needs of rosbag2's metadata.yaml; files say for themselves in what they are stored and packed.
struct Rosbag2Metadata {
  std::vector<std::string> files;  ///< Names in the bag's folder, in the order of recording.
  std::optional<std::uint64_t> messages;
};

/// An error names what is missing; `name` is for it. Of a file's path only the last part is taken: older versions put
/// the folder's name before it, and a bag has no business outside of its folder.
Result<Rosbag2Metadata> parse_rosbag2_metadata(const std::string& text, const std::string& name);

}  // namespace tutti::bags
