// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/spectral/graph.hpp"

namespace tutti::spectral::internal {

/// A sparse symmetric matrix laid out for many products with few vectors. Nodes are renumbered so that neighbours sit
/// close together (reverse Cuthill-McKee, then gather_neighbours()); then eight consecutive rows have nearly the same
/// columns and share one list of them: per column one index, one entry of the vector and eight coefficients, no
/// gather. 5.7 us a product for 1600 nodes of 28 neighbours with SSE2 (3.5 us compiled for AVX-512; Eigen's own product
/// 20 us). Vectors are in the new numbering and padded with zeros to size().
class RowBlocks {
 public:
  static constexpr int kRows = 8;
  static constexpr std::size_t kCacheBytes = std::size_t{1} << 20U;  ///< A core may be taken to have it to itself.

  explicit RowBlocks(const SparseMatrix& matrix);

  [[nodiscard]] Eigen::Index nodes() const { return static_cast<Eigen::Index>(node_.size()); }
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(start_.size() - 1) * kRows; }
  /// Coefficients that are kept, zeros among them: what a product costs.
  [[nodiscard]] Eigen::Index entries() const { return coefficient_.size(); }
  [[nodiscard]] Eigen::VectorXd to_blocks(const Eigen::Ref<const Eigen::VectorXd>& nodes) const;
  void from_blocks(const Eigen::Ref<const Eigen::VectorXd>& blocks, Eigen::Ref<Eigen::VectorXd> nodes) const;

  /// A step of a three-term recurrence, and of every sum that runs along it:
  ///   y = scale M x + shift x - y;  sums.col(s) += weights[s] y  for s < weights.size().
  struct Step {
    double scale = 1.0, shift = 0.0;
    std::span<const double> weights;  ///< By the first columns of `sums`.
  };
  /// Many steps, each with the roles of x and y exchanged: afterwards `x` is the newest vector and `y` the one before.
  /// Takes several steps on some rows before it goes on to the next (wavefronts of a banded matrix), so that a matrix
  /// that is larger than the processor's cache is read once for many steps. Each row is computed as by one step after
  /// another: the result is the same to the bit.
  void run(std::span<const Step> steps, Eigen::VectorXd& x, Eigen::VectorXd& y, Eigen::MatrixXd& sums,
           std::size_t cache_bytes = kCacheBytes) const;
  /// One step without sums.
  void step(double scale, double shift, const Eigen::VectorXd& x, Eigen::VectorXd& y) const;

  /// How run() goes about it, in blocks of rows: `steps` at a time on `rows`, `reach` blocks behind each other.
  struct Wave {
    std::ptrdiff_t rows = 0, reach = 0;
    std::size_t steps = 1;
  };
  [[nodiscard]] Wave wave(std::size_t cache_bytes = kCacheBytes) const;

 private:
  void step_rows(const Step& step, std::ptrdiff_t begin, std::ptrdiff_t end, const double* x, double* y,
                 Eigen::MatrixXd& sums) const;
  std::vector<int> node_;        ///< Node at each place.
  std::vector<int> start_;       ///< Per block of rows: its first column; one more at the end.
  std::vector<int> column_;      ///< Place in the vector.
  Eigen::VectorXd coefficient_;  ///< kRows per column.
  std::ptrdiff_t reach_ = 0;     ///< Rows of a block have neighbours at most so many blocks away.
};

}  // namespace tutti::spectral::internal
