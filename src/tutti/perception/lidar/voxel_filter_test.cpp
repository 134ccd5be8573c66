// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/voxel_filter.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::lidar {
namespace voxel_filter_test {

PointCloud random_cloud(Rng& rng, std::size_t n, double half_size) {
  PointCloud cloud;
  const auto coordinate = [&] { return static_cast<float>(rng.uniform(-half_size, half_size)); };
  for (std::size_t i = 0; i < n; ++i) cloud.points.emplace_back(coordinate(), coordinate(), coordinate());
  return cloud;
}

std::tuple<int, int, int> voxel_of(const Eigen::Vector3f& p, double voxel) {
  const auto cell = [&](float x) { return static_cast<int>(std::floor(double{x} / voxel)); };
  return {cell(p.x()), cell(p.y()), cell(p.z())};
}

RC_GTEST_PROP(VoxelDownsample, doesNotDependOnTheOrderToTheBit, (std::uint64_t seed)) {
  Rng rng(seed);
  PointCloud cloud = random_cloud(rng, 300, 1.0);
  const PointCloud before = voxel_downsample(cloud, 0.4);
  for (std::size_t i = cloud.points.size(); i > 1; --i) std::swap(cloud.points[i - 1], cloud.points[rng.index(i)]);
  RC_ASSERT(voxel_downsample(cloud, 0.4) == before);
}

/// By its definition: points of a voxel are added in the order of their coordinates.
std::map<std::tuple<int, int, int>, Eigen::Vector3f> centroids_by_sorting(PointCloud cloud, double voxel) {
  std::ranges::sort(cloud.points, {}, [](const Eigen::Vector3f& p) { return std::tuple(p.x(), p.y(), p.z()); });
  std::map<std::tuple<int, int, int>, std::pair<Eigen::Vector3d, double>> sums;
  for (const Eigen::Vector3f& p : cloud.points) {
    auto& [sum, count] = sums.try_emplace(voxel_of(p, voxel), Eigen::Vector3d::Zero(), 0.0).first->second;
    sum += p.cast<double>();
    ++count;
  }
  std::map<std::tuple<int, int, int>, Eigen::Vector3f> out;
  for (const auto& [cell, sum] : sums) out[cell] = (sum.first / sum.second).cast<float>();
  return out;
}

/// Also of numbers that lose digits when they are added, as those of rays that run along an axis: 1e-17 and 1.
RC_GTEST_PROP(VoxelDownsample, isThatOfSortedPointsToTheBit, (std::uint64_t seed)) {
  Rng rng(seed);
  PointCloud cloud = random_cloud(rng, 2000, 2.0);
  for (Eigen::Vector3f& p : cloud.points)
    for (float& x : p)
      if (rng.bernoulli(0.2)) x *= static_cast<float>(std::pow(10.0, -static_cast<double>(rng.index(40))));
  const auto expected = centroids_by_sorting(cloud, 0.5);
  const PointCloud thin = voxel_downsample(cloud, 0.5);
  RC_ASSERT(thin.points.size() == expected.size());
  for (const Eigen::Vector3f& p : thin.points)
    RC_ASSERT(std::ranges::find(expected, p, [](const auto& entry) { return entry.second; }) != expected.end());
}

/// Voxels that somebody has chosen so that a table of them is no use.
TEST(VoxelDownsample, WorksWithVoxelsThatCrowdInATable) {
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15ULL;  // as in voxel_filter.cpp
  std::uint64_t inverse = kFactor;                          // modulo 2^64, by Newton's iteration
  for (int i = 0; i < 6; ++i) inverse *= 2 - kFactor * inverse;
  ASSERT_EQ(inverse * kFactor, 1U);
  PointCloud cloud;
  for (std::uint64_t i = 1; cloud.points.size() < 500; ++i) {
    const std::uint64_t key = i * inverse;  // hashes to i, so that all begin at the table's begin
    if (key >> 63U != 0) continue;
    const auto coordinate = [key](unsigned axis) {
      std::uint64_t cell = 0;
      for (unsigned bit = 0; bit < 21; ++bit) cell |= (key >> (3 * bit + axis) & 1U) << bit;
      return static_cast<float>(static_cast<double>(cell) - 1048576.0 + 0.5);
    };
    cloud.points.emplace_back(coordinate(0), coordinate(1), coordinate(2));
  }
  const PointCloud thin = voxel_downsample(cloud, 1.0);
  EXPECT_EQ(thin.points.size(), 500U);
  EXPECT_TRUE(std::ranges::is_permutation(thin.points, cloud.points));
}

RC_GTEST_PROP(VoxelDownsample, leavesOnePointInEveryOccupiedVoxel, (std::uint64_t seed)) {
  Rng rng(seed);
  const PointCloud cloud = random_cloud(rng, 200, 2.0);
  std::set<std::tuple<int, int, int>> occupied, left;
  for (const auto& p : cloud.points) occupied.insert(voxel_of(p, 0.5));
  const PointCloud thin = voxel_downsample(cloud, 0.5);
  for (const auto& p : thin.points) left.insert(voxel_of(p, 0.5));
  RC_ASSERT(left == occupied);
  RC_ASSERT(thin.points.size() == occupied.size());
}

RC_GTEST_PROP(VoxelDownsample, isIdempotent, (std::uint64_t seed)) {
  Rng rng(seed);
  const PointCloud once = voxel_downsample(random_cloud(rng, 100, 3.0), 0.7);
  RC_ASSERT(voxel_downsample(once, 0.7) == once);
}

TEST(VoxelDownsample, takesTheCentroid) {
  const PointCloud cloud{{{0.1F, 0.1F, 0.1F}, {0.3F, 0.1F, 0.1F}, {-0.1F, 0.1F, 0.1F}}};
  const PointCloud thin = voxel_downsample(cloud, 1.0);
  ASSERT_EQ(thin.points.size(), 2U);
  EXPECT_TRUE(thin.points[0].isApprox(Eigen::Vector3f(-0.1F, 0.1F, 0.1F)));
  EXPECT_TRUE(thin.points[1].isApprox(Eigen::Vector3f(0.2F, 0.1F, 0.1F)));
}

TEST(VoxelDownsample, skipsWhatIsNotFiniteOrTooFarAway) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  const PointCloud cloud{{{nan, 0, 0}, {0, infinity, 0}, {0, 0, -infinity}, {1e9F, 0, 0}, {1, 2, 3}}};
  EXPECT_EQ(voxel_downsample(cloud, 0.3).points, (std::vector<Eigen::Vector3f>{{1, 2, 3}}));
  EXPECT_TRUE(voxel_downsample({}, 0.3).points.empty());
  EXPECT_EQ(first_skipped(cloud, 0.3), &cloud.points[0]);
}

TEST(VoxelDownsample, saysWhetherItKeepsEveryPoint) {
  const PointCloud cloud{{{1, 2, 3}, {0, -1048.5F, 1048.5F}, {0, 0, 1048.6F}, {0, 0, 2000}}};
  EXPECT_EQ(first_skipped(cloud, 1e-3), &cloud.points[2]);
  EXPECT_EQ(voxel_downsample(cloud, 1e-3).points.size(), 2U);
  EXPECT_EQ(first_skipped(cloud, 2e-3), nullptr);
  EXPECT_EQ(voxel_downsample(cloud, 2e-3).points.size(), 4U);
}

TEST(VoxelDownsample, refusesAVoxelWithoutSize) { EXPECT_THROW(voxel_downsample({}, 0.0), std::logic_error); }

TEST(MergeScans, movesEachScanAndKeepsTheRangeOfItsOwnBody) {
  const auto cloud = std::make_shared<PointCloud>(PointCloud{{{1, 0, 0}, {5, 0, 0}, {0.1F, 0, 0}}});
  const Pose3 turned{so3_exp({0, 0, 1.5707963267948966}), {10, 0, 0}};
  const PosedCloud scans[] = {{{}, Pose3{}, cloud}, {{}, turned, cloud}, {{}, turned, nullptr}};
  const PointCloud merged = merge_scans(scans, 0.3, {.min_m = 0.5, .max_m = 2.0});
  ASSERT_EQ(merged.points.size(), 2U);  // (1, 0, 0) of both: the others are too near or too far
  EXPECT_TRUE(merged.points[0].isApprox(Eigen::Vector3f(1, 0, 0)));
  EXPECT_TRUE(merged.points[1].isApprox(Eigen::Vector3f(10, 1, 0), 1e-6F));
}

RC_GTEST_PROP(MergeScans, doesNotDependOnTheOrderOfTheScans, (std::uint64_t seed)) {
  Rng rng(seed);
  std::vector<PosedCloud> scans;
  for (int k = 0; k < 5; ++k)
    scans.push_back({{},
                     {so3_exp({0, 0, rng.uniform(-3, 3)}), {rng.uniform(-1, 1), 0, 0}},
                     std::make_shared<PointCloud>(random_cloud(rng, 50, 2.0))});
  const PointCloud forward = merge_scans(scans, 0.5);
  std::reverse(scans.begin(), scans.end());
  RC_ASSERT(merge_scans(scans, 0.5) == forward);
}

}  // namespace voxel_filter_test
}  // namespace tutti::lidar
