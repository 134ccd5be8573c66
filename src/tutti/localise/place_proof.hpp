// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tutti/localise/local_map.hpp"
#include "tutti/localise/place_search.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::localise {

/// A scan as it is registered, and where odometry was then.
struct ReadyScan {
  StampedPose at;
  fit::FitScan scan;
};

/// The scans of the last stretch of driving, thinned: one in two seconds, or every kStep_m.
class Stretch {
 public:
  [[nodiscard]] bool wants(const StampedPose& at) const;
  void add(ReadyScan scan);
  void clear() { scans_.clear(); }
  [[nodiscard]] std::span<const ReadyScan> scans() const { return scans_; }
  static constexpr double kLength_s = 12.0;  ///< Older ones are dropped: a submap has 10 s.
  static constexpr double kStep_s = 1.9, kStep_m = 4.0;
  static constexpr std::size_t kMost = 6;
  static constexpr std::size_t kLeast = 3;  ///< Scans that can show a place.

 private:
  std::vector<ReadyScan> scans_;
};

/// Registers the scans, of which there is one at least, oldest first on the map about a place, each from where the one
/// before was. Returns the place at the newest scan, with the mean of ScanMatch::quality(), and Hypothesis::shown by
/// the means of overlap and contradiction. Nothing where the map shows nothing there, or as soon as its quality cannot
/// reach `least_quality`. Counts the registered scans.
std::optional<Hypothesis> proven(LocalMaps& maps, std::span<const ReadyScan> scans, const Hypothesis& place,
                                 double least_quality, std::size_t& registered);

/// The best kMostProven of the places that were found, and the best one with the robot turned by 90, 180 and 270
/// degrees, as it may be in a corridor or at a crossing, as the scans show them: distinct ones, best first. Scans that
/// lie on the map only farther off than is_same_place() allows show none of these. Where the best has no rival, it is
/// also tried some metres on along its tunnel, as it is and turned about, wherever the scans come to lie: in a tunnel
/// that nobody has mapped they may fit a mapped one closely, but then they do so in more than one place of it. Where
/// they fit half as well there, the best is shown by nothing. Those that are no rivals of the best may be missing.
std::vector<Hypothesis> all_proven(LocalMaps& maps, std::span<const ReadyScan> scans, std::vector<Hypothesis> found,
                                   std::size_t& registered);
inline constexpr std::size_t kMostProven = 6;

}  // namespace tutti::localise
