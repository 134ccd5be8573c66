// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>

#include "tutti/grids/grid_builder.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/node/submap_frames.hpp"

namespace tutti::grids {

/// Where the robots of one part of the map were, and what they saw, one submap in memory.
class MapPart {
 public:
  /// All must outlive it. The part is mapfile::component_to_show().
  MapPart(const storage::TableStore& store, const mapfile::Content& content, const server::MapEstimate& map);

  [[nodiscard]] const Pose3& T_level_world() const { return T_level_world_; }
  [[nodiscard]] const std::map<ChainId, Trajectory>& trajectories() const { return trajectories_; }
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

  /// `visit(chain, submap)` with every submap that has a cloud, in the frame that T_frame_world maps to.
  Status each(const Pose3& T_frame_world, const std::function<void(const ChainId&, const LevelSubmap&)>& visit);

 private:
  [[nodiscard]] LevelSubmap placed(const Submap& submap, const Pose3& T_frame_world, const Pose3& T_frame_submap,
                                   const PointCloud& cloud) const;

  const mapfile::Content& content_;
  const server::MapEstimate& map_;
  std::shared_ptr<node::SubmapFrames> clouds_;
  std::uint32_t component_;
  Pose3 T_level_world_;
  std::map<ChainId, Trajectory> trajectories_;
  std::size_t left_out_ = 0;
};

}  // namespace tutti::grids
