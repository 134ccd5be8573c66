// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/misfit.hpp"
#include "tutti/perception/fit/scan_step.hpp"
#include "tutti/perception/fit/steady_drift.hpp"
#include "tutti/robot/mend_submap.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

/// Watches whether a robot fits itself: whether its scans and images show the motion that odometry says
/// (fit::fit_odometry()), each alone. It remembers the newest kMostSteps steps of each, in memory alone: a robot that
/// starts again begins anew.
class FitWatch {
 public:
  explicit FitWatch(const FitConfig& config) : is_on_(config.scans != "off") {}

  /// A sample of raw odometry; stamps increase. A jump forgets all before it.
  void add_odometry(const StampedPose& T_odom_body, bool is_jump);
  /// A submap that has ended with the motions within it, and odometry's drift as far as it is known.
  void add(const FinishedSubmap& submap, const SubmapSteps& steps, const fit::SteadyDrift& drift);

  /// Contradictions since the last call, as two submaps in a row say, that were not said before or are of quite another
  /// size than was said. Odometry that stood still is said at once.
  std::vector<fit::Misfit> take_news() { return std::exchange(news_, {}); }
  /// The contradictions as of the last submap.
  [[nodiscard]] const std::vector<fit::Misfit>& misfits() const { return misfits_; }
  /// That the steps took.
  [[nodiscard]] std::uint64_t registrations() const { return registrations_; }

  static constexpr std::size_t kMostSteps = 200;

 private:
  void keep(std::span<const fit::ScanStep> steps, fit::Witness by);
  void forget_old();
  void compare(double still_m, const fit::SteadyDrift& drift);

  bool is_on_;
  Trajectory odometry_;
  std::array<std::vector<fit::ScanStep>, 2> steps_;  ///< By Witness.
  std::deque<double> ranges_m_;                      // medians of the newest scans
  std::vector<fit::Misfit> misfits_, said_, news_;
  std::uint64_t registrations_ = 0;
};

}  // namespace tutti::robot
