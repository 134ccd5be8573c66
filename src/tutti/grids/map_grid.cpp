// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/map_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "tutti/grids/changes.hpp"
#include "tutti/grids/internal/map_part.hpp"

namespace tutti::grids {
namespace {

/// How far below the body points are, in bins.
class Below {
 public:
  void add(const LevelSubmap& submap) {
    constexpr double kNear_m = 4.0;
    for (const Eigen::Vector3f& one : submap.points) {
      const Eigen::Vector3d point = one.cast<double>();
      const Eigen::Vector3d down = nearest_pose(submap, point).translation - point;
      const auto bin = static_cast<std::size_t>(std::max(0.0, down.z()) / kBin_m);
      if (down.z() > kLeast_m && down.head<2>().norm() < kNear_m && bin < bins_.size()) ++bins_[bin];
    }
  }
  /// The middle of where most are, to half a bin; nothing of too few points.
  [[nodiscard]] std::optional<double> most() const {
    constexpr std::size_t kLeastPoints = 100;
    std::size_t best = 0, best_count = 0;
    for (std::size_t i = 1; i + 1 < bins_.size(); ++i)
      if (const std::size_t count = bins_[i - 1] + bins_[i] + bins_[i + 1]; count > best_count) {
        best = i;
        best_count = count;
      }
    if (best_count < kLeastPoints) return std::nullopt;
    double sum = 0.0;
    for (std::size_t i = best - 1; i <= best + 1; ++i)
      sum += static_cast<double>(bins_[i]) * (static_cast<double>(i) + 0.5) * kBin_m;
    return sum / static_cast<double>(best_count);
  }

 private:
  static constexpr double kBin_m = 0.05;
  static constexpr double kLeast_m = 0.05;
  std::array<std::size_t, 80> bins_{};  ///< 4 m
};

Result<std::map<ChainId, double>> body_heights(MapPart& part, const MapGridConfig& config) {
  std::map<ChainId, double> out;
  if (config.body_height_m) {
    for (const auto& [chain, trajectory] : part.trajectories()) out[chain] = *config.body_height_m;
    return out;
  }
  std::map<ChainId, Below> below;
  const auto seen = part.each(part.T_level_world(), [&](const ChainId& chain, const LevelSubmap& submap) {
    if (!submap.keyframes.empty()) below[chain].add(submap);
  });
  if (!seen) return tl::unexpected(seen.error());
  for (const auto& [chain, points] : below)
    if (const auto height = points.most()) out[chain] = *height;
  if (out.empty())
    return fail(ErrorCode::invalid, "no points below any robot: where the ground is has to be stated (body height)");
  return out;
}

}  // namespace

Result<MapGrid> grid_of_map(const storage::TableStore& store, const mapfile::Content& content,
                            const server::MapEstimate& map, const MapGridConfig& config) {
  MapPart part(store, content, map);
  MapGrid out{.T_level_world = part.T_level_world()};
  auto heights = body_heights(part, config);
  if (!heights) return tl::unexpected(heights.error());
  out.body_height_m = std::move(*heights);
  std::vector<Ground> ground;
  for (const auto& [chain, trajectory] : part.trajectories())
    if (const auto height = out.body_height_m.find(chain); height != out.body_height_m.end())
      for (const StampedPose& pose : trajectory)
        ground.push_back(out.T_level_world * pose.pose.translation - Eigen::Vector3d(0.0, 0.0, height->second));
  for (const Ground& below : ground) out.ground_m += below.z() / static_cast<double>(ground.size());
  auto builder = GridBuilder::create(config.grid, ground);
  if (!builder) return tl::unexpected(builder.error());
  const auto added = part.each(out.T_level_world, [&](const ChainId&, const LevelSubmap& submap) {
    builder->add(submap);
    ++out.submaps;
    for (const Eigen::Vector3f& point : submap.points)
      out.mate_points += is_mate(submap, point.cast<double>(), config.grid.mate_m) ? 1 : 0;
  });
  if (!added) return tl::unexpected(added.error());
  out.left_out = part.left_out();
  out.grid = builder->grid();
  return out;
}

Result<PointCloud> voxels_of_map(const storage::TableStore& store, const mapfile::Content& content,
                                 const server::MapEstimate& map, double voxel_m, double mate_m) {
  MapPart part(store, content, map);
  std::set<Cube> voxels;
  const auto added = part.each(Pose3{}, [&](const ChainId&, const LevelSubmap& submap) {
    for (const Eigen::Vector3f& point : submap.points) {
      const Eigen::Vector3d at = point.cast<double>();
      if (!is_mate(submap, at, mate_m)) voxels.insert(cube_of(at, voxel_m));
    }
  });
  if (!added) return tl::unexpected(added.error());
  PointCloud out;
  for (const Cube& voxel : voxels) out.points.push_back(middle_of(voxel, voxel_m).cast<float>());
  return out;
}

}  // namespace tutti::grids
