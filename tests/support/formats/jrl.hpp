// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>

#include "tutti/formats/pyfg.hpp"

/// Writes JRL as its own library does: keys as symbols, quaternions w first, covariances rotation first.
namespace tutti::formats::jrl_files {

inline std::uint64_t jrl_key(const PyfgName& name) {
  return (static_cast<std::uint64_t>(name.robot) << 56U) | name.number;
}

inline std::string jrl_pose(const Pose3& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return fmt::format(R"("type": "Pose3", "translation": [{}, {}, {}], "rotation": [{}, {}, {}, {}])", t.x(), t.y(),
                     t.z(), q.w(), q.x(), q.y(), q.z());
}

inline std::string jrl_covariance(const Matrix6d& ours) {
  std::string out;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      out += fmt::format("{}{}", out.empty() ? "" : ", ", ours((row + 3) % 6, (column + 3) % 6));
  return "[" + out + "]";
}

inline std::string jrl_between(const PyfgFile& file, const PyfgEdge& edge) {
  return fmt::format(
      R"({{"type": "BetweenFactorPose3", "key1": {}, "key2": {}, "measurement": {{{}}}, "covariance": {}}})",
      jrl_key(file.vertices[edge.from].name), jrl_key(file.vertices[edge.to].name), jrl_pose(edge.measurement.T_a_b),
      jrl_covariance(edge.measurement.covariance));
}

/// Every edge in the list of the robot that it ends at, one that joins two robots also in the other's, half a second
/// later; poses as ground truth, if `with_truth`; of each robot's first vertex a prior.
inline std::string to_jrl(const PyfgFile& file, bool with_truth = true) {
  std::map<char, std::string> entries, truth;
  const auto add = [](std::string& list, const std::string& text) { list += (list.empty() ? "" : ",\n") + text; };
  const auto add_factor = [&](char robot, Timestamp stamp, const std::string& factor) {
    add(entries[robot], fmt::format(R"({{"stamp": {}, "measurements": [{}]}})", stamp.ns, factor));
  };
  for (const PyfgVertex& vertex : file.vertices) {
    const char robot = vertex.name.robot;
    if (!entries.contains(robot))
      add_factor(robot, vertex.stamp,
                 fmt::format(R"({{"type": "PriorFactorPose3", "key": {}, "prior": {{{}}}, "covariance": {}}})",
                             jrl_key(vertex.name), jrl_pose({}), jrl_covariance(Matrix6d::Identity())));
    if (vertex.pose)
      add(truth[robot], fmt::format(R"({{"key": {}, {}}})", jrl_key(vertex.name), jrl_pose(*vertex.pose)));
  }
  for (const PyfgEdge& edge : file.edges) {
    const char from = file.vertices[edge.from].name.robot, to = file.vertices[edge.to].name.robot;
    add_factor(to, edge.stamp, jrl_between(file, edge));
    if (from != to) add_factor(from, edge.stamp + 0.5, jrl_between(file, edge));
  }
  const auto by_robot = [&](const std::map<char, std::string>& lists) {
    std::string out;
    for (const auto& [robot, list] : lists) add(out, fmt::format("\"{}\": [{}]", robot, list));
    return "{" + out + "}";
  };
  const std::string ground = with_truth ? ",\n\"groundtruth\": " + by_robot(truth) : "";
  return "{\"name\": \"fleet\",\n\"measurements\": " + by_robot(entries) + ground + "}\n";
}

}  // namespace tutti::formats::jrl_files
