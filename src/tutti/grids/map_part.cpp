// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/internal/map_part.hpp"

#include <algorithm>

#include "tutti/mapfile/placement.hpp"

namespace tutti::grids {

MapPart::MapPart(const storage::TableStore& store, const mapfile::Content& content, const server::MapEstimate& map)
    : content_(content),
      map_(map),
      clouds_(node::SubmapFrames::of(store)),
      component_(mapfile::component_to_show(content, map)),
      T_level_world_(mapfile::level_frame(map, component_)) {
  for (const auto& node : map.nodes)
    if (node.component == component_) trajectories_[node.id.chain].push_back({node.stamp, node.T_world_body});
}

Status MapPart::each(const Pose3& T_frame_world, const std::function<void(const ChainId&, const LevelSubmap&)>& visit) {
  left_out_ = 0;
  for (const auto& [id, size] : content_.payload_sizes) {
    if (size.points == 0) continue;
    const Submap& submap = *content_.submaps.at(id);
    const auto place = mapfile::place(submap, map_);
    if (!place || place->component != component_) {
      ++left_out_;
      continue;
    }
    const auto cloud = clouds_->cloud(id);
    if (!cloud) return tl::unexpected(cloud.error());
    visit(id.chain, placed(submap, T_frame_world, T_frame_world * place->T_world_submap, **cloud));
  }
  return {};
}

LevelSubmap MapPart::placed(const Submap& submap, const Pose3& T_frame_world, const Pose3& T_frame_submap,
                            const PointCloud& cloud) const {
  LevelSubmap out;
  for (const Keyframe& keyframe : submap.keyframes)
    if (const auto* node = find_node(map_, {submap.id.chain, keyframe.index}))
      out.keyframes.push_back({node->stamp, T_frame_world * node->T_world_body});
  const Eigen::Isometry3d T(T_frame_submap.matrix());
  for (const Eigen::Vector3f& point : cloud.points) out.points.push_back((T * point.cast<double>()).cast<float>());
  const Timestamp from = submap.keyframes.front().stamp, until = submap.keyframes.back().stamp;
  for (const auto& [chain, trajectory] : trajectories_) {
    if (chain.robot == submap.id.chain.robot) continue;
    // With one keyframe before and one behind, as the time may lie between two.
    auto first = std::ranges::lower_bound(trajectory, from, {}, &StampedPose::stamp);
    auto last = std::ranges::upper_bound(trajectory, until, {}, &StampedPose::stamp);
    if (first == trajectory.end() || last == trajectory.begin()) continue;
    if (first != trajectory.begin()) --first;
    if (last != trajectory.end()) ++last;
    for (; first != last; ++first) out.mates.push_back(T_frame_world * first->pose.translation);
  }
  return out;
}

}  // namespace tutti::grids
