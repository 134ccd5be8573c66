// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tutti/perception/visual/submap_features.hpp"

namespace tutti::visual {

/// An observation of an image that resembles a landmark of another submap, the map.
struct Match {
  std::uint32_t observation = 0;  ///< Index into QueryFrame::observations.
  std::uint32_t landmark = 0;
};

/// How many of a keyframe's observations have a descriptor near one of the map's landmarks (max_hamming), counted up to
/// `enough`. Some near ones are missed (DescriptorTables), but the count takes a twentieth of the time of match().
int count_near(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
               const VisualClosureConfig& config, int enough);

/// The landmarks of the map that a keyframe's observations resemble.
struct Votes {
  std::vector<std::vector<Match>> matches;  ///< Per image of the keyframe.
  int landmarks = 0;                        ///< Different landmarks among the matches.
  int together = 0;                         ///< The most of these landmarks that one keyframe of the map saw.
  std::size_t distances = 0;                ///< Descriptor distances that were computed.
};

/// As match(), for the observations alone that count_near() counts: about half of the matches at a true place, for a
/// tenth of the work at others. Points of another place that are similar by chance (corners of windows) are scattered
/// over the map; points that are seen again were seen together before.
Votes votes(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
            const VisualClosureConfig& config);

/// Matches of an image: observations whose descriptor is near one of a landmark of the map (max_hamming), much nearer
/// than to any other landmark's (max_hamming_ratio), and the nearest of the image to that landmark. `query`: the
/// descriptors that the image's observations refer to, of the same kind as the map's.
std::vector<Match> match(const QueryFrame& image, const Descriptors& query, const SubmapFeatures& map,
                         const VisualClosureConfig& config);

}  // namespace tutti::visual
