// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/cubes.hpp"

namespace tutti {

Cube cube_of(const Eigen::Vector3d& point, double voxel_m) {
  const Eigen::Array3d at = (point.array() / voxel_m).floor();
  return {static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z())};
}

Eigen::Vector3d middle_of(const Cube& at, double voxel_m) {
  return voxel_m * Eigen::Vector3d(at[0] + 0.5, at[1] + 0.5, at[2] + 0.5);
}

std::vector<Cube> take_group(std::set<Cube>& cubes) {
  std::vector<Cube> group{*cubes.begin()};
  cubes.erase(cubes.begin());
  for (std::size_t i = 0; i < group.size(); ++i)
    any_around(Cube(group[i]), [&](const Cube& beside) {
      if (cubes.erase(beside) > 0) group.push_back(beside);
      return false;
    });
  return group;
}

}  // namespace tutti
