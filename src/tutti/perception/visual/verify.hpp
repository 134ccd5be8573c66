// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tutti/model/loop_closure.hpp"
#include "tutti/perception/visual/closure_config.hpp"
#include "tutti/perception/visual/submap_features.hpp"

namespace tutti::visual {

/// Of what extract_features, is_candidate and verify_pair make of two submaps. Raised by hand in the commit that
/// changes it, be it by a gate's default: servers then ask again what another version answered.
inline constexpr std::uint32_t kFinderVersion = 3;

/// What pairs cost, counted.
struct VerificationWork {
  std::size_t keyframes = 0;  ///< Asked for.
  std::size_t looked_at = 0;  ///< Of these, among all landmarks of the other submap.
  std::size_t distances = 0;  ///< Between two descriptors, nearly all of what a pair costs.
  std::size_t samples = 0;    ///< Of three sightings, for a pose.
  VerificationWork& operator+=(const VerificationWork& other);
};

/// Cheap, without payloads: far enough apart in their chain, if it is one, and in time. first < second.
bool is_candidate(const Submap& first, const Submap& second, std::uint32_t min_submap_gap,
                  const VisualClosureConfig& config);

/// Decides from the two submaps alone which keyframes of one see landmarks of the other, and where from: every keyframe
/// of either of which enough landmarks of the other look like ones that it sees, some of them together (votes()), is
/// looked for among its landmarks (matching.hpp,
/// absolute_pose.hpp). A closure is from the
/// keyframe that saw most of those landmarks, and is believed for what it measures: how sure its position is, and over
/// how much of an image its inliers are spread; many inliers in one patch prove nothing. In the order of the submap
/// ids, whatever the order of a and b. Refused for the reason that the keyframe which came farthest met.
/// Whose verdict it is, is not said.
/// `work`, if asked for, is added to.
ClosureVerdict verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const VisualClosureConfig& config,
                           VerificationWork* work = nullptr);

}  // namespace tutti::visual
