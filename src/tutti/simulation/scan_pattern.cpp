// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/scan_pattern.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tutti/base/check.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/lidar.hpp"

namespace tutti::simulation {
namespace {

Eigen::Vector3d ahead(double elevation) { return {std::cos(elevation), 0.0, std::sin(elevation)}; }

std::size_t spinning_firings(const LidarConfig& config) {
  return static_cast<std::size_t>(std::lround(360.0 / config.azimuth_step_deg));
}

/// Clockwise seen from above, from behind the body to behind it.
Firing spinning(const LidarConfig& config, Timestamp) {
  std::vector<Eigen::Vector3d> beams;
  for (int i = 0; i < config.beams; ++i) {
    const double share = config.beams == 1 ? 0.5 : static_cast<double>(i) / (config.beams - 1);
    beams.push_back(ahead(kRadPerDeg * std::lerp(config.lowest_deg, config.highest_deg, share)));
  }
  return [beams](double share, std::vector<Eigen::Vector3d>& directions) {
    const Eigen::AngleAxisd turned(std::numbers::pi * (1.0 - 2.0 * share), Eigen::Vector3d::UnitZ());
    directions.clear();
    for (const Eigen::Vector3d& beam : beams) directions.push_back(turned * beam);
  };
}

std::size_t rosette_firings(const LidarConfig& config) {
  return static_cast<std::size_t>(std::max(1L, std::lround(config.points_per_s / config.rate_hz / config.beams)));
}

/// Turns of the beams about the vertical in a sweep, and swings from the lowest elevation to the highest and back in a
/// turn. Both are irrational, so that no sweep repeats another.
constexpr double kTurns = std::numbers::phi, kSwings = 7.0 * std::numbers::sqrt2;

/// By the clock of the stamps, so that a sweep goes on where the one before has ended.
Firing rosette(const LidarConfig& config, Timestamp end) {
  const double sweeps_before = 1e-9 * static_cast<double>(end.ns) * config.rate_hz - 1.0;
  const double turns_before = std::fmod(sweeps_before * kTurns, 1.0);
  const double swings_before = std::fmod(sweeps_before * kTurns * kSwings, 1.0);
  return [=, beams = config.beams, lowest = kRadPerDeg * config.lowest_deg, highest = kRadPerDeg * config.highest_deg](
             double share, std::vector<Eigen::Vector3d>& directions) {
    directions.clear();
    for (int i = 0; i < beams; ++i) {
      const double apart = static_cast<double>(i) / beams;
      const double azimuth = 2.0 * std::numbers::pi * (turns_before + share * kTurns + apart);
      const double swing = std::cos(2.0 * std::numbers::pi * (swings_before + share * kTurns * kSwings + apart));
      directions.push_back(Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitZ()) *
                           ahead(std::lerp(lowest, highest, 0.5 + 0.5 * swing)));
    }
  };
}

}  // namespace

const std::vector<ScanPattern>& scan_patterns() {
  static const std::vector<ScanPattern> rows{
      {"spinning", "turns once in a sweep, its beams at fixed elevations", spinning_firings, spinning},
      {"rosette", "beams that swing while they turn, nowhere the same from sweep to sweep, as those of a Livox Mid-360",
       rosette_firings, rosette},
  };
  return rows;
}

const ScanPattern& scan_pattern(std::string_view name) {
  const ScanPattern* row = row_of(scan_patterns(), name);
  TUTTI_CHECK(row != nullptr, "pattern '{}'", name);
  return *row;
}

}  // namespace tutti::simulation
