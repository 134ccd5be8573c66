// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/map_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::localise {
namespace map_fit_test {

using Eigen::Vector3d;

/// A box that stands in a hall.
struct Crate {
  Vector3d middle, size;
  /// Where a ray from outside of it meets it; infinity where it does not (slabs).
  [[nodiscard]] double range(const Vector3d& from, const Vector3d& ray) const {
    const Eigen::Array3d low = (middle - 0.5 * size - from).array() / ray.array();
    const Eigen::Array3d high = (middle + 0.5 * size - from).array() / ray.array();
    const double in = low.min(high).maxCoeff(), out = low.max(high).minCoeff();
    return in > 0.0 && in <= out ? in : std::numeric_limits<double>::infinity();
  }
};

/// A LiDAR's scan in a hall of 16 x 10 x 3 m with a wall across it at x = 3, with errors of 2 cm. Points in the body
/// frame.
PointCloud look(const std::vector<Crate>& crates, const Pose3& T_world_body, Rng& rng) {
  const Crate wall{{3.0, 0.0, 1.5}, {0.2, 10.0, 3.0}};
  const Eigen::Array3d low(-8.0, -5.0, 0.0), high(8.0, 5.0, 3.0);
  const Vector3d& from = T_world_body.translation;
  PointCloud out;
  for (int azimuth = 0; azimuth < 240; ++azimuth)
    for (int beam = -8; beam <= 8; ++beam) {
      const double yaw = 2.0 * M_PI * azimuth / 240.0, pitch = 0.05 * beam;
      const Vector3d ray(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
      const Vector3d in_hall = T_world_body.rotation * ray;
      const Eigen::Array3d to_low = (low - from.array()) / in_hall.array();
      double range = to_low.max((high - from.array()) / in_hall.array()).minCoeff();
      range = std::min(range, wall.range(from, in_hall));
      for (const Crate& crate : crates) range = std::min(range, crate.range(from, in_hall));
      out.points.push_back(((range + rng.normal(0.02)) * ray).cast<float>());
    }
  return out;
}

std::vector<Pose3> way(double from_x, double y) {
  std::vector<Pose3> out;
  for (int i = 0; i < 14; ++i) out.push_back({so3_exp({0, 0, 0.05 * i}), {from_x + 0.35 * i, y, 0.6}});
  return out;
}

/// A map of two submaps: one before the wall, one behind it.
std::shared_ptr<const KnownMap> map_of(const std::vector<Crate>& crates, Rng& rng) {
  auto map = std::make_shared<KnownMap>();
  auto payloads = std::make_shared<server::MemoryPayloadStore>();
  for (const std::uint32_t index : {0U, 1U}) {
    Submap submap{.id = {RobotId{0}, index}};
    PointCloud cloud;
    const auto poses = index == 0 ? way(-5.0, 0.0) : way(3.5, -1.0);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      submap.keyframes.push_back({.index = static_cast<std::uint32_t>(k),
                                  .stamp = Timestamp{} + static_cast<double>(k),
                                  .T_odom_body = poses[k]});
      if (k > 0) submap.odometry.push_back({poses[k - 1].inverse() * poses[k], Matrix6d::Identity() * 1e-6});
      const Pose3 T_submap_body = poses[0].inverse() * poses[k];
      for (const Eigen::Vector3f& p : look(crates, poses[k], rng).points)
        cloud.points.push_back((T_submap_body * p.cast<double>()).cast<float>());
    }
    submap.cloud = std::make_shared<const PointCloud>(std::move(cloud));
    EXPECT_TRUE(payloads->put(submap).has_value());
    KnownMap::Entry entry{.submap = std::make_shared<const Submap>(without_payloads(submap)),
                          .T_world_submap = poses[0]};
    entry.middle = poses[poses.size() / 2].translation;
    map->submaps.emplace(submap.id, std::move(entry));
  }
  map->payloads = std::move(payloads);
  return map;
}

/// A robot drives through the map, and its poses err by 3 cm and half a degree.
std::map<SubmapId, SubmapFit> drive(const std::shared_ptr<const KnownMap>& map, const std::vector<Crate>& crates,
                                    Rng& rng) {
  LocalMaps local_maps(map, {});
  MapFit out;
  double time_s = 0.0;
  for (const auto& poses : {way(-5.0, 1.0), way(3.6, 0.5)})
    for (const Pose3& pose : poses) {
      const auto scan = fit::make_fit_scan(Timestamp{} + (time_s += 0.5), look(crates, pose, rng), 0.3);
      const Pose3 error{so3_exp({0, 0, rng.normal(0.5 * kRadPerDeg)}), {rng.normal(0.03), rng.normal(0.03), 0.0}};
      out.see(*local_maps.about({1, pose.translation}), scan, pose * error);
    }
  return out.fits();
}

const Crate kCrate{{-1.0, -2.5, 0.6}, {1.2, 1.2, 1.2}};  // before the wall
const SubmapId kBefore{RobotId{0}, 0}, kBehind{RobotId{0}, 1};

TEST(MapFit, WhatHasNotChangedFits) {
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    Rng rng(seed);
    const auto map = map_of({kCrate}, rng);
    const auto fits = drive(map, {kCrate}, rng);
    ASSERT_EQ(fits.size(), 2U);
    for (const auto& [submap, fit] : fits) {
      EXPECT_EQ(fit.missing, 0U) << to_string(submap) << ", seed " << seed;
      EXPECT_EQ(fit.appeared, 0U) << to_string(submap) << ", seed " << seed;
      EXPECT_GT(fit.matched, 300U) << to_string(submap) << ", seed " << seed;
    }
  }
}

/// Wherever a box is brought to or taken from, the submap that saw the place says so, and the one behind the wall does
/// not.
TEST(MapFit, WhatWasBroughtOrTakenAwayIsSaidOfWhoSawItsPlace) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Rng rng(100 + seed);
    const Crate crate{{rng.uniform(-5.0, 0.0), rng.uniform(-2.8, -2.0), 0.6}, {1.2, 1.2, 1.2}};
    auto fits = drive(map_of({}, rng), {crate}, rng);
    EXPECT_GE(fits[kBefore].appeared, kLeastFitCubes) << "seed " << seed;
    EXPECT_EQ(fits[kBefore].missing, 0U) << "seed " << seed;
    EXPECT_FALSE(fits[kBehind].has_changed()) << "seed " << seed;
    fits = drive(map_of({crate}, rng), {}, rng);
    EXPECT_GE(fits[kBefore].missing, kLeastFitCubes) << "seed " << seed;
    EXPECT_EQ(fits[kBefore].appeared, 0U) << "seed " << seed;
    EXPECT_FALSE(fits[kBehind].has_changed()) << "seed " << seed;
  }
}

TEST(MapFit, WhatWasSeenShortlyBeforeItIsLostDoesNotCount) {
  Rng rng(7);
  const auto map = map_of({kCrate}, rng);
  LocalMaps local_maps(map, {});
  MapFit fit;
  for (int k = 0; k < 5; ++k) {
    const Pose3 pose = way(-5.0, 1.0)[static_cast<std::size_t>(k)];
    fit.see(*local_maps.about({1, pose.translation}),
            fit::make_fit_scan(Timestamp{} + 0.5 * k, look({}, pose, rng), 0.3), pose);
  }
  fit.doubt();
  const Pose3 pose = way(-5.0, 1.0)[8];
  for (const double time_s : {20.0, 30.0})
    fit.see(*local_maps.about({1, pose.translation}),
            fit::make_fit_scan(Timestamp{} + time_s, look({}, pose, rng), 0.3), pose);
  EXPECT_EQ(fit.fits().at(kBefore).scans, 1U);
}

TEST(MapFit, ScansFromOneSpotAreOne) {
  Rng rng(8);
  const auto map = map_of({}, rng);
  LocalMaps local_maps(map, {});
  MapFit fit;
  const Pose3 pose = way(-5.0, 1.0)[3];
  for (int k = 0; k <= 52; ++k)
    fit.see(*local_maps.about({1, pose.translation}),
            fit::make_fit_scan(Timestamp{} + 0.4 * k, look({}, pose, rng), 0.3), pose);
  EXPECT_EQ(fit.fits().at(kBefore).scans, 4U);
}

TEST(MapFit, SingleCubesAreNoise) {
  EXPECT_EQ(sure_of({}), 0U);
  EXPECT_EQ(sure_of({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}, {9, 9, 9}}), 0U);
  EXPECT_EQ(sure_of({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}, {5, 4, 4}, {9, 9, 9}}), 6U);
}

/// More scans that look through never make a thing less gone, nor more that see it.
TEST(MapFit, VotesAreMonotone) {
  for (std::uint16_t hits = 0; hits < 20; ++hits)
    for (std::uint16_t passes = 0; passes < 20; ++passes) {
      const FitVotes votes{hits, passes}, passed{hits, static_cast<std::uint16_t>(passes + 1)},
          hit{static_cast<std::uint16_t>(hits + 1), passes};
      EXPECT_LE(is_gone(votes), is_gone(passed));
      EXPECT_GE(is_gone(votes), is_gone(hit));
      EXPECT_LE(is_there(votes), is_there(hit));
      EXPECT_GE(is_there(votes), is_there(passed));
      EXPECT_FALSE(is_gone(votes) && is_there(votes));
    }
}

}  // namespace map_fit_test
}  // namespace tutti::localise
