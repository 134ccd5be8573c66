// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/mission/recordings.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::lab {

/// Finds the closures that came with the recordings (a pose graph of several robots), each when it arrived then, and
/// none before both of its keyframes were taken. A keyframe that two submaps share counts for the earlier one. A
/// closure within one submap joins no pair and is never found.
class RecordedClosureVerifier final : public server::ClosureVerifier {
 public:
  explicit RecordedClosureVerifier(const std::vector<mission::MissionRecording>& recordings);
  [[nodiscard]] MethodId id() const override { return {"recorded", 1, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore&) const override;
  [[nodiscard]] std::vector<Timestamp> known_at(const Submap& first, const Submap& second) const override;

 private:
  struct End {
    RobotId robot;
    Timestamp stamp;
    friend auto operator<=>(const End&, const End&) = default;
  };
  struct Recorded {
    End from, to;  // from < to, as the submaps of a pair are ordered
    RelativePose measurement;
    Timestamp known_at;
  };
  /// Those from a keyframe of `first` to one of `second`, as they became known.
  [[nodiscard]] std::vector<const Recorded*> between(const Submap& first, const Submap& second) const;

  std::vector<Recorded> closures_;  // sorted by `from`
};

}  // namespace tutti::lab
