// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::simulation {
namespace {

/// Measured range along a ray of unit length; nothing when there is no echo.
std::optional<double> measure(const Bvh& surface, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                              const LidarConfig& config, Rng& rng) {
  const auto hit = surface.cast(origin, direction, static_cast<float>(config.max_range_m));
  if (!hit) return std::nullopt;
  const double cosine = std::abs(surface.normal(hit->triangle).dot(direction));
  const double echo = config.grazing_cosine > 0.0 ? std::min(1.0, cosine / config.grazing_cosine) : 1.0;
  if (!rng.bernoulli((1.0 - config.dropout_share) * echo)) return std::nullopt;
  const double range = hit->distance + rng.normal(config.range_sigma_m);
  if (range < config.min_range_m || range > config.max_range_m) return std::nullopt;
  return range;
}

LidarConfig narrow(double facing_deg) {
  return {.beams = 64,
          .lowest_deg = -12.5,
          .highest_deg = 12.5,
          .azimuth_step_deg = 0.2,
          .max_range_m = 150.0,
          .sector_deg = 120.0,
          .facing_deg = facing_deg};
}

/// Whether the direction (unit vector, sensor frame) is in the sector.
bool sees(const LidarConfig& config, const Eigen::Vector3d& direction) {
  if (config.sector_deg >= 360.0) return true;
  const double azimuth_deg = std::atan2(direction.y(), direction.x()) / kRadPerDeg;
  return std::abs(std::remainder(azimuth_deg - config.facing_deg, 360.0)) <= 0.5 * config.sector_deg;
}

}  // namespace

const std::vector<LidarModel>& lidar_models() {
  static const std::vector<LidarModel> rows{
      {"16-beam", "spinning, 16 beams within 15 degrees of level, every 0.4 degrees, 60 m", {}},
      {"64-beam",
       "spinning, 64 beams within 25 degrees of level, every 0.5 degrees, 80 m, as on a car",
       {.beams = 64, .lowest_deg = -24.8, .highest_deg = 24.8, .azimuth_step_deg = 0.5, .max_range_m = 80.0}},
      {"rosette",
       "beams that swing from 7 degrees below level to 52 above while they turn, nowhere the same from sweep to sweep, "
       "200,000 rays a second, as a Livox Mid-360's",
       {.pattern = "rosette", .beams = 4, .lowest_deg = -7.0, .highest_deg = 52.0}},
      {"narrow",
       "64 beams within 12.5 degrees of level, every 0.2 degrees, 120 degrees wide and 150 m far, ahead, as "
       "solid-state ones",
       narrow(0.0)},
      {"narrow-left", "the same, looking to the left", narrow(90.0)},
  };
  return rows;
}

LidarConfig LidarChoice::config() const {
  const LidarModel* row = row_of(lidar_models(), model);
  TUTTI_CHECK(row != nullptr, "LiDAR '{}'", model);
  LidarConfig out = row->config;
  out.azimuth_step_deg /= rays_share;
  out.points_per_s *= rays_share;
  out.range_sigma_m = range_sigma_m;
  out.mount_height_m = mount_height_m;
  return out;
}

std::optional<Scan> simulate_sweep(const Bvh& surface, const Trajectory& truth, Timestamp end,
                                   const LidarConfig& config, Rng rng) {
  const double sweep_s = 1.0 / config.rate_hz;
  const Timestamp begin = end - sweep_s;
  if (truth.size() < 2 || begin < truth.front().stamp || truth.back().stamp < end) return std::nullopt;

  const ScanPattern& pattern = scan_pattern(config.pattern);
  const std::size_t firings = pattern.firings(config);
  const Firing fire = pattern.sweep(config, end);
  std::vector<Eigen::Vector3d> directions;
  const Eigen::Vector3d mount(0.0, 0.0, config.mount_height_m);
  auto cloud = std::make_shared<PointCloud>();
  auto ages = std::make_shared<std::vector<float>>();
  for (std::size_t i = 0; i < firings; ++i) {
    const double share = static_cast<double>(i + 1) / static_cast<double>(firings);  // The last one fires at `end`.
    const double age_s = (1.0 - share) * sweep_s;
    const Pose3 T_reference_body = *pose_at(truth, end - age_s);
    const Eigen::Matrix3d R_reference_body = T_reference_body.rotation.toRotationMatrix();
    const Eigen::Vector3f origin = (T_reference_body * mount).cast<float>();
    fire(share, directions);
    for (const Eigen::Vector3d& direction : directions) {
      if (!sees(config, direction)) continue;
      const auto range = measure(surface, origin, (R_reference_body * direction).cast<float>(), config, rng);
      if (!range) continue;
      cloud->points.push_back((mount + *range * direction).cast<float>());
      ages->push_back(static_cast<float>(age_s));
    }
  }
  return Scan{end, std::move(cloud), std::move(ages)};
}

SimulatedLidar::SimulatedLidar(std::shared_ptr<const Bvh> surface, Trajectory truth, LidarConfig config, Rng rng)
    : surface_(std::move(surface)), truth_(std::move(truth)), config_(config), rng_(rng) {
  TUTTI_CHECK(surface_ != nullptr);
}

Result<std::optional<Scan>> SimulatedLidar::scan(std::size_t sample) const {
  TUTTI_CHECK(sample < truth_.size(), "sample {} of {}", sample, truth_.size());
  return simulate_sweep(*surface_, truth_, truth_[sample].stamp, config_, rng_.fork(sample));
}

}  // namespace tutti::simulation
