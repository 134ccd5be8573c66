// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/localise/local_map.hpp"
#include "tutti/localise/start_tries.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::localise {

/// A scan on the map, from where the robot should be.
struct ScanMatch {
  RelativePose T_world_body;   ///< As the scan shows it; right tangent.
  bool converged = false;      ///< False: too little of the scan lies on the map, and the pose is where it began.
  double overlap = 0.0;        ///< Share of the scan's points that lie on the map.
  double plane_rmse_m = 0.0;   ///< Point to plane, over these.
  double contradiction = 0.0;  ///< Share of the points in view that stand where the other side looked through.
  int in_view = 0;             ///< Points of either side that the other looked at.
  /// How well it fits, in [0, 1]. Where things look alike as much of a scan overlaps as at the right place, but not as
  /// closely: each point counts by 1 - (r / kClose_m)^2 for its distance r from the map's surface.
  [[nodiscard]] double quality() const;
  static constexpr double kClose_m = 0.15;
};

/// Registers a scan on a local map (lidar::register_clouds()) from `T_world_body`, and counts what contradicts it both
/// ways: points of the scan where the map's robots looked through, and points of the map where the scan did.
ScanMatch match_scan(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_world_body);

/// The evidence of a scan on where the robot should be.
enum class Evidence {
  confirms,  ///< It lies on the map there.
  nothing,   ///< The map shows too little of what the scan sees.
  against    ///< It cannot have been taken there.
};
struct Assessment {
  Evidence evidence = Evidence::nothing;
  std::string why;  ///< As a sentence's end; empty when it confirms.
};
/// `predicted` is where the robot should be with its covariance, `match` begun there. `usual_quality` is what
/// ScanMatch::quality() was of scans before: one that fits far worse does not confirm. Scans of a robot that was
/// carried still half fit the map at the old place.
Assessment assess(const ScanMatch& match, const RelativePose& predicted, double usual_quality = 0.0);
/// Scans must pass it where a place is not confirmed yet.
struct GuessGate {
  double least_overlap = 0.0, most_contradiction = 1.0, least_quality = 0.0;  ///< Shares, as in ScanMatch.
  int least_in_view = 0;                                                      ///< ScanMatch::in_view
  [[nodiscard]] bool passes(double overlap, double contradiction, double quality) const {
    return overlap >= least_overlap && contradiction <= most_contradiction && quality >= least_quality;
  }
  static constexpr GuessGate of_start() { return {.least_overlap = 0.6, .most_contradiction = 0.15}; }
  /// Nobody vouches for a place that was found. At right ones (tunnels, halls with boxes moved, HKU; LiDARs of 16 and
  /// 64 beams, whole and thinned to a tenth) scans showed a quality of 0.7 and more, contradictions of 0.11 at most and
  /// over 1000 points in view. At wrong ones beyond the map, which scans of a thin LiDAR fit, they showed 0.5, 0.12 or
  /// fewer than 800: where the map's robots saw little, there is little that could contradict.
  static constexpr GuessGate of_found() {
    return {.least_overlap = 0.6, .most_contradiction = 0.11, .least_quality = 0.6, .least_in_view = 900};
  }
};
/// As assess(), and only what passes the gate confirms.
Assessment assess_guess(const ScanMatch& match, const RelativePose& predicted, const GuessGate& gate);

/// A place that a scan fits, of those that a start pose stands for.
struct StartFit {
  std::uint32_t floor = 1;
  RelativePose prior;  ///< StartTries::T_world_body
  ScanMatch match;
  [[nodiscard]] double quality() const { return match.quality(); }
};
/// Adds the places where a scan confirms that it was taken, from all poses of `tries`. The best of those that are one
/// place stays; those that fit less than kRival times as well as the best of all go.
void add_fits(const LocalMap& map, const fit::FitScan& scan, const StartTries& tries, std::vector<StartFit>& fits);

}  // namespace tutti::localise
