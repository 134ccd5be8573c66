// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/hall_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tutti/simulation/bvh.hpp"

namespace tutti::simulation {
namespace hall_view_test {

/// Looks along z; 70 x 45 pixels, no multiple of anything; in the first column there are none.
constexpr int kWidth_px = 70, kHeight_px = 45;
std::vector<Eigen::Vector3f> all_rays() {
  std::vector<Eigen::Vector3f> out;
  for (int y = 0; y < kHeight_px; ++y)
    for (int x = 0; x < kWidth_px; ++x)
      out.push_back(
          x == 0 ? Eigen::Vector3f(Eigen::Vector3f::Zero())
                 : Eigen::Vector3f(0.025F * static_cast<float>(x - 35), 0.025F * static_cast<float>(y - 22), 1.0F)
                       .normalized());
  return out;
}

TEST(HallView, SeesWhatRaysHit) {
  const std::vector<Eigen::Vector3f> rays = all_rays();
  const Hall hall = make_hall({}, Rng(1));
  const Bvh surface(hall.mesh);
  Rng rng(7);
  int seen = 0, same = 0;
  std::set<std::uint32_t> faces;
  for (int image = 0; image < 20; ++image) {
    const Pose3 T_world_camera{
        Eigen::Quaterniond(rng.normal(1.0), rng.normal(1.0), rng.normal(1.0), rng.normal(1.0)).normalized(),
        {rng.uniform(-9.9, 9.9), rng.uniform(-6.9, 6.9), rng.uniform(0.1, 4.9)}};
    const auto found = view_of(hall, rays, kWidth_px, T_world_camera);
    ASSERT_EQ(found.size(), rays.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (i % kWidth_px == 0) {
        EXPECT_EQ(found[i].face, kNoFace);
        continue;
      }
      const Eigen::Vector3f ray = (T_world_camera.rotation * rays[i].cast<double>()).cast<float>();
      const auto hit = surface.cast(T_world_camera.translation.cast<float>(), ray, 100.0F);
      ASSERT_TRUE(hit.has_value());
      ++seen;
      same += found[i].face == hit->triangle / 2 && std::abs(found[i].distance_m - hit->distance) < 1e-3F ? 1 : 0;
      faces.insert(found[i].face);
    }
  }
  EXPECT_GE(same, 0.9999 * seen) << same << " of " << seen;  // but for edges, by rounding
  EXPECT_GE(faces.size(), 60U);
}

}  // namespace hall_view_test
}  // namespace tutti::simulation
