// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/robot_namespace.hpp"

namespace tutti::bags {

std::string namespace_of(std::string_view name) {
  name = name.substr(0, name.find("->"));
  if (name.starts_with('/')) name.remove_prefix(1);
  const std::size_t end = name.find('/');
  return end == std::string_view::npos ? "" : std::string(name.substr(0, end));
}

bool is_odometry_frame(std::string_view parent) { return parent == "odom" || parent.ends_with("/odom"); }
bool is_static_tf(std::string_view topic) { return topic.ends_with("tf_static"); }

}  // namespace tutti::bags
