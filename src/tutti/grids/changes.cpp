// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/changes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace tutti::grids {
namespace {

constexpr std::uint32_t kEnoughRays = 3;

ChangedThing thing_of(const std::vector<Cube>& group, bool appeared, double voxel_m) {
  Eigen::Vector3d low = middle_of(group.front(), voxel_m), high = low;
  for (const Cube& cube : group) {
    low = low.cwiseMin(middle_of(cube, voxel_m));
    high = high.cwiseMax(middle_of(cube, voxel_m));
  }
  return {appeared, group.size(), 0.5 * (low + high), (high - low).array() + voxel_m};
}

}  // namespace

/// Every cube on the way but the last, as long as `visit` returns true.
template <class Visit>
void SeenSpace::along(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Visit& visit) const {
  const Eigen::Vector3d ray = to - from;
  Cube at = cube_of(from, config_.voxel_m);
  const Cube end = cube_of(to, config_.voxel_m);
  Eigen::Array3d next, step;  // as shares of the ray: where the next cube begins, and how long one is
  for (int k = 0; k < 3; ++k) {
    const double edge = config_.voxel_m * (at[k] + (ray[k] > 0.0 ? 1 : 0));
    next[k] = ray[k] == 0.0 ? std::numeric_limits<double>::infinity() : (edge - from[k]) / ray[k];
    step[k] = ray[k] == 0.0 ? 0.0 : config_.voxel_m / std::abs(ray[k]);
  }
  while (at != end && next.minCoeff() <= 1.0 && visit(at)) {
    Eigen::Index axis = 0;
    next.minCoeff(&axis);
    at[static_cast<std::size_t>(axis)] += ray[axis] > 0.0 ? 1 : -1;
    next[axis] += step[axis];
  }
}

void SeenSpace::add(const LevelSubmap& submap) {
  if (submap.keyframes.empty()) return;
  std::set<Cube> hit, passed;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;
  for (const Eigen::Vector3f& one : submap.points) {
    const Eigen::Vector3d point = one.cast<double>();
    const Eigen::Vector3d& from = nearest_pose(submap, point).translation;
    if ((from - point).norm() > config_.range_m) continue;
    rays.emplace_back(from, point);
    if (is_mate(submap, point, config_.mate_m))
      cubes_[cube_of(point, config_.voxel_m)].has_mate = true;
    else
      hit.insert(cube_of(point, config_.voxel_m));
  }
  for (const auto& [from, to] : rays)
    along(from, to, [&](const Cube& at) {
      if (hit.contains(at)) return false;
      ++cubes_[at].rays;
      passed.insert(at);
      return true;
    });
  for (const Cube& at : hit) ++cubes_[at].hits;
  for (const Cube& at : passed) ++cubes_[at].passes;
}

bool SeenSpace::is_near_hit(const Cube& at) const {
  return any_around(at, [&](const Cube& beside) {
    const auto found = cubes_.find(beside);
    return found != cubes_.end() && (found->second.hits > 0 || found->second.has_mate);
  });
}

bool SeenSpace::is_empty(const Cube& at) const {
  const auto found = cubes_.find(at);
  return found != cubes_.end() && found->second.rays >= kEnoughRays && !is_near_hit(at);
}

Changes find_changes(const SeenSpace& before, const SeenSpace& now) {
  Changes out;
  const double voxel_m = now.config().voxel_m;
  const auto find_those_of = [&](const SeenSpace& one, const SeenSpace& other, bool appeared, std::size_t& unseen) {
    std::set<Cube> changed;
    for (const auto& [at, votes] : one.cubes()) {
      if (!SeenSpace::is_thing(votes)) continue;
      if (other.is_empty(at))
        changed.insert(at);
      else if (!other.is_near_hit(at))
        ++unseen;
      else if (appeared)
        ++out.same;
    }
    while (!changed.empty()) {
      const std::vector<Cube> group = take_group(changed);
      const bool is_sure = group.size() >= kLeastCubes;
      if (is_sure) out.things.push_back(thing_of(group, appeared, voxel_m));
      for (const Cube& cube : group)
        (is_sure ? appeared ? out.appeared : out.gone : out.unsure).push_back(middle_of(cube, voxel_m));
    }
  };
  find_those_of(now, before, true, out.unseen_before);
  find_those_of(before, now, false, out.unseen_now);
  std::ranges::stable_sort(out.things, std::greater(), &ChangedThing::cubes);
  return out;
}

}  // namespace tutti::grids
