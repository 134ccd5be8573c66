// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Typed configuration. A struct lists its fields once:
///
///   struct LoopConfig {
///     double max_distance_m = 15.0;
///     template <class V> void describe(V& v) {
///       v.field("max_distance_m", max_distance_m, greater_than(0.0), "Candidate radius around the predicted
///       keyframe.");
///     }
///   };
///
/// and that list gives loading from YAML (unknown key = error, missing key = default), range checks (all violations
/// reported at once with path, value and bound), `--set a.b=value`, printing and documentation. Field types: bool, int,
/// uint64, double, std::string, std::vector<double>, std::optional of a scalar, structs with describe(), std::vector of
/// such structs. This header is all that a settings struct needs; base/config_io.hpp reads, writes and lists settings.
namespace tutti {

/// The values that a setting may have: the range of a number, closed at both ends unless `low_open`; an infinite end is
/// no limit. Strings may list their choices.
struct Bound {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;
  std::vector<std::string> choices;
  std::string formerly;  ///< The setting's name in the version before, which is still read. Empty: it had none.
};
inline Bound any() { return {}; }
inline Bound at_least(double low) { return {.low = low}; }
inline Bound greater_than(double low) { return {.low = low, .low_open = true}; }
inline Bound between(double low, double high) { return {.low = low, .high = high}; }
inline Bound above_zero_to(double high) { return {.low = 0.0, .high = high, .low_open = true}; }
inline Bound one_of(std::vector<std::string> choices) { return {.choices = std::move(choices)}; }
inline Bound formerly(std::string name, Bound bound = {}) {
  bound.formerly = std::move(name);
  return bound;
}

}  // namespace tutti
