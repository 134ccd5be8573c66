// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_range.hpp"

#include <cmath>

namespace tutti::bags {

std::string_view ranged_robot(std::string_view topic) {
  constexpr std::string_view kName = "range_to/";
  const std::size_t at = topic.rfind(kName);
  const bool is_whole = at != std::string_view::npos && (at == 0 || topic[at - 1] == '/');
  const std::string_view robot = is_whole ? topic.substr(at + kName.size()) : std::string_view();
  return robot.find('/') == std::string_view::npos ? robot : std::string_view();
}

Result<std::optional<RobotRange>> to_range(const RosRange& message, std::string_view to) {
  const bool has_limits = message.max_range_m > message.min_range_m;
  if (has_limits && (message.range_m < message.min_range_m || message.range_m > message.max_range_m))
    return std::nullopt;
  RobotRange out{.stamp = message.header.stamp,
                 .to = {},
                 .distance_m = static_cast<double>(message.range_m),
                 .sigma_m = message.variance > 0.0F ? std::sqrt(static_cast<double>(message.variance)) : 0.0,
                 .name = std::string(to)};
  if (auto ok = check_range(out); !ok) return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::bags
