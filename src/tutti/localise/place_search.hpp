// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/localise/local_map.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::localise {

/// Whether a place is shown to be the robot's.
enum class Shown {
  no,
  by_one,  ///< A second submap of the robot is to agree.
  surely   ///< If nothing else fits nearly as well.
};

/// A place of the map that what a robot saw fits.
struct Hypothesis {
  SubmapId submap;            ///< The map's submap that fits best there.
  std::uint32_t floor = 1;    ///< Its.
  RelativePose T_world_body;  ///< At `at`; right tangent.
  StampedPose at;             ///< By odometry: T_odom_body.
  double quality = 0.0;       ///< How well it fits, in [0, 1].
  std::size_t accepted = 0;   ///< Submaps of the map that the verifier accepts there; two show it surely.
  Shown shown = Shown::no;
  [[nodiscard]] Pose3 T_world_odom() const { return T_world_body.T_a_b * at.pose.inverse(); }
  /// Where the robot is there when odometry has it at `T_odom_body`.
  [[nodiscard]] OnFloor position(const Pose3& T_odom_body) const {
    return {floor, (T_world_odom() * T_odom_body).translation};
  }
};

/// Two hypotheses of one robot are one place when they have it on one floor, within kSamePlace_m and kSamePlace_deg of
/// each other where it was at `T_odom_body`.
bool is_same_place(const Hypothesis& a, const Hypothesis& b, const Pose3& T_odom_body);
inline constexpr double kSamePlace_m = 2.0, kSamePlace_deg = 12.0;
/// Another place that fits this share of the best one's quality is a rival.
inline constexpr double kRival = 0.75;

struct SearchResult {
  std::vector<Hypothesis> places;  ///< Distinct ones, best first; of search(), the accepted before all others.
  std::size_t compared = 0;        ///< Submaps of the map that were verified.
  /// The places that fit nearly as well as the first, which must be there.
  [[nodiscard]] std::vector<Hypothesis> rivals() const;
};

/// The `candidates` submaps of the map whose places look most alike to one of the robot's, no three of one spot; where
/// places are unknown, the first ones.
std::vector<SubmapId> most_alike(const KnownMap& map, const server::ClosureVerifier& verifier, const Submap& own,
                                 std::size_t candidates);

/// Where a submap of the robot may be, whose cloud lies roughly on those of the candidates: nothing of it is shown
/// until scans prove it (place_proof.hpp). An error: a cloud could not be read.
Result<SearchResult> rough_places(const KnownMap& map, LocalMaps& maps, const Submap& own,
                                  const std::vector<SubmapId>& candidates);

/// Compares a submap of the robot, whose chain the map does not have and comes after all of its, with submaps of the
/// map by the same verifier as a server does. An error: a payload could not be read.
Result<SearchResult> search(const KnownMap& map, const server::ClosureVerifier& verifier, const Submap& own,
                            const std::vector<SubmapId>& candidates);

}  // namespace tutti::localise
