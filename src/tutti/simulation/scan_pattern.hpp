// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "tutti/base/timestamp.hpp"

namespace tutti::simulation {

struct LidarConfig;

/// Gives the directions (unit vectors, sensor frame) in which the beams of one sweep look at one firing. `share` of the
/// sweep is over then: above 0, and 1 at its end.
using Firing = std::function<void(double share, std::vector<Eigen::Vector3d>& directions)>;

/// Where a LiDAR looks while it sweeps.
struct ScanPattern {
  std::string_view name, help;
  std::size_t (*firings)(const LidarConfig& config);          ///< In one sweep.
  Firing (*sweep)(const LidarConfig& config, Timestamp end);  ///< Depends on these two alone.
};

/// The pattern of LidarConfig::pattern.
const ScanPattern& scan_pattern(std::string_view name);
const std::vector<ScanPattern>& scan_patterns();

}  // namespace tutti::simulation
