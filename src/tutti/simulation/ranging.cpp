// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/ranging.hpp"

#include <algorithm>

#include "tutti/model/pose_at.hpp"

namespace tutti::simulation {

std::vector<RobotRange> simulate_ranges(const Recording& robot, const std::vector<Recording*>& all,
                                        const RangingConfig& config, Rng rng) {
  std::vector<RobotRange> out;
  const Eigen::Vector3d antenna(0.1, 0.0, 0.4);
  const double every_s = std::max(config.every_s, 0.01);
  const Trajectory& own = robot.reference;
  const bool is_wrong = config.wrong_robot.empty() || config.wrong_robot == robot.name;
  const double wrong_share = is_wrong ? config.wrong_share : 0.0, bias_m = is_wrong ? config.bias_m : 0.0;
  for (int k = 0; !own.empty(); ++k) {
    const Timestamp stamp = own.front().stamp + k * every_s;
    const auto T_reference_body = pose_at(own, stamp);
    if (!T_reference_body) break;
    for (const Recording* const other : all) {
      const auto T_reference_other = other == &robot ? std::nullopt : pose_at(other->reference, stamp);
      if (!T_reference_other) continue;
      const double distance_m = (*T_reference_body * antenna - *T_reference_other * antenna).norm();
      const double error_m = rng.normal(config.sigma_m) + (rng.bernoulli(wrong_share) ? kInTheWay_m : 0.0) + bias_m;
      if (distance_m > config.reach_m) continue;
      out.push_back({.stamp = stamp + (is_wrong ? config.clock_offset_s : 0.0),
                     .to = other->robot,
                     .distance_m = std::max(0.0, distance_m + error_m),
                     .sigma_m = config.sigma_m,
                     .p_body_antenna = antenna,
                     .name = other->name});
    }
  }
  return out;
}

}  // namespace tutti::simulation
