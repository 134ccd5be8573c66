// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/base/timestamp.hpp"

namespace tutti::program {

/// The clock of whoever feeds a robot, where it is another one than the robot's. What is added to the client's stamps
/// stays the same while it is connected, however its clock drifts: of its stamps only differences matter to a map, and
/// these would be wrong where the offset changes. How it drifts is told.
class FeedClock {
 public:
  enum class How { same, declared, measured };
  /// One that comes again with nearly the offset of before has that of before: measuring takes the time that a message
  /// takes, and stamps would seem to go back.
  static constexpr double kSame_s = 0.05;
  static constexpr double kLeast_s = 10.0;  ///< Over less time a drift is not told.

  /// What Hello says, at `robot_now` by the robot's clock. False: no such offset; nothing has changed.
  bool begin(std::optional<std::int64_t> offset_ns, std::optional<std::int64_t> client_now_ns, Timestamp robot_now);
  /// What the client's clock says now; the offset that is measured by that, nothing: there is none such.
  std::optional<std::int64_t> check(std::int64_t client_now_ns, Timestamp robot_now);

  [[nodiscard]] How how() const { return how_; }
  [[nodiscard]] std::int64_t offset_ns() const { return offset_ns_; }
  [[nodiscard]] std::optional<std::int64_t> measured_ns() const { return measured_ns_; }  ///< Last.
  /// By how much faster the client's clock runs, parts per million.
  [[nodiscard]] std::optional<double> drift_ppm() const;

  /// A stamp of the client by the robot's clock; nothing: there is no such time.
  [[nodiscard]] std::optional<Timestamp> to_robot(Timestamp stamp) const;

 private:
  How how_ = How::same;
  std::int64_t offset_ns_ = 0;
  std::optional<std::int64_t> first_ns_, measured_ns_;
  Timestamp first_at_, measured_at_;
};

}  // namespace tutti::program
