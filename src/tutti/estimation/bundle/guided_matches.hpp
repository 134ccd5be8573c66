// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/estimation/bundle/landmark_merge.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::bundle {

struct GuidedMatchConfig {
  double radius_px = 40.0;  ///< How far from where the map's poses project it to a landmark is looked for.
  double max_hamming = 0.16;
  double max_hamming_ratio = 0.9;  ///< Distance of a match over that of the nearest descriptor of another landmark.

  template <class V>
  void describe(V& v) {
    v.field("max_hamming", max_hamming, between(0.0, 1.0), "Bits in which a match may differ, as a share of all.");
  }
};

/// What is one thing in pairs of submaps that closures tie together: every landmark of the first is projected into the
/// images of the second by the poses given, compared with the descriptors around, and matched with the landmark that
/// most images name, if that one names it too. Pairs with a submap that is not here, or without descriptors of one
/// kind, give nothing.
std::vector<LandmarkMatch> guided_matches(std::span<const PosedSubmap> submaps, std::span<const SubmapPair> pairs,
                                          const GuidedMatchConfig& config);

}  // namespace tutti::bundle
