// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {

/// Cholesky factor of a symmetric positive definite matrix of 6 x 6 blocks, of which a little changes at a time: only
/// what lies above a change in the elimination tree is ordered and computed anew. Multifrontal [Duff & Reid 1983]:
/// every front keeps what it hands to its parent, so that a parent can be assembled again from children that did not
/// change. The update of the pattern follows the Bayes tree's [Kaess et al. 2012, alg. 2]: the affected top is taken
/// off and eliminated again, the subtrees below are hung back.
class FrontTree {
 public:
  using Pair = std::pair<int, int>;

  /// Takes over another pattern. `renumber`: present number of each old variable, -1 = removed; `changed`: per present
  /// variable, whether it is new or its neighbours changed; `pairs`: all neighbours a != b, in any order.
  void restructure(int variables, std::span<const int> renumber, const std::vector<char>& changed,
                   std::span<const Pair> pairs);

  /// The variable's column changed: its diagonal block, or one between it and a neighbour (touch both).
  void touch(int variable) { fronts_[front_of_[variable]].stale = true; }

  /// Where a column's blocks go.
  class Column {
   public:
    /// Whether the block between `row` and this column's variable belongs here (and not in the column of `row`).
    [[nodiscard]] bool takes(int row) const { return place_[row] > at_; }
    void add(int row, const Matrix6d& block);
    void add_diagonal(const Matrix6d& block);

   private:
    friend class FrontTree;
    Eigen::MatrixXd* values_ = nullptr;
    std::span<const int> place_;  ///< In this front, per variable; -1 = not in it.
    int at_ = 0;
  };
  /// Adds the diagonal block of `variable` and the blocks that its column takes.
  using Assemble = std::function<void(int variable, Column& column)>;

  /// Computes what was touched, and above. False, and everything is touched, when the matrix is not numerically
  /// positive definite: a pivot lost all digits against its diagonal entry.
  [[nodiscard]] bool factorise(const Assemble& assemble);
  /// Overwrites b (6 per variable) by H^-1 b. After a successful factorise() only.
  void solve(Eigen::VectorXd& b) const;

  /// Variables eliminated by the last factorise(), or by the fronts that the last restructure() made.
  [[nodiscard]] int computed() const { return computed_; }

 private:
  struct Front {
    std::vector<int> variables;  ///< Eliminated here first, then those it is next to; each in elimination order.
    int pivots = 0;
    int parent = -1;
    std::vector<int> children;
    bool stale = true;
    /// Lower triangle of blocks. Columns eliminated here: the factor, with inverted diagonal blocks; the others: what
    /// the parent adds.
    Eigen::MatrixXd values;
  };

  std::vector<char> find_affected(std::span<const int> renumber, const std::vector<char>& changed);
  static std::vector<Front> eliminate(std::span<const int> variables, std::span<const Pair> pairs);
  void link();
  [[nodiscard]] double operations() const;
  bool compute(Front& front, const Assemble& assemble);

  std::vector<Front> fronts_;  ///< Children before parents.
  std::vector<int> front_of_;  ///< Where each variable is eliminated.
  std::vector<int> place_;     ///< Work space of compute(): -1 outside.
  double ordered_operations_ = 0.0;
  int computed_ = 0;
};

}  // namespace tutti::estimation::internal
