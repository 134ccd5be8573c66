// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/cubes.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace cubes_test {

TEST(Cubes, HaveTheirCornersAtMultiplesOfTheirEdge) {
  EXPECT_EQ(cube_of({0.1, -0.1, 0.31}, 0.3), (Cube{0, -1, 1}));
  EXPECT_TRUE(middle_of({0, -1, 1}, 0.3).isApprox(Eigen::Vector3d(0.15, -0.15, 0.45)));
  EXPECT_EQ(cube_of(middle_of({-7, 3, 12}, 0.3), 0.3), (Cube{-7, 3, 12}));
}

TEST(Cubes, ThoseThatTouchAtACornerAreOneGroup) {
  std::set<Cube> cubes{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {4, 2, 2}};
  EXPECT_EQ(take_group(cubes).size(), 3U);
  EXPECT_EQ(take_group(cubes).size(), 1U);
  EXPECT_TRUE(cubes.empty());
}

}  // namespace cubes_test
}  // namespace tutti
