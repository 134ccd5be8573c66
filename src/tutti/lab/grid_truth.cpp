// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/grid_truth.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/simulation/free_space.hpp"
#include "tutti/simulation/recordings.hpp"

namespace tutti::lab {
namespace {

using grids::OccupancyGrid;

std::size_t place_of(OccupancyGrid::Cell claimed) {
  return claimed == OccupancyGrid::free ? 0 : claimed == OccupancyGrid::occupied ? 1 : 2;
}

/// The ground below the robots' true trajectories, by the squares that contain it.
class TrueGround {
 public:
  TrueGround(const std::vector<Recording>& robots, const simulation::FreeSpace& space, double near_m)
      : near_m_(near_m) {
    constexpr double kApart_m = 0.3;
    for (const Recording& robot : robots) {
      std::optional<Eigen::Vector3d> last;
      for (const StampedPose& sample : robot.reference) {
        Eigen::Vector3d place = sample.pose.translation;
        if (last && (*last - place).norm() < kApart_m) continue;
        last = place;
        constexpr double kStep_m = 0.01, kDeepest_m = 3.0;
        for (double down = 0.0; down < kDeepest_m && space.value(place) < 0.0; down += kStep_m) place.z() -= kStep_m;
        places_[square(place.head<2>())].push_back(place);
      }
    }
  }
  /// Nothing: no trajectory is near.
  [[nodiscard]] std::optional<double> at(const Eigen::Vector2d& place) const {
    std::optional<double> out;
    double nearest = near_m_;
    const auto [x, y] = square(place);
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (const auto there = places_.find({x + dx, y + dy}); there != places_.end())
          for (const Eigen::Vector3d& one : there->second)
            if (const double distance = (one.head<2>() - place).norm(); distance < nearest) {
              nearest = distance;
              out = one.z();
            }
    return out;
  }

 private:
  [[nodiscard]] std::pair<int, int> square(const Eigen::Vector2d& place) const {
    return {static_cast<int>(std::floor(place.x() / near_m_)), static_cast<int>(std::floor(place.y() / near_m_))};
  }
  double near_m_;
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> places_;
};

TrueCell true_cell(const simulation::FreeSpace& space, const Eigen::Vector2d& centre, double half_m, double ground,
                   const grids::GridConfig& config) {
  constexpr int kHeights = 6;
  bool any_free = false, any_rock = false;
  for (const auto& [dx, dy] :
       {std::pair{0.0, 0.0}, std::pair{-1.0, -1.0}, std::pair{1.0, -1.0}, std::pair{-1.0, 1.0}, std::pair{1.0, 1.0}})
    for (int i = 0; i < kHeights; ++i) {
      const double height = std::lerp(config.low_m, config.high_m, static_cast<double>(i) / (kHeights - 1));
      const bool is_free = space.value({centre.x() + dx * half_m, centre.y() + dy * half_m, ground + height}) < 0.0;
      (is_free ? any_free : any_rock) = true;
      if (any_free && any_rock) return TrueCell::surface;
    }
  return any_free ? TrueCell::free : TrueCell::rock;
}

/// T_reference_world that lays the map's keyframes onto the true poses best, with what they see: a straight trajectory
/// alone would leave the tilt open.
Pose3 align(const server::MapEstimate& map, const std::vector<Recording>& robots) {
  std::vector<Eigen::Vector3d> real, mapped;
  for (const auto& node : map.nodes) {
    if (node.component != map.nodes.front().component || node.id.chain.robot.value >= robots.size()) continue;
    const auto pose = pose_at(robots[node.id.chain.robot.value].reference, node.stamp);
    if (!pose) continue;
    constexpr double kAhead_m = 5.0;
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-kAhead_m, kAhead_m}) {
        real.push_back(*pose * Eigen::Vector3d(side * Eigen::Vector3d::Unit(axis)));
        mapped.push_back(node.T_world_body * Eigen::Vector3d(side * Eigen::Vector3d::Unit(axis)));
      }
  }
  return align_points(real, mapped);
}

}  // namespace

std::size_t GridScore::of(OccupancyGrid::Cell claimed, TrueCell real) const {
  return cells[place_of(claimed)][static_cast<std::size_t>(real)];
}

Result<GridScore> score_grid(const grids::MapGrid& made, const grids::GridConfig& config,
                             const server::MapEstimate& map, const MissionConfig& mission, std::uint64_t seed,
                             double near_m, std::size_t stride) {
  if (mission.source != "simulation")
    return fail(ErrorCode::configuration, "{}: source is '{}', expected 'simulation'", mission.mission, mission.source);
  const auto world = simulation::simulate_recordings(mission.simulation, Timestamp{0}, seed);
  if (!world) return tl::unexpected(world.error());
  const simulation::FreeSpace space(world->network, mission.simulation.surface, Rng(seed).fork("surface"));
  const TrueGround ground(world->recordings, space, near_m);
  const Pose3 T_reference_level = align(map, world->recordings) * made.T_level_world.inverse();
  double height = 0.0;  // of the trajectories: both frames are level but for what alignment leaves
  for (const auto& node : map.nodes) height += (made.T_level_world * node.T_world_body.translation).z();
  height /= static_cast<double>(std::max<std::size_t>(1, map.nodes.size()));
  GridScore out;
  const OccupancyGrid& grid = made.grid;
  const double half_m = grid.resolution_m / 2.0;
  for (std::size_t y = 0; y < grid.height; y += stride)
    for (std::size_t x = 0; x < grid.width; x += stride) {
      const Eigen::Vector2d at = grid.centre(x, y);
      const Eigen::Vector2d place = (T_reference_level * Eigen::Vector3d(at.x(), at.y(), height)).head<2>();
      const auto floor = ground.at(place);
      if (!floor) continue;
      const OccupancyGrid::Cell claimed = grid.at(x, y);
      const TrueCell real = true_cell(space, place, half_m, *floor, config);
      ++out.cells[place_of(claimed)][static_cast<std::size_t>(real)];
      if (claimed == OccupancyGrid::occupied &&
          true_cell(space, place, 3.0 * half_m, *floor, config) == TrueCell::surface)
        ++out.occupied_near_surface;
    }
  return out;
}

}  // namespace tutti::lab
