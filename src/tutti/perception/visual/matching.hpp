// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// Observations of an image whose descriptor is near one of a landmark of the map (max_hamming), much nearer than to
/// any other landmark (max_hamming_ratio), and the nearest of the image to that landmark. `query` has the rows that the
/// image's observations name; both are of one kind.
std::vector<Match> match(const QueryFrame& image, const Descriptors& query, const SubmapFeatures& map,
                         const VisualClosureConfig& config);

}  // namespace tutti::visual
