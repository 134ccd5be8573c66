// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/lab/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::lab {

/// A planted closure, in robots and stamps: a wrong closure at a given place and time.
struct PlantedClosure {
  RobotId robot;
  Timestamp stamp;
  RobotId other;
  Timestamp other_stamp;
  Pose3 T_claimed_true;  ///< Error of the claimed pose of `robot`, in the body frame of `other`.
};

/// For recordings without sensor data: closures from true relative poses, with noise and a share of wrong ones. For the
/// two submaps that contain the times of a planted closure it gives that one instead: between the keyframes nearest to
/// these times, the true relative pose with the given error, and the covariance of right ones.
class ReferenceClosureVerifier final : public server::ClosureVerifier {
 public:
  ReferenceClosureVerifier(std::map<RobotId, Trajectory> reference, const simulation::ReferenceClosureConfig& config,
                           std::uint64_t seed, std::vector<PlantedClosure> planted = {});
  [[nodiscard]] MethodId id() const override { return {"reference", simulation::ReferenceClosures::kVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return planted_in(first, second) || closures_.is_candidate(first, second);
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore&) const override {
    ClosureVerdict verdict{.pair = {first.id, second.id}};
    if (const auto planted = planted_in(first, second))
      verdict.closures.push_back(*planted);
    else
      verdict = closures_.verify(first, second);
    verdict.verifier = id();
    return verdict;
  }

 private:
  [[nodiscard]] std::optional<LoopClosure> planted_in(const Submap& first, const Submap& second) const;

  simulation::ReferenceClosures closures_;
  std::vector<PlantedClosure> planted_;
  Matrix6d covariance_;  // of planted closures
};

/// The verifier of a mission that load_input() has accepted (planted closures then name robots of the mission). A
/// verifier that needs the mission, because it draws or knows the reference, has no settings from which a worker could
/// make it.
std::shared_ptr<const server::ClosureVerifier> make_closure_verifier(
    const MissionConfig& config, const std::vector<mission::MissionRecording>& recordings, std::uint64_t seed);

}  // namespace tutti::lab
