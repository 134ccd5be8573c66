// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tutti/model/loop_closure.hpp"
#include "tutti/perception/visual/closure_config.hpp"
#include "tutti/perception/visual/submap_features.hpp"

namespace tutti::visual {

/// Version of what extract_features(), is_candidate() and verify_pair() find. A commit that changes their results, if
/// only by a gate's default, raises it by hand: servers then ask again what another version answered.
inline constexpr std::uint32_t kVerifierVersion = 3;

/// Counts of what verifying pairs costs.
struct VerificationWork {
  std::size_t keyframes = 0;  ///< Keyframes of both submaps.
  std::size_t looked_at = 0;  ///< Those among them that were matched with all landmarks of the other submap.
  std::size_t distances = 0;  ///< Descriptor distances, which are nearly all of the cost.
  std::size_t samples = 0;    ///< RANSAC samples of three sightings.
  VerificationWork& operator+=(const VerificationWork& other);
};

/// Cheap test that needs no payloads: true if the submaps are far enough apart in time and, on one chain, by at least
/// `min_submap_gap` submaps. first.id < second.id.
bool is_candidate(const Submap& first, const Submap& second, std::uint32_t min_submap_gap,
                  const VisualClosureConfig& config);

/// Decides from the two submaps alone which keyframes of one see landmarks of the other, and from where. A keyframe is
/// tried when enough of its observations resemble landmarks of the other submap, some of them seen together there
/// (votes()); then it is matched with all of that submap's landmarks (match()) and localised among them
/// (absolute_pose()). A closure joins it with the keyframe that saw most of these landmarks. It is believed for how
/// certain its position is and over how much of an image its inliers are spread, not for their number, because many
/// inliers in one patch prove nothing. A refusal gives the reason met by the keyframe that came farthest. The result
/// does not depend on the order of a and b; ClosureVerdict::verifier is left empty for the caller. The cost is added to
/// `work` unless that is null.
ClosureVerdict verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const VisualClosureConfig& config,
                           VerificationWork* work = nullptr);

}  // namespace tutti::visual
