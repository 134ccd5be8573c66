// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "tutti/geometry/cubes.hpp"
#include "tutti/grids/grid_builder.hpp"

namespace tutti::grids {

struct ChangeConfig {
  double voxel_m = 0.3;   ///< Edge of the cubes that are compared; that of submaps' clouds (agent.submap.voxel_m).
  double range_m = 10.0;  ///< Points farther from the nearest pose of their submap are not used.
  double mate_m = 0.7;    ///< As GridConfig::mate_m.
};

/// The cubes of space in which submaps saw something, or through which they saw. A ray goes from the nearest pose of
/// the submap to a point, and ends where the same submap has another one.
class SeenSpace {
 public:
  struct Votes {
    std::uint32_t hits = 0, passes = 0;  ///< Submaps that saw something there, and that saw through it.
    std::uint32_t rays = 0;              ///< Rays through it.
    bool has_mate = false;               ///< Another robot was there, so that nothing is known of what else is.
  };

  explicit SeenSpace(const ChangeConfig& config) : config_(config) {}
  void add(const LevelSubmap& submap);
  /// Something is there by at least one in three votes, so that what only passed by is not.
  [[nodiscard]] static bool is_thing(const Votes& votes) { return votes.hits > 0 && 2 * votes.hits >= votes.passes; }
  /// Enough rays went through, and nothing was seen there nor in a cube beside it.
  [[nodiscard]] bool is_empty(const Cube& at) const;
  /// Something, or another robot, was seen there or in a cube beside it.
  [[nodiscard]] bool is_near_hit(const Cube& at) const;
  [[nodiscard]] const std::map<Cube, Votes>& cubes() const { return cubes_; }
  [[nodiscard]] const ChangeConfig& config() const { return config_; }

 private:
  template <class Visit>
  void along(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Visit& visit) const;

  ChangeConfig config_;
  std::map<Cube, Votes> cubes_;
};

/// Cubes that touch each other, all of which changed in one way.
struct ChangedThing {
  bool appeared = false;  ///< Otherwise it is there no more.
  std::size_t cubes = 0;
  Eigen::Vector3d centre, size;  ///< Its middle and its edges along the axes, m.
};

struct Changes {
  std::vector<Eigen::Vector3d> appeared, gone, unsure;  ///< Middles of cubes.
  std::vector<ChangedThing> things;                     ///< Those of `appeared` and `gone`, the largest first.
  std::size_t same = 0;                                 ///< Cubes in which something is both times.
  std::size_t unseen_before = 0, unseen_now = 0;        ///< Things where the other time nobody looked.
};

/// Finds things that are there `now` where `before` was nothing, and the other way round: each in a cube that the other
/// saw empty with all its neighbours. Fewer than kLeastCubes that touch each other are `unsure`. Both have the same
/// voxels.
Changes find_changes(const SeenSpace& before, const SeenSpace& now);
inline constexpr std::size_t kLeastCubes = 4;

}  // namespace tutti::grids
