// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/lidar.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {
namespace lidar_test {

const Eigen::Vector3d kHalf(8.0, 5.0, 2.0);

/// An empty room around the origin.
std::shared_ptr<const Bvh> room() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        kHalf.cwiseProduct(Eigen::Vector3d((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1))
            .cast<float>());
  const std::array<std::uint32_t, 4> sides[] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                                {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
  for (const auto& [a, b, c, d] : sides) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return std::make_shared<const Bvh>(mesh);
}

double distance_to_walls(const Eigen::Vector3d& p) { return (kHalf - p.cwiseAbs()).cwiseAbs().minCoeff(); }

/// Ten seconds at 8 Hz, turning while it walks across the room, swaying.
Trajectory walk() {
  Trajectory truth;
  for (int k = 0; k < 80; ++k) {
    const double t = 0.125 * k;
    const Eigen::Quaterniond turn = so3_exp({0, 0, 0.8 * t}), sway = so3_exp({0.05 * std::sin(3 * t), 0.05, 0.0});
    truth.push_back({Timestamp{1'000'000'000} + t, {turn * sway, {-4.0 + 0.8 * t, std::sin(t), 0.1}}});
  }
  return truth;
}

Pose3 pose_at(const Trajectory& truth, Timestamp stamp) {
  std::size_t k = 0;
  while (truth[k + 1].stamp < stamp) ++k;
  return interpolate(truth[k].pose, truth[k + 1].pose, (stamp - truth[k].stamp) / 0.125);
}

LidarConfig ideal(const std::string& model = "16-beam") {
  LidarConfig config = LidarChoice{.model = model}.config();
  config.range_sigma_m = config.dropout_share = config.grazing_cosine = 0.0;
  return config;
}

TEST(Lidar, PointsLieOnTheWallsOnceTheMotionIsUndone) {
  const Trajectory truth = walk();
  for (const double rate : {5.0, 10.0}) {  // 5 Hz: a turn is longer than the time between samples.
    LidarConfig config = ideal();
    config.rate_hz = rate;
    const SimulatedLidar lidar(room(), truth, config, Rng(1));
    const Scan scan = (*lidar.scan(40)).value();
    EXPECT_EQ(scan.stamp, truth[40].stamp);
    ASSERT_EQ(scan.cloud->points.size(), 900U * 16U);
    ASSERT_EQ(scan.age_s->size(), scan.cloud->points.size());
    double worst = 0.0, worst_without = 0.0;
    for (std::size_t i = 0; i < scan.cloud->points.size(); ++i) {
      const Eigen::Vector3d p = scan.cloud->points[i].cast<double>();
      const double age = (*scan.age_s)[i];
      ASSERT_GE(age, 0.0);
      ASSERT_LT(age, 1.0 / rate);
      worst = std::max(worst, distance_to_walls(pose_at(truth, scan.stamp - age) * p));
      worst_without = std::max(worst_without, distance_to_walls(truth[40].pose * p));
    }
    EXPECT_LT(worst, 1e-4);
    EXPECT_GT(worst_without, 0.2);
    EXPECT_EQ(scan.age_s->back(), 0.0F);
  }
}

TEST(Lidar, BeamsAndAzimuthsAreSpreadAsConfigured) {
  const LidarConfig config = ideal();
  const SimulatedLidar lidar(room(), walk(), config, Rng(1));
  const Scan scan = (*lidar.scan(20)).value();
  std::set<int> elevations;
  double last = 4.0;
  for (const Eigen::Vector3f& point : scan.cloud->points) {
    const Eigen::Vector3d p = point.cast<double>() - Eigen::Vector3d(0, 0, config.mount_height_m);
    const double elevation = std::atan2(p.z(), p.head<2>().norm()) / kRadPerDeg;
    EXPECT_NEAR(elevation, std::round(elevation), 1e-3);  // 2 degrees apart from -15 on.
    elevations.insert(static_cast<int>(std::lround(elevation)));
    const double azimuth = std::atan2(p.y(), p.x());
    if (std::abs(azimuth) > 3.1) continue;  // Straight behind: either sign.
    EXPECT_LE(azimuth, last + 1e-6);        // Clockwise.
    last = azimuth;
  }
  EXPECT_EQ(elevations.size(), 16U);
  EXPECT_EQ(*elevations.begin(), -15);
  EXPECT_EQ(*elevations.rbegin(), 15);
}

TEST(Lidar, EveryModelCanBeChosenAndThinned) {
  for (const LidarModel& model : lidar_models()) {
    const LidarConfig whole = LidarChoice{.model = std::string(model.name)}.config();
    const LidarConfig half =
        LidarChoice{.model = std::string(model.name), .rays_share = 0.5, .mount_height_m = 1.2}.config();
    const ScanPattern& pattern = scan_pattern(whole.pattern);
    EXPECT_EQ(2 * pattern.firings(half), pattern.firings(whole)) << model.name;
    EXPECT_EQ(half.mount_height_m, 1.2);
    EXPECT_EQ(half.beams, whole.beams);
  }
}

TEST(Lidar, ANarrowOneSeesItsSectorAlone) {
  for (const auto& [model, facing_deg] : {std::pair("narrow", 0.0), {"narrow-left", 90.0}}) {
    LidarConfig config = LidarChoice{.model = model, .rays_share = 0.2}.config();
    const Scan scan = (*SimulatedLidar(room(), walk(), config, Rng(1)).scan(20)).value();
    std::vector<double> off_deg;
    for (const Eigen::Vector3f& point : scan.cloud->points)
      off_deg.push_back(std::remainder(std::atan2(point.y(), point.x()) / kRadPerDeg - facing_deg, 360.0));
    const auto [low, high] = std::ranges::minmax(off_deg);
    EXPECT_NEAR(low, -60.0, 1.1) << model;  // rays are 1 degree apart
    EXPECT_NEAR(high, 60.0, 1.1) << model;
    config.sector_deg = 360.0;
    const Scan all = (*SimulatedLidar(room(), walk(), config, Rng(1)).scan(20)).value();
    EXPECT_NEAR(static_cast<double>(off_deg.size()), static_cast<double>(all.cloud->points.size()) / 3.0,
                0.1 * static_cast<double>(all.cloud->points.size()));
  }
}

TEST(Lidar, ARosetteLooksEverywhereButNeverInTheSameDirectionTwice) {
  const LidarConfig config = ideal("rosette");
  const ScanPattern& pattern = scan_pattern(config.pattern);
  ASSERT_EQ(pattern.firings(config), 5000U);
  constexpr int kColumns = 36, kRows = 6;  // of 10 by 10 degrees
  std::set<int> seen_ever;
  std::vector<std::vector<Eigen::Vector3d>> sweeps;
  for (int sweep = 0; sweep < 5; ++sweep) {
    const Firing fire = pattern.sweep(config, Timestamp{1'767'225'600'000'000'000} + 0.1 * sweep);
    std::vector<Eigen::Vector3d> directions, all;
    std::set<int> seen;
    for (int i = 0; i < 5000; ++i) {
      fire((i + 1) / 5000.0, directions);
      ASSERT_EQ(directions.size(), 4U);
      for (const Eigen::Vector3d& d : directions) {
        const double elevation = std::asin(d.z()) / kRadPerDeg, azimuth = std::atan2(d.y(), d.x()) / kRadPerDeg;
        ASSERT_NEAR(d.norm(), 1.0, 1e-12);
        ASSERT_GE(elevation, -7.0 - 1e-9);
        ASSERT_LE(elevation, 52.0 + 1e-9);
        seen.insert(std::clamp(static_cast<int>((azimuth + 180.0) / 10.0), 0, kColumns - 1) * kRows +
                    std::clamp(static_cast<int>((elevation + 7.0) / 10.0), 0, kRows - 1));
      }
      all.insert(all.end(), directions.begin(), directions.end());
    }
    EXPECT_GT(seen.size(), kColumns * kRows * 9U / 10U);
    seen_ever.insert(seen.begin(), seen.end());
    sweeps.push_back(std::move(all));
  }
  EXPECT_EQ(seen_ever.size(), static_cast<std::size_t>(kColumns * kRows));
  // How near rays of the second sweep come to any of the first: those of a spinning LiDAR come to 0.
  double sum = 0.0;
  for (std::size_t i = 0; i < 200; ++i) {
    const Eigen::Vector3d& ray = sweeps[1][100 * i + 7];
    double nearest = 1.0;
    for (const Eigen::Vector3d& other : sweeps[0]) nearest = std::min(nearest, (ray - other).norm());
    sum += nearest;
  }
  EXPECT_GT(sum / 200.0, 0.25 * kRadPerDeg);
}

TEST(Lidar, ASweepOfARosetteGoesOnWhereTheLastHasEnded) {
  const LidarConfig config = ideal("rosette");
  const ScanPattern& pattern = scan_pattern(config.pattern);
  const Timestamp end{1'767'225'600'000'000'000};
  std::vector<Eigen::Vector3d> last, next;
  pattern.sweep(config, end)(1.0, last);
  pattern.sweep(config, end + 0.1)(1e-9, next);
  for (std::size_t i = 0; i < last.size(); ++i) EXPECT_LT((last[i] - next[i]).norm(), 1e-3) << i;
}

TEST(Lidar, PointsOfARosetteLieOnTheWallsOnceTheMotionIsUndone) {
  const Trajectory truth = walk();
  const SimulatedLidar lidar(room(), truth, ideal("rosette"), Rng(1));
  const Scan scan = (*lidar.scan(40)).value();
  ASSERT_EQ(scan.cloud->points.size(), 20'000U);
  for (std::size_t i = 0; i < scan.cloud->points.size(); ++i)
    ASSERT_LT(distance_to_walls(pose_at(truth, scan.stamp - (*scan.age_s)[i]) * scan.cloud->points[i].cast<double>()),
              1e-4);
}

TEST(Lidar, NoiseAndDropoutsHaveTheConfiguredSize) {
  LidarConfig config = ideal();
  const Trajectory truth = walk();
  const auto surface = room();
  const Scan exact = *simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1));
  config.range_sigma_m = 0.03;
  const Scan noisy = *simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1));
  ASSERT_EQ(noisy.cloud->points.size(), exact.cloud->points.size());
  const Eigen::Vector3f mount(0, 0, static_cast<float>(config.mount_height_m));
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < exact.cloud->points.size(); ++i) {
    const double error = (noisy.cloud->points[i] - mount).norm() - (exact.cloud->points[i] - mount).norm();
    sum += error;
    squares += error * error;
    const Eigen::Vector3f across = (noisy.cloud->points[i] - mount).cross(exact.cloud->points[i] - mount);
    ASSERT_LT(across.norm() / (exact.cloud->points[i] - mount).squaredNorm(), 1e-5);  // Along the ray only.
  }
  const auto n = static_cast<double>(exact.cloud->points.size());
  EXPECT_NEAR(std::sqrt(squares / n), 0.03, 0.001);
  EXPECT_NEAR(sum / n, 0.0, 0.001);
  config.dropout_share = 0.2;
  const Scan dropped = *simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1));
  EXPECT_NEAR(static_cast<double>(dropped.cloud->points.size()) / n, 0.8, 0.02);
}

TEST(Lidar, GrazingRaysAreLostAndRangesLimited) {
  LidarConfig config = ideal();
  const Trajectory truth = walk();
  const auto surface = room();
  const auto is_grazing = [&](const Scan& scan, std::size_t i) {  // On the floor or ceiling, at less than 11.5 degrees.
    const Pose3 T = pose_at(truth, scan.stamp - (*scan.age_s)[i]);
    const Eigen::Vector3d p = T * Eigen::Vector3d(scan.cloud->points[i].cast<double>());
    const Eigen::Vector3d from = T * Eigen::Vector3d(0, 0, config.mount_height_m);
    return std::abs(std::abs(p.z()) - kHalf.z()) < 1e-3 && std::abs((p - from).normalized().z()) < 0.2;
  };
  const auto count = [&](const Scan& scan) {
    std::size_t grazing = 0;
    for (std::size_t i = 0; i < scan.cloud->points.size(); ++i) grazing += is_grazing(scan, i);
    return std::pair{grazing, scan.cloud->points.size() - grazing};
  };
  const auto [all_grazing, all_others] = count(*simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1)));
  ASSERT_GT(all_grazing, 100U);
  config.grazing_cosine = 0.4;  // At least half of those are lost.
  const auto [grazing, others] = count(*simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1)));
  EXPECT_LT(static_cast<double>(grazing), 0.55 * static_cast<double>(all_grazing));
  EXPECT_GT(static_cast<double>(others), 0.8 * static_cast<double>(all_others));

  config = ideal();
  config.min_range_m = 4.0;
  config.max_range_m = 6.0;
  const Scan limited = *simulate_sweep(*surface, truth, truth[30].stamp, config, Rng(1));
  EXPECT_GT(limited.cloud->points.size(), 100U);
  for (const Eigen::Vector3f& p : limited.cloud->points) {
    const double range = (p - Eigen::Vector3f(0, 0, static_cast<float>(config.mount_height_m))).norm();
    EXPECT_GE(range, 4.0 - 1e-5);
    EXPECT_LE(range, 6.0 + 1e-5);
  }
}

TEST(Lidar, AScanDependsOnItsSampleAlone) {
  const SimulatedLidar lidar(room(), walk(), {}, Rng(7)), same(room(), walk(), {}, Rng(7));
  const SimulatedLidar other(room(), walk(), {}, Rng(8));
  const Scan first = (*lidar.scan(12)).value();
  (void)lidar.scan(60);
  const Scan again = (*lidar.scan(12)).value();
  EXPECT_EQ(*first.cloud, *again.cloud);
  EXPECT_EQ(*first.age_s, *again.age_s);
  EXPECT_EQ(*first.cloud, *(*same.scan(12)).value().cloud);
  EXPECT_NE(*first.cloud, *(*other.scan(12)).value().cloud);
}

TEST(Lidar, NoTurnBeforeTheFirstSample) {
  const SimulatedLidar lidar(room(), walk(), {}, Rng(1));
  EXPECT_FALSE((*lidar.scan(0)).has_value());
  EXPECT_TRUE((*lidar.scan(1)).has_value());
  EXPECT_TRUE((*lidar.scan(79)).has_value());
  EXPECT_THROW((void)lidar.scan(80), std::logic_error);
}

}  // namespace lidar_test
}  // namespace tutti::simulation
