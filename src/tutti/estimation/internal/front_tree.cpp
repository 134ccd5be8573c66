// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/front_tree.hpp"

#include <cblas.h>
#include <lapacke.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

#include "tutti/base/single_thread.hpp"
#include "tutti/estimation/internal/dissection.hpp"

namespace tutti::estimation::internal {
namespace {

/// A pivot below this share of its diagonal entry has no correct digit left.
constexpr double kSmallestPivotShare = 1e-14;
/// Once the tops eliminated again have made the whole tree so much more costly than it was when last ordered whole, it
/// is ordered whole again.
constexpr double kReorderFrom = 2.0;

/// From so many blocks on, BLAS is faster than products of fixed size.
constexpr int kLargeBlocks = 8;
/// A column joins the front before it when that stores at most one zero per so many blocks.
constexpr std::size_t kBlocksPerZero = 8;

using Block = Eigen::Map<Matrix6d, 0, Eigen::OuterStride<>>;
using ConstBlock = Eigen::Map<const Matrix6d, 0, Eigen::OuterStride<>>;

Block block(Eigen::MatrixXd& A, int row, int column) {
  return Block(A.data() + 6 * (row + column * A.rows()), Eigen::OuterStride<>(A.rows()));
}
ConstBlock block(const Eigen::MatrixXd& A, int row, int column) {
  return ConstBlock(A.data() + 6 * (row + column * A.rows()), Eigen::OuterStride<>(A.rows()));
}

/// Inverts the lower triangle L of a diagonal block; false when a pivot is not sound.
bool invert(const Matrix6d& L, const double* diagonal, Block out) {
  for (int d = 0; d < 6; ++d)
    if (!(L(d, d) * L(d, d) > kSmallestPivotShare * diagonal[d])) return false;
  out = L.triangularView<Eigen::Lower>().solve(Matrix6d::Identity());
  return true;
}

/// The same as eliminate_columns(), by BLAS.
bool eliminate_large(Eigen::MatrixXd& A, int pivots, const Eigen::VectorXd& diagonal) {
  const int n = static_cast<int>(A.rows());
  const int k = 6 * pivots;
  double* below = A.data() + k;
  if (LAPACKE_dpotrf(LAPACK_COL_MAJOR, 'L', k, A.data(), n) != 0) return false;
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, n - k, k, 1.0, A.data(), n, below, n);
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n - k, k, -1.0, below, n, 1.0, below + std::ptrdiff_t{n} * k, n);
  for (int p = 0; p < pivots; ++p)
    if (!invert(block(A, p, p), diagonal.data() + 6 * p, block(A, p, p))) return false;
  return true;
}

/// Eliminates the first `pivots` block columns of A. `diagonal`: entries before anything was subtracted.
bool eliminate_columns(Eigen::MatrixXd& A, int pivots, const Eigen::VectorXd& diagonal) {
  const int blocks = static_cast<int>(A.rows()) / 6;
  if (blocks >= kLargeBlocks) return eliminate_large(A, pivots, diagonal);
  for (int k = 0; k < pivots; ++k) {
    Matrix6d L = block(A, k, k);
    if (Eigen::LLT<Eigen::Ref<Matrix6d>> factor(L); factor.info() != Eigen::Success) return false;
    if (!invert(L, diagonal.data() + 6 * k, block(A, k, k))) return false;
    const Matrix6d inverse = block(A, k, k);
    for (int i = k + 1; i < blocks; ++i) {
      const Matrix6d L_i = block(A, i, k) * inverse.transpose();
      block(A, i, k) = L_i;
      for (int j = k + 1; j <= i; ++j) block(A, i, j).noalias() -= L_i * block(A, j, k).transpose();
    }
  }
  return true;
}

/// Adds what a child keeps for its parent; `place`: its variables in A.
void extend_add(const Eigen::MatrixXd& child, int pivots, std::span<const int> variables, std::span<const int> place,
                Eigen::MatrixXd& A) {
  const int blocks = static_cast<int>(variables.size());
  for (int c = pivots; c < blocks; ++c) {
    const int to_c = place[variables[c]];
    for (int r = c; r < blocks; ++r) {
      const int to_r = place[variables[r]];
      if (to_r >= to_c)
        block(A, to_r, to_c) += block(child, r, c);
      else
        block(A, to_c, to_r) += block(child, r, c).transpose();
    }
  }
}

}  // namespace

void FrontTree::Column::add(int row, const Matrix6d& values) { block(*values_, place_[row], at_) += values; }
void FrontTree::Column::add_diagonal(const Matrix6d& values) { block(*values_, at_, at_) += values; }

/// Per front, whether it has to be eliminated again; all get the present numbers.
std::vector<char> FrontTree::find_affected(std::span<const int> renumber, const std::vector<char>& changed) {
  std::vector<char> affected(fronts_.size(), 0);
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    for (int& v : front.variables) v = renumber[v];
    for (int k = 0; k < front.pivots; ++k)
      if (const int v = front.variables[k]; v < 0 || changed[v]) affected[f] = 1;
    if (affected[f] && front.parent >= 0) affected[front.parent] = 1;
  }
  return affected;
}

void FrontTree::restructure(int variables, std::span<const int> renumber, const std::vector<char>& changed,
                            std::span<const Pair> pairs) {
  const auto affected = find_affected(renumber, changed);
  std::vector<char> open(variables, 1);
  std::vector<Pair> open_pairs;
  std::vector<Front> fronts;
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    if (affected[f]) continue;
    Front& front = fronts_[f];
    for (int k = 0; k < front.pivots; ++k) open[front.variables[k]] = 0;
    if (front.parent >= 0 && affected[front.parent])
      for (std::size_t a = front.pivots; a < front.variables.size(); ++a)
        for (std::size_t b = front.pivots; b < a; ++b) open_pairs.emplace_back(front.variables[a], front.variables[b]);
    fronts.push_back(std::move(front));
  }
  for (const auto& [a, b] : pairs)
    if (open[a] && open[b]) open_pairs.emplace_back(a, b);
  std::vector<int> top;
  for (int v = 0; v < variables; ++v)
    if (open[v]) top.push_back(v);
  computed_ = static_cast<int>(top.size());
  auto eliminated = eliminate(top, open_pairs);
  std::move(eliminated.begin(), eliminated.end(), std::back_inserter(fronts));
  fronts_ = std::move(fronts);
  front_of_.resize(variables);
  place_.assign(variables, -1);
  link();

  const double now = operations() / std::max(variables, 1);
  if (computed_ == variables) {
    ordered_operations_ = now;
  } else if (now > kReorderFrom * ordered_operations_) {
    fronts_.clear();
    restructure(variables, {}, changed, pairs);
  }
}

/// Fronts that eliminate `variables` (increasing), from `pairs` of them.
std::vector<FrontTree::Front> FrontTree::eliminate(std::span<const int> variables, std::span<const Pair> pairs) {
  const int n = static_cast<int>(variables.size());
  const auto local = [&](int v) {
    return static_cast<int>(std::lower_bound(variables.begin(), variables.end(), v) - variables.begin());
  };
  std::vector<Pair> local_pairs;
  local_pairs.reserve(pairs.size());
  for (const auto& [a, b] : pairs) local_pairs.emplace_back(local(a), local(b));
  const Adjacency graph = make_adjacency(n, local_pairs);
  const std::vector<int> order = dissect(graph);
  std::vector<int> position(n);
  for (int k = 0; k < n; ++k) position[order[k]] = k;

  std::vector<Front> fronts;
  std::vector<std::vector<int>> later(n);  // neighbours eliminated later, fill included
  for (int k = 0; k < n; ++k) {
    auto& mine = later[k];
    for (const int u : graph.of(order[k]))
      if (position[u] > k) mine.push_back(position[u]);
    std::sort(mine.begin(), mine.end());
    mine.erase(std::unique(mine.begin(), mine.end()), mine.end());
    if (!mine.empty()) {
      auto& parent = later[mine.front()];
      parent.insert(parent.end(), mine.begin() + 1, mine.end());
    }
    const bool joins =
        k > 0 && later[k - 1].size() + mine.size() / kBlocksPerZero >= mine.size() + 1 && later[k - 1].front() == k;
    if (!joins) fronts.emplace_back();
    Front& front = fronts.back();
    front.variables.resize(front.pivots);
    front.variables.push_back(variables[order[k]]);
    ++front.pivots;
    for (const int u : mine) front.variables.push_back(variables[order[u]]);
  }
  return fronts;
}

/// Parents and children from the variables.
void FrontTree::link() {
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    fronts_[f].children.clear();
    for (int k = 0; k < fronts_[f].pivots; ++k) front_of_[fronts_[f].variables[k]] = static_cast<int>(f);
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    front.parent = -1;
    for (std::size_t k = front.pivots; k < front.variables.size(); ++k)
      if (const int g = front_of_[front.variables[k]]; front.parent < 0 || g < front.parent) front.parent = g;
    if (front.parent >= 0) fronts_[front.parent].children.push_back(static_cast<int>(f));
  }
}

/// Of one factorisation of everything, in block products.
double FrontTree::operations() const {
  double sum = 0.0;
  for (const Front& front : fronts_)
    for (int k = 0; k < front.pivots; ++k) {
      const auto below = static_cast<double>(front.variables.size()) - 1.0 - k;
      sum += below * below + below + 1.0;
    }
  return sum;
}

bool FrontTree::compute(Front& front, const Assemble& assemble) {
  const auto size = 6 * static_cast<Eigen::Index>(front.variables.size());
  front.values.setZero(size, size);
  for (std::size_t k = 0; k < front.variables.size(); ++k) place_[front.variables[k]] = static_cast<int>(k);
  Column column;
  column.values_ = &front.values;
  column.place_ = place_;
  for (; column.at_ < front.pivots; ++column.at_) assemble(front.variables[column.at_], column);
  const Eigen::VectorXd diagonal = front.values.diagonal();
  for (const int child : front.children) {
    const Front& c = fronts_[child];
    extend_add(c.values, c.pivots, c.variables, place_, front.values);
  }
  for (const int v : front.variables) place_[v] = -1;
  return eliminate_columns(front.values, front.pivots, diagonal);
}

bool FrontTree::factorise(const Assemble& assemble) {
  const SingleThread single_thread;
  computed_ = 0;
  for (Front& front : fronts_) {
    if (!front.stale) continue;
    if (!compute(front, assemble)) {
      for (Front& other : fronts_) other.stale = true;
      return false;
    }
    front.stale = false;
    if (front.parent >= 0) fronts_[front.parent].stale = true;
    computed_ += front.pivots;
  }
  return true;
}

void FrontTree::solve(Eigen::VectorXd& b) const {
  Eigen::Index largest = 0;
  for (const Front& front : fronts_) largest = std::max(largest, front.values.rows());
  Eigen::VectorXd work(largest);
  const auto gather = [&](const Front& front) {
    auto x = work.head(front.values.rows());
    for (std::size_t k = 0; k < front.variables.size(); ++k) x.segment<6>(6 * k) = b.segment<6>(6 * front.variables[k]);
    return x;
  };
  const auto panel = [](const Front& front, int k) {
    return front.values.middleCols<6>(6 * k).bottomRows(front.values.rows() - 6 * (k + 1));
  };
  for (const Front& front : fronts_) {
    auto x = gather(front);
    for (int k = 0; k < front.pivots; ++k) {
      const auto below = panel(front, k);
      const Vector6d y = block(front.values, k, k) * x.segment<6>(6 * k);
      x.segment<6>(6 * k) = y;
      x.tail(below.rows()).noalias() -= below * y;
    }
    for (std::size_t k = 0; k < front.variables.size(); ++k) b.segment<6>(6 * front.variables[k]) = x.segment<6>(6 * k);
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    auto x = gather(front);
    for (int k = front.pivots; k-- > 0;) {
      const auto below = panel(front, k);
      const Vector6d y = x.segment<6>(6 * k) - below.transpose() * x.tail(below.rows());
      x.segment<6>(6 * k) = block(front.values, k, k).transpose() * y;
      b.segment<6>(6 * front.variables[k]) = x.segment<6>(6 * k);
    }
  }
}

}  // namespace tutti::estimation::internal
