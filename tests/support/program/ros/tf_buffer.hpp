// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "support/program/ros/loopback.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::ros::test {

/// The newest transform to each frame, as tf2's buffer has them; "latest" is all that is asked of it.
class TfBuffer {
 public:
  void take(ros::Reader& reader) {
    for (const std::string& cdr : taken(reader)) {
      const auto transforms = bags::decode_tf(cdr).value();
      for (const bags::RosTransform& one : transforms)
        newest_[one.child_frame_id] = {one.header.frame_id, {one.rotation, one.translation}};
    }
  }
  /// Nothing when `child` is not below `root`.
  [[nodiscard]] std::optional<Pose3> find(const std::string& root, std::string child) const {
    Pose3 out;
    for (int i = 0; i < 10; ++i) {
      if (child == root) return out;
      const auto at = newest_.find(child);
      if (at == newest_.end()) return std::nullopt;
      out = at->second.second * out;
      child = at->second.first;
    }
    return std::nullopt;
  }

  /// Which frame is the parent of which, for messages.
  [[nodiscard]] std::string text() const {
    std::string out;
    for (const auto& [child, parent] : newest_) out += parent.first + " -> " + child + "\n";
    return out;
  }

 private:
  std::map<std::string, std::pair<std::string, Pose3>> newest_;
};

}  // namespace tutti::ros::test
