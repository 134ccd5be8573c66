// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace tutti::visual::internal {

/// A place where something may be followed or described, and how well it stands out.
struct Candidate {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float strength = 0.0F;
};

struct SpreadRule {
  int width_px = 0;
  int height_px = 0;
  int cell_px = 40;
  int distance_px = 10;  ///< Between any two, and to those taken.
  std::size_t most = 0;  ///< To choose.
};

/// Indices of candidates spread over the image: first the strongest of every cell that has none yet, then the second
/// of every cell, and so on. `taken` are places that count as chosen already.
std::vector<std::size_t> spread(std::span<const Candidate> candidates, std::span<const Eigen::Vector2f> taken,
                                const SpreadRule& rule);

}  // namespace tutti::visual::internal
