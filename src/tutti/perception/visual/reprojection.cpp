// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/reprojection.hpp"

#include <map>

namespace tutti::visual {

ReprojectionError reprojection_error(const Submap& submap) {
  ReprojectionError out;
  if (!submap.visual || submap.keyframes.empty()) return out;
  const VisualPayload& payload = *submap.visual;
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  std::map<std::uint32_t, Pose3> T_submap_body;
  for (const Keyframe& keyframe : submap.keyframes)
    T_submap_body[keyframe.index] = T_submap_odom * keyframe.T_odom_body;
  for (const VisualFrame& frame : payload.frames) {
    const Camera& camera = payload.cameras[frame.camera];
    const Pose3 T_camera_submap = (T_submap_body.at(frame.keyframe) * camera.T_body_camera).inverse();
    for (const Observation& it : frame.observations) {
      if (it.landmark == kNoIndex) continue;
      const Eigen::Vector3d position = payload.landmarks[it.landmark].position.cast<double>();
      const auto pixel = project(camera.model, T_camera_submap * position);
      if (!pixel) continue;
      out.sum_px2 += (*pixel - it.pixel.cast<double>()).squaredNorm();
      ++out.views;
    }
  }
  return out;
}

}  // namespace tutti::visual
