// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace tutti::bags {

/// The first part of the name of a topic, a frame or a pair of frames that has several parts: "alpha" of "/alpha/odom",
/// "alpha/odom" and "alpha/odom->alpha/base_link". Empty of "/odom".
std::string namespace_of(std::string_view name);

/// True of the parent frame of a pair whose transforms are odometry: "odom", "alpha/odom".
bool is_odometry_frame(std::string_view parent);
/// True of topics whose transforms do not move: "/tf_static", "/alpha/tf_static".
bool is_static_tf(std::string_view topic);

/// Which topics of a bag belong to one of the robots that it was recorded of. A namespace is a robot's if it has
/// odometry.
struct RobotNamespace {
  std::set<std::string> all;  ///< Namespaces of robots.
  std::string own;            ///< Empty: the bag does not distinguish its robots, or this robot is none of them.

  /// True of names in the own namespace.
  [[nodiscard]] bool has(std::string_view name) const { return !own.empty() && namespace_of(name) == own; }
  /// True of names in the own namespace and of those in no robot's.
  [[nodiscard]] bool may_use(std::string_view name) const {
    const std::string of = namespace_of(name);
    return own.empty() || of == own || !all.contains(of);
  }
  /// Removes what is not this robot's: of `tracks`, by topic, those of its namespace stay, or if there are none, those
  /// of no robot's.
  template <class Tracks>
  void keep(Tracks& tracks) const {
    const bool has_own = std::ranges::any_of(tracks, [&](const auto& track) { return has(track.first); });
    std::erase_if(tracks, [&](const auto& track) { return has_own ? !has(track.first) : !may_use(track.first); });
  }
};

/// The namespace of `odometry`, the topic that was chosen for the robot (perhaps none), else the one called `name`.
/// `odometry_topics` are all of the bag's that have odometry.
template <class Names>
RobotNamespace robot_namespace(const Names& odometry_topics, const std::string& name, const std::string& odometry) {
  RobotNamespace out;
  for (const auto& topic : odometry_topics) out.all.insert(namespace_of(topic));
  out.all.erase("");
  for (const std::string& wanted : {namespace_of(odometry), name})
    if (out.own.empty() && out.all.contains(wanted)) out.own = wanted;
  return out;
}

}  // namespace tutti::bags
