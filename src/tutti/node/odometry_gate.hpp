// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/robot/stamp_watch.hpp"

namespace tutti::node {

/// Stands before everything that takes a robot's odometry (the node, and the live feed in front of it), and decides
/// which samples are taken: the same in both, because only samples that it lets pass reach the next one.
class OdometryGate {
 public:
  static constexpr std::uint64_t kMostRefused = 20;  ///< So many in a row,
  static constexpr double kRefused_s = 1.0;          ///< or a row with stamps over more than this, are trouble().

  /// `newest`: the stamp of the robot's newest sample.
  explicit OdometryGate(RobotId robot, std::optional<Timestamp> newest = {}) : robot_(robot), watch_(newest) {}

  /// The steps for a sample that passes, in this order: a new session begins; the sample that waited is taken; the
  /// sample is taken.
  struct Passed {
    std::string why_anew;  ///< The clock of odometry began anew, so nothing after it can be in the same session; else
                           ///< empty.
    std::optional<OdometrySample> waited;
  };
  /// An error states why the sample is refused (robot::usable_step()), or what it waits for (StampWatch).
  Result<Passed> take(const OdometrySample& sample);
  /// A sample waits for another one that confirms it.
  [[nodiscard]] bool holds_one() const { return waiting_.has_value(); }
  /// The trouble while samples are refused, for people; empty: none are. The same text until one is taken.
  [[nodiscard]] std::string trouble() const;

 private:
  Result<Passed> judge(const OdometrySample& sample);

  RobotId robot_;
  robot::StampWatch watch_;
  std::optional<OdometrySample> waiting_;
  // The samples that were refused since the last one that was taken.
  std::uint64_t refused_ = 0;
  double refused_s_ = 0.0;  // by their stamps
  Timestamp last_refused_;
  std::string why_refused_;  // the first
};

}  // namespace tutti::node
