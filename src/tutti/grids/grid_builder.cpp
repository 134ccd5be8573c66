// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/grid_builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tutti/base/check.hpp"

namespace tutti::grids {
namespace {

constexpr std::size_t kMostCells = 400'000'000;
constexpr std::uint16_t kMostVotes = std::numeric_limits<std::uint16_t>::max();
/// One "occupied" outweighs so many "passed": what moved away against a wall that rays graze.
constexpr int kPassesAHit = 2;

}  // namespace

const Pose3& nearest_pose(const LevelSubmap& submap, const Eigen::Vector3d& point) {
  return std::ranges::min_element(
             submap.keyframes, {},
             [&](const StampedPose& keyframe) { return (keyframe.pose.translation - point).squaredNorm(); })
      ->pose;
}

bool is_mate(const LevelSubmap& submap, const Eigen::Vector3d& point, double mate_m) {
  return std::ranges::any_of(submap.mates, [&](const Eigen::Vector3d& mate) { return (mate - point).norm() < mate_m; });
}

Result<GridBuilder> GridBuilder::create(const GridConfig& config, const std::vector<Ground>& ground) {
  TUTTI_CHECK(!ground.empty());
  Eigen::Vector2d low = ground.front().head<2>(), high = low;
  for (const Ground& place : ground) {
    low = low.cwiseMin(place.head<2>());
    high = high.cwiseMax(place.head<2>());
  }
  const double border_m = config.range_m + config.resolution_m;
  const Eigen::Vector2d cells = ((high - low).array() + 2.0 * border_m).matrix() / config.resolution_m;
  if (!(cells.x() * cells.y() < static_cast<double>(kMostCells)))
    return fail(ErrorCode::invalid, "a grid of {:.0f} x {:.0f} cells, expected at most {} in all: a larger resolution",
                cells.x(), cells.y(), kMostCells);
  GridBuilder out;
  out.config_ = config;
  // Corners of cells are at multiples of the resolution, wherever the robots went.
  out.origin_ = ((low.array() - border_m) / config.resolution_m).floor().matrix() * config.resolution_m;
  out.width_ = static_cast<int>(std::ceil(cells.x())) + 1;
  out.height_ = static_cast<int>(std::ceil(cells.y())) + 1;
  const std::size_t count = static_cast<std::size_t>(out.width_) * static_cast<std::size_t>(out.height_);
  out.hits_.assign(count, 0);
  out.passes_.assign(count, 0);
  out.hit_by_.assign(count, 0);
  out.passed_by_.assign(count, 0);
  out.driven_.assign(count, false);
  out.spread_ground(ground);
  return out;
}

GridBuilder::Index GridBuilder::index_of(double x, double y) const {
  return {static_cast<int>(std::floor((x - origin_.x()) / config_.resolution_m)),
          static_cast<int>(std::floor((y - origin_.y()) / config_.resolution_m))};
}

bool GridBuilder::is_inside(Index at) const { return at.x >= 0 && at.y >= 0 && at.x < width_ && at.y < height_; }

/// From the cells of the trajectories outwards, as far as anything is used: a cell takes the nearest of its neighbours'
/// places.
void GridBuilder::spread_ground(const std::vector<Ground>& ground) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> nearest(hits_.size(), kNone);
  std::vector<Index> front;
  const auto offer = [&](Index at, std::uint32_t place, std::vector<Index>& next) {
    const Eigen::Vector2d centre = origin_ + config_.resolution_m * Eigen::Vector2d(static_cast<double>(at.x) + 0.5,
                                                                                    static_cast<double>(at.y) + 0.5);
    std::uint32_t& best = nearest[flat(at)];
    const auto distance = [&](std::uint32_t one) { return (ground[one].head<2>() - centre).norm(); };
    const double offered = distance(place);
    if (offered > config_.range_m || (best != kNone && distance(best) <= offered)) return;
    best = place;
    next.push_back(at);
  };
  for (std::uint32_t i = 0; i < ground.size(); ++i) offer(index_of(ground[i].x(), ground[i].y()), i, front);
  while (!front.empty()) {
    std::vector<Index> next;
    for (const Index at : front)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (const Index beside{at.x + dx, at.y + dy}; is_inside(beside)) offer(beside, nearest[flat(at)], next);
    front = std::move(next);
  }
  ground_.assign(hits_.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < ground_.size(); ++i)
    if (nearest[i] != kNone) ground_[i] = static_cast<float>(ground[nearest[i]].z());
}

bool GridBuilder::is_in_slab(Index at, double z) const {
  const double height = z - static_cast<double>(ground_[flat(at)]);
  return height >= config_.low_m && height <= config_.high_m;  // of no ground: no
}

void GridBuilder::mark(std::vector<std::uint32_t>& marked_by, std::vector<std::uint16_t>& votes, Index at) {
  const std::size_t cell = flat(at);
  if (marked_by[cell] == submap_) return;
  marked_by[cell] = submap_;
  if (votes[cell] < kMostVotes) ++votes[cell];
}

/// The cells of the voxel that a point stands for, so that rays do not pass between two points of one wall.
template <class Visit>
void GridBuilder::around(const Eigen::Vector3d& point, const Visit& visit) const {
  const double reach_m = std::max(0.0, config_.point_m - config_.resolution_m) / 2.0;
  const Index low = index_of(point.x() - reach_m, point.y() - reach_m);
  const Index high = index_of(point.x() + reach_m, point.y() + reach_m);
  for (Index at = low; at.y <= high.y; ++at.y)
    for (at.x = low.x; at.x <= high.x; ++at.x)
      if (is_inside(at)) visit(at);
}

void GridBuilder::mark_trajectory(const Trajectory& trajectory) {
  const int reach = static_cast<int>(config_.robot_m / config_.resolution_m);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Eigen::Vector3d& from = trajectory[i > 0 ? i - 1 : 0].pose.translation;
    const Eigen::Vector3d step = trajectory[i].pose.translation - from;
    const int steps = std::max(1, static_cast<int>(step.norm() / config_.resolution_m));
    for (int k = 1; k <= steps; ++k) {
      const Eigen::Vector3d place = from + step * k / steps;
      const Index middle = index_of(place.x(), place.y());
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
          if (const Index at{middle.x + dx, middle.y + dy}; is_inside(at) && dx * dx + dy * dy <= reach * reach)
            driven_[flat(at)] = true;
    }
  }
}

/// Every cell that the ray crosses (Amanatides and Woo, Eurographics 1987), but for the last one.
void GridBuilder::mark_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d ray = to - from;
  Index at = index_of(from.x(), from.y());
  const Index end = index_of(to.x(), to.y());
  const auto edge = [&](double start, double step, int cell, double origin) {
    if (step == 0.0) return std::numeric_limits<double>::infinity();
    return (origin + config_.resolution_m * (cell + (step > 0.0 ? 1 : 0)) - start) / step;
  };
  double next_x = edge(from.x(), ray.x(), at.x, origin_.x()), next_y = edge(from.y(), ray.y(), at.y, origin_.y());
  const double per_x = ray.x() == 0.0 ? 0.0 : config_.resolution_m / std::abs(ray.x());
  const double per_y = ray.y() == 0.0 ? 0.0 : config_.resolution_m / std::abs(ray.y());
  double entered = 0.0;
  while ((at.x != end.x || at.y != end.y) && entered < 1.0) {
    if (!is_inside(at)) return;
    const double left = std::min({next_x, next_y, 1.0});
    if (hit_by_[flat(at)] == submap_) return;
    if (is_in_slab(at, from.z() + ray.z() * (entered + left) / 2.0)) mark(passed_by_, passes_, at);
    entered = left;
    if (next_x < next_y) {
      at.x += ray.x() > 0.0 ? 1 : -1;
      next_x += per_x;
    } else {
      at.y += ray.y() > 0.0 ? 1 : -1;
      next_y += per_y;
    }
  }
}

void GridBuilder::add(const LevelSubmap& submap) {
  if (submap.keyframes.empty()) return;
  ++submap_;
  struct Ray {
    Eigen::Vector3d from, to;
  };
  std::vector<Ray> rays;
  for (const Eigen::Vector3f& one : submap.points) {
    const Eigen::Vector3d point = one.cast<double>();
    const Eigen::Vector3d& from = nearest_pose(submap, point).translation;
    if ((from - point).head<2>().norm() > config_.range_m) continue;
    rays.push_back({from, point});
    if (is_mate(submap, point, config_.mate_m)) continue;
    around(point, [&](Index at) {
      if (is_in_slab(at, point.z())) mark(hit_by_, hits_, at);
    });
  }
  for (const auto& [from, to] : rays) {
    around(to, [&, z = to.z()](Index at) {
      const bool is_ground = std::abs(z - static_cast<double>(ground_[flat(at)])) < config_.low_m;
      if (is_ground && hit_by_[flat(at)] != submap_) mark(passed_by_, passes_, at);
    });
    const Eigen::Vector2d half_point = (to - from).head<2>().normalized() * config_.point_m / 2.0;
    for (const double side : {-1.0, 0.0, 1.0})  // the voxel's edges: many rays became this one point
      mark_ray(from, to + side * Eigen::Vector3d(-half_point.y(), half_point.x(), 0.0));
  }
  mark_trajectory(submap.keyframes);
}

OccupancyGrid GridBuilder::grid() const {
  OccupancyGrid out{.resolution_m = config_.resolution_m,
                    .origin = origin_,
                    .width = static_cast<std::size_t>(width_),
                    .height = static_cast<std::size_t>(height_),
                    .cells = std::vector(hits_.size(), OccupancyGrid::unknown)};
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    if (driven_[i])
      out.cells[i] = OccupancyGrid::free;
    else if (hits_[i] > 0 && kPassesAHit * hits_[i] >= passes_[i])
      out.cells[i] = OccupancyGrid::occupied;
    else if (passes_[i] > 0)
      out.cells[i] = OccupancyGrid::free;
  }
  return out;
}

}  // namespace tutti::grids
