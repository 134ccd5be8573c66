// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bounds.hpp"

namespace tutti::simulation {

/// Range of the errors of closures that are made wrong.
inline constexpr double kWrongLeast_m = 2.0, kWrongMost_m = 8.0, kWrongTurn_deg = 60.0;

/// When submaps count as overlapping, and the errors of their closures.
struct ReferenceClosureConfig {
  double radius_m = 4.0;
  double max_heading_deg = 180.0;
  int min_submap_gap = 3;
  double min_time_gap_s = 30.0;
  int per_pair = 1;
  double sigma_m = 0.05;
  double sigma_deg = 0.5;
  double wrong_share = 0.1;
  double distant_share = 0.5;
  double agreeing_share = 0.3;  ///< Share of the wrong ones that agree with neighbours, as where places look alike.
  template <class V>
  void describe(V& v) {
    v.field("radius_m", radius_m, greater_than(0.0), "Two submaps overlap when two keyframes are this close.");
    v.field("max_heading_deg", max_heading_deg, between(0.0, 180.0),
            "... and their directions differ by at most this.");
    v.field("min_submap_gap", min_submap_gap, at_least(1), "Submaps of one robot closer in sequence are not compared.");
    v.field("min_time_gap_s", min_time_gap_s, at_least(0.0), "Keyframes of one robot closer in time are not compared.");
    v.field("per_pair", per_pair, at_least(1), "At most this many closures from one pair of submaps.");
    v.field("sigma_m", sigma_m, above_zero_to(kFarthest_m), "Noise of the translation, per axis.");
    v.field("sigma_deg", sigma_deg, above_zero_to(180.0), "Noise of the rotation, per axis.");
    v.field("wrong_share", wrong_share, between(0.0, 0.9),
            "Share of the reporting pairs that are wrong, as confident as the others.");
    v.field("distant_share", distant_share, between(0.0, 1.0), "Share of the wrong ones that join distant places.");
  }
};

/// Finds closures without sensor data: from the reference poses of two submaps, with noise, and with some wrong ones. A
/// verdict depends on the reference, the seed and the two submaps only, never on earlier calls. All functions are const
/// and may be called from several threads.
class ReferenceClosures {
 public:
  /// A commit that changes the verdict on two submaps raises it by hand.
  static constexpr std::uint32_t kVersion = 1;
  /// `reference` has T_reference_body per robot, in one frame for all.
  ReferenceClosures(std::map<RobotId, Trajectory> reference, const ReferenceClosureConfig& config, std::uint64_t seed);

  /// True if verify() would report a closure. The order of the two submaps does not matter.
  [[nodiscard]] bool is_candidate(const Submap& a, const Submap& b) const;
  /// The verdict on two submaps, whose order does not matter; a refusal states why there are no closures.
  [[nodiscard]] ClosureVerdict verify(const Submap& a, const Submap& b) const;
  /// T_a_b, the true relative pose of two keyframes at their stamps, for evaluation; nothing where there is no
  /// reference.
  [[nodiscard]] std::optional<Pose3> true_relative_pose(RobotId robot_a, Timestamp stamp_a, RobotId robot_b,
                                                        Timestamp stamp_b) const;
  /// How many submaps were looked up in the reference so far. Each is once, however many pairs it is in.
  [[nodiscard]] std::size_t submaps_placed() const;

 private:
  struct PlacedSubmap;
  struct Assessment;
  struct Known;
  [[nodiscard]] std::optional<Pose3> pose_at(RobotId robot, Timestamp stamp) const;
  [[nodiscard]] PlacedSubmap place(const Submap& submap) const;
  [[nodiscard]] std::shared_ptr<const PlacedSubmap> placed(const Submap& submap) const;
  [[nodiscard]] Assessment assess(const PlacedSubmap& first, const PlacedSubmap& second) const;
  [[nodiscard]] std::vector<PlacedSubmap> cut_reference() const;
  void set_wrong_probabilities();
  /// The error of the pose in first's anchor frame if the pair is to be reported wrong; nothing if it is not.
  [[nodiscard]] std::optional<Pose3> draw_error(const SubmapPair& pair, bool overlap) const;

  std::map<RobotId, Trajectory> reference_;
  ReferenceClosureConfig config_;
  std::uint64_t seed_;
  double overlap_wrong_probability_ = 0.0;
  double distant_wrong_probability_ = 0.0;
  std::shared_ptr<Known> known_;
};

}  // namespace tutti::simulation
