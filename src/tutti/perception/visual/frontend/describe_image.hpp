// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "tutti/base/config.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// How images of keyframes are described, so that places can be recognised.
struct DescriptorConfig {
  std::string kind = "brisk";
  int keypoints = 600;
  int threshold = 20;   ///< Grey values by which a corner differs from what is round it, over all scales.
  int cell_px = 40;     ///< Keypoints are spread evenly over cells of this size.
  int distance_px = 4;  ///< Keypoints are at least this far from each other.
  template <class V>
  void describe(V& v) {
    v.field("kind", kind, one_of({"brisk", "orb"}),
            "brisk (Leutenegger et al. 2011), or orb (Rublee et al. 2011): faster, finds fewer revisits.");
    v.field("keypoints", keypoints, between(10, 5000), "Most keypoints of an image that are described.");
  }
};

/// Keypoints of an image with their descriptors. `tracked` come first, unchanged, and are described where they are, at
/// the finest scale; others, of track 0, are detected over all scales, away from these, until there are
/// `config.keypoints`. An image without texture, or below 64 pixels a side, has no keypoints. Near its edge the image
/// is taken as mirrored there. Several threads may call at once.
TrackedImage describe_image(const Image& image, const DescriptorConfig& config = {},
                            std::span<const TrackedKeypoint> tracked = {});

}  // namespace tutti::visual
