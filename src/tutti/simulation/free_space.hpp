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

/// A corridor, or the chamber at a junction (a == b): the same cross-section all along, with round ends.
struct Passage {
  Eigen::Vector3d a, b;  ///< Middle of the floor at the ends.
  double half_width = 0.0;
  double height = 0.0;
  double top_radius = 0.0;     ///< The cross-section's upper corners'.
  double bottom_radius = 0.0;  ///< The lower corners'.
  double roughness = 0.0;      ///< How far walls deviate from smooth.
  double variation = 0.0;      ///< Share by which the width varies.
};

/// An upright box, rotated about z.
struct Box {
  Eigen::Vector3d centre;
  Eigen::Vector2d along;  ///< Unit vector of its x axis.
  /// Half of each edge.
  Eigen::Vector3d half;
  double roughness = 0.0;
};

/// Open space above a level floor; nothing is known outside low..high.
struct Roof {
  Eigen::Vector2d low, high;
  double floor = 0.0;
  std::vector<Box> solids;
};

/// The parts of a world's free space: the union of passages, openings and roof, without the solids.
struct SpaceParts {
  std::vector<Passage> passages;
  std::vector<Box> openings;  ///< Alcoves, doors, rooms.
  std::vector<Box> solids;    ///< Obstacles and furniture, except on the roof.
  std::optional<Roof> roof;
};

/// Adds alcoves, doors and objects at random.
SpaceParts furnish(const CorridorWorld& world, const SurfaceConfig& config, Rng rng);

/// Free space as an implicit function whose zero set is the surface of a world.
class FreeSpace {
 public:
  FreeSpace(const CorridorWorld& world, const SurfaceConfig& config, Rng rng);

  /// Negative where a sensor can be, positive in rock. Near the surface it is about the distance to it; farther away
  /// only the sign is meaningful.
  [[nodiscard]] double value(const Eigen::Vector3d& position) const;

  /// Index of a cube with edges of block_m(); blocks() covers all of the surface with such cubes.
  using BlockIndex = std::array<int, 3>;
  /// The parts of the world that may matter within one block.
  struct Nearby {
    std::vector<std::uint32_t> passages, openings, solids;  ///< Indices into parts().
    bool roof = false;
  };
  [[nodiscard]] double block_m() const { return block_m_; }
  [[nodiscard]] const std::map<BlockIndex, Nearby>& blocks() const { return blocks_; }
  /// The same as value(), for a position within the block or on its border.
  [[nodiscard]] double value(const Nearby& nearby, const Eigen::Vector3d& position) const;
  /// False where a cell of the grid around the position reaches beyond the roof's edge, where open space and rock meet
  /// without a wall.
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
