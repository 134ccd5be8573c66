// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <set>
#include <vector>

namespace tutti {

/// A cube of space, by its place among those of one size: that of 0, 0, 0 has a corner in the origin.
using Cube = std::array<int, 3>;
Cube cube_of(const Eigen::Vector3d& point, double voxel_m);
Eigen::Vector3d middle_of(const Cube& at, double voxel_m);

/// `visit(cube)` with the cube and the 26 around it, until it returns true; whether it did.
template <class Visit>
bool any_around(const Cube& at, const Visit& visit) {
  for (int x = at[0] - 1; x <= at[0] + 1; ++x)
    for (int y = at[1] - 1; y <= at[1] + 1; ++y)
      for (int z = at[2] - 1; z <= at[2] + 1; ++z)
        if (visit(Cube{x, y, z})) return true;
  return false;
}

/// Takes the first of the cubes, and all that touch it one after another, out of `cubes`, which must not be empty.
std::vector<Cube> take_group(std::set<Cube>& cubes);

}  // namespace tutti
