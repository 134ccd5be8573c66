// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::simulation {

/// By so much a range is too long when something is in the way.
inline constexpr double kInTheWay_m = 5.0;

/// Radios (UWB) on all robots of a mission, by which each measures how far the others are, and their errors.
struct RangingConfig {
  double every_s = 0.0;
  double reach_m = 30.0;
  double sigma_m = 0.1;
  double wrong_share = 0.0;
  double bias_m = 0.0;
  double clock_offset_s = 0.0;
  std::string wrong_robot;
  template <class V>
  void describe(V& v) {
    v.field("every_s", every_s, between(0.0, 1e4),
            "Each robot ranges to each other one this often; 0: there are none.");
    v.field("reach_m", reach_m, at_least(0.0), "Farther robots do not hear each other.");
    v.field("sigma_m", sigma_m, between(1e-3, 100.0), "Standard deviation of a range, as it is stated.");
    v.field("wrong_share", wrong_share, between(0.0, 1.0),
            "Share of ranges with something in the way, which makes them 5 m too long.");
    v.field("bias_m", bias_m, between(-1e3, 1e3), "Added to what is measured.");
    v.field("clock_offset_s", clock_offset_s, between(-1e4, 1e4), "Added to the stamps.");
    v.field("wrong_robot", wrong_robot, any(), "The three above are of this robot's radio alone; empty: of all.");
  }
};

/// The ranges that `robot` measures to the others among `all`, whose references are in one frame and by one clock;
/// in the order of their stamps.
std::vector<RobotRange> simulate_ranges(const Recording& robot, const std::vector<Recording*>& all,
                                        const RangingConfig& config, Rng rng);

}  // namespace tutti::simulation
