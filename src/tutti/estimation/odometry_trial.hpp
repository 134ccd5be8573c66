// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::estimation {

/// Odometry of one chain without a gap: a piece of it. A chain may have several, which do not overlap.
struct OdometryChain {
  ChainId id;
  std::uint32_t first_index = 0;          ///< KeyframeId::index of T_odom_body[0]; the others count up from it.
  std::vector<Pose3> T_odom_body;         ///< Raw odometry.
  std::vector<Matrix6d> step_covariance;  ///< Of keyframe k -> k + 1 (right tangent); one fewer than poses.
  std::vector<Timestamp> stamps;          ///< Of the poses.
};

struct OdometryTrialConfig {
  double confidence = 0.999;
  std::uint64_t max_search_steps = 200'000;
  int min_joining_closures = 2;
  int min_closures = 5;
  int min_places = 2;
  double place_m = 10.0;
  double jump_per_place_m = 4.0;
  double min_jump_m = 0.3;
  double max_acquittal = 0.25;
  int max_failures_per_chain = 10;

  template <class V>
  void describe(V& v) {
    v.field("confidence", confidence, between(0.5, 0.999999999), "Share of pairs of true closures that should pass.");
    v.field("max_search_steps", max_search_steps, at_least(0.0),
            "Vertices visited by an exact clique search; beyond, the best clique found counts.");
    v.field("min_joining_closures", min_joining_closures, at_least(1.0),
            "Fewer closures that agree do not join two robots, or two pieces of one robot's odometry.");
    v.field("min_closures", min_closures, at_least(2.0),
            "Closures that agree with each other against a stretch of odometry, at least, to convict it.");
    v.field("min_places", min_places, at_least(1.0),
            "They must join more pairs of places than this: corridors that look alike make many at one pair.");
    v.field("place_m", place_m, greater_than(0.0), "A place is this much of a robot's way.");
    v.field("jump_per_place_m", jump_per_place_m, greater_than(0.0),
            "... and one pair more for every so many metres (0.2 rad each) that the odometry would have missed.");
    v.field("min_jump_m", min_jump_m, at_least(0.0),
            "Smaller failures are left to the optimisation. 0.2 rad count as a metre.");
    v.field("max_acquittal", max_acquittal, between(0.0, 1.0),
            "Pairs of places that speak for the stretch, as a share of those against it: with more, it is acquitted.");
    v.field("max_failures_per_chain", max_failures_per_chain, at_least(0.0),
            "Stretches of one robot's odometry that can be convicted.");
  }
};

/// Size of a failure in metres: 0.2 rad count as one.
inline double failure_size(double translation_m, double rotation_rad) { return translation_m + 5.0 * rotation_rad; }

/// Odometry between two keyframes of one chain that is not to be believed.
struct OdometryStretch {
  ChainId chain;
  std::uint32_t from = 0;  ///< KeyframeId::index
  std::uint32_t to = 0;
  friend auto operator<=>(const OdometryStretch&, const OdometryStretch&) = default;
};

struct OdometryVerdict {
  std::vector<bool> accepted;           ///< Per closure.
  std::vector<OdometryStretch> failed;  ///< By (chain, from).
};

/// Decides between closures and odometry that contradict each other (docs/math.md, "Who is wrong?").
/// Two closures between the same chains agree when the 4-cycle over them and the odometry *between* their ends closes
/// within the chi-square quantile (6 dof) of its covariance (Mangelson, Dominic, Eustice, Vasudevan, ICRA 2018), so
/// closures far apart are not held to one rigid transform, which loses true ones under drift. Accepted is, per pair of
/// chains, the largest clique, or a smaller one that joins more places; within one chain closures must also agree with
/// the odometry between their ends. A stretch of odometry is convicted when letting it go makes enough more closures,
/// at enough different places, agree; the two pieces then are chains of their own. Stretches are convicted one after
/// the other, the one that explains most first.
/// Does not depend on the order of the input. Closures that name an unknown chain or keyframe, or carry NaN or a
/// covariance that is not positive definite, are never accepted.
class OdometryTrial {
 public:
  /// All must outlive this.
  OdometryTrial(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                const OdometryTrialConfig& config);
  ~OdometryTrial();
  OdometryTrial(const OdometryTrial&) = delete;
  OdometryTrial& operator=(const OdometryTrial&) = delete;

  [[nodiscard]] OdometryVerdict decide();
  /// The closures' verdict if these stretches, and no others, have failed. They must be stretches of the chains and not
  /// overlap. Cheap: which closures agree is known.
  [[nodiscard]] OdometryVerdict assume(std::span<const OdometryStretch> failed);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// OdometryTrial(chains, closures, config).decide()
OdometryVerdict try_odometry(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                             const OdometryTrialConfig& config);

}  // namespace tutti::estimation
