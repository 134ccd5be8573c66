// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// A moment of the robot that the server's map has a node for.
struct Keyframe {
  std::uint32_t index = 0;  ///< KeyframeId::index
  Timestamp stamp;
  Pose3 T_odom_body;            ///< Raw odometry, never corrected.
  bool representative = false;  ///< Reflects the trajectory (about one per metre); becomes a proxy node.
  friend bool operator==(const Keyframe&, const Keyframe&) = default;
};

/// What one robot saw in about 10 s. Its first keyframe is the previous submap's last, so the server can attach it
/// (except submap 0). The submap frame is the body frame of the first keyframe.
struct Submap {
  SubmapId id;
  std::vector<Keyframe> keyframes;          ///< Consecutive indices, increasing stamps, at least one.
  std::vector<RelativePose> odometry;       ///< Raw odometry from keyframe k to k + 1; one fewer than keyframes.
  std::shared_ptr<const PointCloud> cloud;  ///< Submap frame, voxel-downsampled; null or empty when no range sensor.
  std::shared_ptr<const VisualPayload> visual;  ///< Null when there is no camera.
};

/// How much a submap carries of each kind; what remains known of a submap whose payloads lie in a store.
struct PayloadSize {
  std::size_t points = 0;        ///< Of its cloud.
  std::size_t observations = 0;  ///< Of its images.
  friend bool operator==(const PayloadSize&, const PayloadSize&) = default;
};

PayloadSize payload_size(const Submap& submap);

/// Its keyframes and odometry alone.
Submap without_payloads(Submap submap);

}  // namespace tutti
