// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/model/position_fix.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::simulation {

/// Where on the earth a simulated world is (WGS 84): the truth's origin, and how far its x axis points north of east.
struct PlaceConfig {
  double latitude_deg = 46.5;
  double longitude_deg = 7.9;
  double height_m = 600.0;
  double yaw_deg = 25.0;
};

/// A satellite receiver on a robot, and its errors.
struct ReceiverConfig {
  std::string robot;
  double rate_hz = 1.0;
  double sigma_m = 1.0;
  double sigma_up_m = 2.0;
  double correlation_s = 0.0;
  double stated_factor = 1.0;
  double wrong_share = 0.0;
  double wrong_m = 30.0;
  double wrong_lasts_s = 0.0;
  std::vector<double> outage_s;
  std::vector<double> antenna_m;
  bool antenna_told = true;
  double clock_offset_s = 0.0;
  bool swapped = false;
  template <class V>
  void describe(V& v) {
    v.field("robot", robot, any(), "Whose it is; empty: every robot has one.");
    v.field("rate_hz", rate_hz, between(1e-3, 100.0), "Fixes per second.");
    v.field("sigma_m", sigma_m, between(1e-3, 1e3), "Standard deviation of its errors, east and north.");
    v.field("sigma_up_m", sigma_up_m, between(1e-3, 1e3), "Up.");
    v.field("correlation_s", correlation_s, at_least(0.0),
            "Errors fade by a factor of e in this time (Gauss-Markov); 0: each fix has its own.");
    v.field("stated_factor", stated_factor, between(0.01, 100.0),
            "Its covariance states so many times these standard deviations.");
    v.field("wrong_share", wrong_share, between(0.0, 1.0), "Share of fixes that are wrong,");
    v.field("wrong_m", wrong_m, at_least(0.0), "by so much, in a level direction that is drawn,");
    v.field("wrong_lasts_s", wrong_lasts_s, at_least(0.0), "all alike for so long; 0: each by itself.");
    v.field("outage_s", outage_s, any(), "From, until: no fixes then, counted from the robot's start.");
    v.field("antenna_m", antenna_m, any(), "x, y, z of the antenna in the body frame; empty: there.");
    v.field("antenna_told", antenna_told, any(), "false: the robot believes that the antenna is at its body.");
    v.field("clock_offset_s", clock_offset_s, between(-1e4, 1e4), "Added to the stamps of fixes.");
    v.field("swapped", swapped, any(), "Latitude stands where the longitude belongs, and the other way round.");
  }
};

/// The position fixes that this receiver gives on a robot that moves along `truth`; stamps increase.
std::vector<PositionFix> simulate_fixes(const Trajectory& truth, const ReceiverConfig& config, const PlaceConfig& place,
                                        const Rng& rng);

}  // namespace tutti::simulation
