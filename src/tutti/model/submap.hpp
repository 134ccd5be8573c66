// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/position_fix.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/robot_range.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// A keyframe: a time of a robot's run that has a node in the server's map.
struct Keyframe {
  std::uint32_t index = 0;  ///< KeyframeId::index
  Timestamp stamp;
  Pose3 T_odom_body;            ///< Raw odometry, never corrected.
  bool representative = false;  ///< It reflects the trajectory (about one per metre), and becomes a proxy node.
  friend bool operator==(const Keyframe&, const Keyframe&) = default;
};

/// A submap: what one robot saw in about 10 s. Its first keyframe is the previous submap's last one (except in submap
/// 0), so that the server can attach it. The submap frame is the body frame of the first keyframe.
struct Submap {
  SubmapId id;
  std::vector<Keyframe> keyframes;     ///< Consecutive indices, increasing stamps, at least one.
  std::vector<RelativePose> odometry;  ///< Raw odometry from keyframe k to k + 1; one fewer than keyframes.
  std::vector<SubmapFix> fixes;        ///< Position fixes; none without a receiver.
  std::vector<RobotRange> ranges;      ///< Ranges to other robots; none without a radio.
  /// In the submap frame, voxel-downsampled; null or empty without a range sensor.
  std::shared_ptr<const PointCloud> cloud;
  std::shared_ptr<const VisualPayload> visual;  ///< Null without a camera.
};

/// How much a submap carries of each kind; known even when its payloads lie in a store.
struct PayloadSize {
  std::size_t points = 0;        ///< In its cloud.
  std::size_t observations = 0;  ///< In its images.
  friend bool operator==(const PayloadSize&, const PayloadSize&) = default;
};

PayloadSize payload_size(const Submap& submap);

/// The submap with its keyframes, odometry, fixes and ranges alone.
Submap without_payloads(Submap submap);

}  // namespace tutti
