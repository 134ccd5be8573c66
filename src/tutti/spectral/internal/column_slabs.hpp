// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/spectral/graph.hpp"

namespace tutti::spectral::internal {

/// A sparse symmetric matrix laid out for products with very many vectors, sixteen at a time and in single precision:
/// every coefficient is read once for all sixteen, whose entries of one node lie side by side. For samples, which are
/// no more accurate than a few per cent; for few vectors, and to full precision, see RowBlocks.
class ColumnSlabs {
 public:
  static constexpr std::size_t kLanes = 16;
  /// kLanes vectors: entry `place * kLanes + lane`.
  using Slab = std::vector<float>;

  explicit ColumnSlabs(const SparseMatrix& matrix);

  [[nodiscard]] std::size_t size() const { return node_.size() * kLanes; }
  /// Node at each place of a slab.
  [[nodiscard]] const std::vector<int>& nodes() const { return node_; }

  /// One step of a three-term recurrence, and of every sum that runs along it:
  ///   y = scale M x + shift x - y;  sums[s] += weights[s] y  for s < weights.size().
  void step(float scale, float shift, const Slab& x, Slab& y, std::span<const double> weights,
            std::vector<Slab>& sums) const;

  struct Entry {
    float coefficient = 0.0F;
    int first = 0;  ///< First lane of its column.
  };

 private:
  std::vector<int> node_;
  std::vector<int> start_;  ///< Per row its first entry; one more at the end.
  std::vector<Entry> entry_;
};

}  // namespace tutti::spectral::internal
