// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/simulation/bounds.hpp"

namespace tutti::lab {

/// How wrong closures are that the laboratory puts into a mission.
struct SpoiledClosureConfig {
  /// Share of the wrong ones that agree with their neighbours, as places that look alike cause.
  double agreeing_share = 0.3;
};

/// Makes a share of another verifier's accepted verdicts wrong, with their covariance unchanged. Which ones, and how
/// wrong they are, depends on (seed, pair) only; agreeing ones share their error over blocks of two submaps of each
/// robot.
class SpoiledClosureVerifier final : public server::WrappedVerifier {
 public:
  /// It has the other verifier's id; the caller must give it one of its own (verifiers::NamedVerifier).
  SpoiledClosureVerifier(std::shared_ptr<const server::ClosureVerifier> inner, double wrong_share,
                         const SpoiledClosureConfig& config, std::uint64_t seed);
  /// Nothing: a worker cannot make it.
  [[nodiscard]] std::string settings() const override { return {}; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;

 private:
  double wrong_share_;
  SpoiledClosureConfig config_;
  std::uint64_t seed_;
};

/// One wrong closure at a given place and time; `describe` explains the fields.
struct PlantedClosureConfig {
  std::string robot;
  double at_s = 0.0;
  std::string other;
  double other_at_s = 0.0;
  double ahead_m = 0.0;
  double left_m = 0.0;
  double yaw_deg = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("robot", robot, any(), "Name of the robot whose submap is claimed to be somewhere else than it is.");
    v.field("at_s", at_s, at_least(0.0), "Mission time of a moment in this submap.");
    v.field("other", other, any(), "Robot whose submap it is joined to; empty: the same.");
    v.field("other_at_s", other_at_s, at_least(0.0), "Mission time of a moment in that submap.");
    v.field("ahead_m", ahead_m, between(-simulation::kFarthest_m, simulation::kFarthest_m),
            "The claim's error as seen by the other robot at that moment: ahead,");
    v.field("left_m", left_m, between(-simulation::kFarthest_m, simulation::kFarthest_m), "... to the left,");
    v.field("yaw_deg", yaw_deg, between(-180.0, 180.0), "... and turned about the other robot.");
  }
};

}  // namespace tutti::lab
