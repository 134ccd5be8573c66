// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tutti/perception/visual/submap_features.hpp"

namespace tutti::visual {

/// An observation of an image, and a landmark of another submap.
struct Match {
  std::uint32_t observation = 0;  ///< Index into QueryFrame::observations.
  std::uint32_t landmark = 0;
};

/// Of a keyframe's observations, how many are near a landmark of the map in their descriptors (max_hamming): counted
/// up to `enough`, and not all of them, for it costs a twentieth of match(), which hardly ever finds more.
int count_near(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
               const VisualClosureConfig& config, int enough);

/// Of how many landmarks of the map an observation of the keyframe looks like a view.
struct Votes {
  std::vector<std::vector<Match>> matches;  ///< Of each image of the keyframe.
  int landmarks = 0;
  int together = 0;           ///< Of these, the most that one keyframe of the map saw.
  std::size_t distances = 0;  ///< Between descriptors: what it took.
};

/// match(), only of the observations that count_near() finds near a landmark: about half of a true place's matches for
/// a tenth of the work where there is none. What happens to look alike in another place (corners of windows) is
/// scattered over the map; what was seen again was seen together.
Votes votes(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
            const VisualClosureConfig& config);

/// Observations of an image whose descriptor is near one of a landmark of the map (max_hamming), much nearer than to
/// any other landmark (max_hamming_ratio), and the nearest of the image to that landmark. `query` has the rows that the
/// image's observations name; both are of one kind.
std::vector<Match> match(const QueryFrame& image, const Descriptors& query, const SubmapFeatures& map,
                         const VisualClosureConfig& config);

}  // namespace tutti::visual
