// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/base/timestamp.hpp"

namespace tutti::program {

/// Converts the stamps of a client whose clock is not the robot's. The offset added to them stays the same for the
/// whole connection, even if the client's clock drifts: a map uses only differences of stamps, and a changing offset
/// would distort these. The drift is measured and reported instead.
class FeedClock {
 public:
  enum class How { same, declared, measured };
  /// A client that reconnects and measures within this of its previous offset keeps the previous one: the measurement
  /// errs by the time a message takes, and a smaller offset would make stamps seem to go back.
  static constexpr double kSame_s = 0.05;
  static constexpr double kLeast_s = 10.0;  ///< No drift is reported before the clock was observed for this long.

  /// Takes the client's clock as in Hello, which arrived at `robot_now`. False when the offset is out of range;
  /// nothing has changed then.
  bool begin(std::optional<std::int64_t> offset_ns, std::optional<std::int64_t> client_now_ns, Timestamp robot_now);
  /// Measures the offset again from what the client's clock shows now, and returns it; nothing when it is out of range.
  std::optional<std::int64_t> check(std::int64_t client_now_ns, Timestamp robot_now);

  [[nodiscard]] How how() const { return how_; }
  [[nodiscard]] std::int64_t offset_ns() const { return offset_ns_; }
  /// By the latest measurement.
  [[nodiscard]] std::optional<std::int64_t> measured_ns() const { return measured_ns_; }
  /// By how much the client's clock runs faster than the robot's, in parts per million; nothing before kLeast_s.
  [[nodiscard]] std::optional<double> drift_ppm() const;

  /// A stamp of the client by the robot's clock; nothing when it overflows.
  [[nodiscard]] std::optional<Timestamp> to_robot(Timestamp stamp) const;

 private:
  How how_ = How::same;
  std::int64_t offset_ns_ = 0;
  std::optional<std::int64_t> first_ns_, measured_ns_;
  Timestamp first_at_, measured_at_;
};

}  // namespace tutti::program
