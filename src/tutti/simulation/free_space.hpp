// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/simulation/corridor_world.hpp"
#include "tutti/simulation/surface.hpp"

namespace tutti::simulation {

/// A corridor, or with a == b the chamber at a junction: the same cross-section all along, round ends.
struct Passage {
  Eigen::Vector3d a, b;  ///< Of the floor's middle.
  double half_width = 0.0;
  double height = 0.0;
  double top_radius = 0.0;  ///< Of the cross-section's corners.
  double bottom_radius = 0.0;
  double roughness = 0.0;  ///< How far walls stray from smooth.
  double variation = 0.0;  ///< Share by which it widens and narrows.
};

/// Upright, turned about z.
struct Box {
  Eigen::Vector3d centre;
  Eigen::Vector2d along;  ///< Unit, its x axis.
  Eigen::Vector3d half;
  double roughness = 0.0;
};

/// Open space above a level floor, nothing known outside of low..high.
struct Roof {
  Eigen::Vector2d low, high;
  double floor = 0.0;
  std::vector<Box> solids;
};

/// What a world's free space is made of: passages, openings and roof joined, less the solids.
struct SpaceParts {
  std::vector<Passage> passages;
  std::vector<Box> openings;  ///< Alcoves, doors, rooms.
  std::vector<Box> solids;    ///< Obstacles, furniture; not on the roof.
  std::optional<Roof> roof;
};

/// Puts alcoves, doors and things where the seed says.
SpaceParts furnish(const CorridorWorld& world, const SurfaceConfig& config, Rng rng);

/// An implicit function whose zero set is the surface of a world.
class FreeSpace {
 public:
  FreeSpace(const CorridorWorld& world, const SurfaceConfig& config, Rng rng);

  /// Negative where a sensor can be, positive in rock; near the surface about the distance to it, farther away only the
  /// sign means something.
  [[nodiscard]] double value(const Eigen::Vector3d& position) const;

  /// Cubes of block_m() that together hold all of the surface; what may matter within each.
  using BlockIndex = std::array<int, 3>;
  struct Nearby {
    std::vector<std::uint32_t> passages, openings, solids;  ///< Of parts().
    bool roof = false;
  };
  [[nodiscard]] double block_m() const { return block_m_; }
  [[nodiscard]] const std::map<BlockIndex, Nearby>& blocks() const { return blocks_; }
  /// As value(), for a position within or on the border of the block.
  [[nodiscard]] double value(const Nearby& nearby, const Eigen::Vector3d& position) const;
  /// False where a cell of the grid around the position reaches beyond the roof's edge, where open space and rock meet
  /// without a wall between them.
  [[nodiscard]] bool is_known(const Nearby& nearby, const Eigen::Vector3d& position) const;
  [[nodiscard]] const SpaceParts& parts() const { return parts_; }

 private:
  [[nodiscard]] double enclosed(const Nearby& nearby, const Eigen::Vector3d& position) const;
  [[nodiscard]] double passage(const Passage& passage, const Eigen::Vector3d& position) const;
  [[nodiscard]] double box(const Box& box, const Eigen::Vector3d& position) const;
  [[nodiscard]] double roof(const Eigen::Vector3d& position) const;
  [[nodiscard]] double bumps(const Eigen::Vector3d& position) const;
  void index_parts();

  SpaceParts parts_;
  double block_m_;
  double cell_m_;
  std::uint32_t seed_;
  std::map<BlockIndex, Nearby> blocks_;
};

}  // namespace tutti::simulation
