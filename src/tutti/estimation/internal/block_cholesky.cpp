// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/block_cholesky.hpp"

#include <cblas.h>
#include <lapacke.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/single_thread.hpp"

namespace tutti::estimation::internal {
namespace {

/// A pivot below this share of its diagonal entry has no correct digit left.
constexpr double kSmallestPivotShare = 1e-14;

/// Adds B x B blocks of one block column to those at other rows.
template <int B>
class BlockColumn {
 public:
  BlockColumn(double* to, std::ptrdiff_t to_stride, const double* from, std::ptrdiff_t from_stride)
      : to_(to), to_stride_(to_stride), from_(from), from_stride_(from_stride) {}
  void add(std::ptrdiff_t to_row, std::ptrdiff_t from_row) const {
    for (int c = 0; c < B; ++c) {
      double* const to = to_ + c * to_stride_ + B * to_row;
      const double* const from = from_ + c * from_stride_ + B * from_row;
      for (int r = 0; r < B; ++r) to[r] += from[r];
    }
  }

 private:
  double* to_;
  std::ptrdiff_t to_stride_;
  const double* from_;
  std::ptrdiff_t from_stride_;
};

}  // namespace

BlockCholesky::BlockCholesky(const BlockStructure& structure, int block_size, std::size_t workspace)
    : structure_(structure), workspace_(workspace) {
  TUTTI_CHECK(block_size == 3 || block_size == 6, "blocks of {}", block_size);
  values_.assign(structure.block_row.size() * static_cast<std::size_t>(block_size * block_size), 0.0);
  factor_.layout = std::make_shared<const CholeskyFactor::Layout>(find_supernodes(structure), block_size);
  std::size_t most_blocks = 0;  // of an update
  for (const Supernode& node : supernodes()) {
    for (Group group; group.end < node.ancestors.size();) {
      group = group_from(node, group.end);
      most_blocks = std::max(most_blocks, group.rows * group.columns);
    }
    for (int column = node.first; column < node.end(); ++column)
      for (int entry = structure.column_start[column]; entry < structure.column_start[column + 1]; ++entry)
        position_.push_back(node.position_of(structure.block_row[entry]));
  }
  update_.resize(most_blocks * static_cast<std::size_t>(block_size * block_size));
}

void BlockCholesky::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

bool BlockCholesky::factorise() {
  const SingleThread single_thread;
  is_factorised_ = block_size() == 6 ? factorise_blocks<6>() : factorise_blocks<3>();
  return is_factorised_;
}

/// Into the panel.
template <int B>
void BlockCholesky::add_matrix(std::size_t supernode) {
  const Supernode& node = supernodes()[supernode];
  const Panel& panel = panels()[supernode];
  double* L = factor_.panel(supernode);
  for (int column = node.first; column < node.end(); ++column, L += static_cast<std::ptrdiff_t>(B) * panel.rows) {
    const int begin = structure_.column_start[column], end = structure_.column_start[column + 1];
    const BlockColumn<B> blocks(L, panel.rows, values_.data() + static_cast<std::ptrdiff_t>(B) * B * begin,
                                static_cast<std::ptrdiff_t>(B) * (end - begin));
    for (int entry = begin; entry < end; ++entry) blocks.add(position_[entry], entry - begin);
  }
}

/// As many ancestors as fit into the workspace, at least one.
BlockCholesky::Group BlockCholesky::group_from(const Supernode& node, std::size_t first) const {
  Group out{.first = first, .end = first, .row = node.ancestors[first].begin, .columns = 0, .rows = 0};
  out.rows = node.below.size() - out.row;
  const std::size_t most_blocks = workspace_ / static_cast<std::size_t>(block_size() * block_size());
  for (; out.end < node.ancestors.size(); ++out.end) {
    const std::size_t columns = node.ancestors[out.end].end - out.row;
    if (out.end > first && out.rows * columns > most_blocks) break;
    out.columns = columns;
  }
  return out;
}

/// Subtracts L_IJ L_IJ^T from the panels of the rows I below.
template <int B>
void BlockCholesky::update_ancestors(std::size_t supernode) {
  const Supernode& node = supernodes()[supernode];
  const Panel& panel = panels()[supernode];
  for (Group group; group.end < node.ancestors.size();) {
    group = group_from(node, group.end);
    const double* const L = factor_.panel(supernode) + panel.columns + B * static_cast<std::ptrdiff_t>(group.row);
    const int rows = B * static_cast<int>(group.rows), columns = B * static_cast<int>(group.columns);
    if (columns == rows)
      cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, rows, panel.columns, -1.0, L, panel.rows, 0.0,
                  update_.data(), rows);
    else
      cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows, columns, panel.columns, -1.0, L, panel.rows, L,
                  panel.rows, 0.0, update_.data(), rows);
    update<B>(node, group);
  }
}

/// Adds what is in the workspace to where it belongs.
template <int B>
void BlockCholesky::update(const Supernode& node, const Group& group) {
  const std::ptrdiff_t stride = B * static_cast<std::ptrdiff_t>(group.rows);
  for (std::size_t k = group.first; k < group.end; ++k) {
    const Supernode::Ancestor& ancestor = node.ancestors[k];
    const auto to = static_cast<std::size_t>(ancestor.supernode);
    const int height = panels()[to].rows;
    const auto first = static_cast<std::ptrdiff_t>(ancestor.begin - group.row);
    for (std::size_t c = 0; c < ancestor.end - ancestor.begin; ++c) {
      const BlockColumn<B> blocks(factor_.panel(to) + static_cast<std::ptrdiff_t>(B) * ancestor.at[c] * height, height,
                                  update_.data() + B * (first + static_cast<std::ptrdiff_t>(c)) * stride, stride);
      for (std::size_t r = c; r < ancestor.at.size(); ++r)
        blocks.add(ancestor.at[r], first + static_cast<std::ptrdiff_t>(r));
    }
  }
}

template <int B>
bool BlockCholesky::factorise_blocks() {
  if (!factor_)
    factor_.values = std::make_unique_for_overwrite<double[]>(static_cast<std::size_t>(factor_.layout->size));
  std::fill_n(factor_.values.get(), factor_.layout->size, 0.0);
  for (std::size_t s = 0; s < supernodes().size(); ++s) {
    const Panel& panel = panels()[s];
    double* const L = factor_.panel(s);
    const int w = panel.columns, m = panel.below();
    add_matrix<B>(s);
    if (LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', w, L, panel.rows) != 0 || !pivots_are_sound(s)) return false;
    if (m == 0) continue;
    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, m, w, 1.0, L, panel.rows, L + w,
                panel.rows);
    update_ancestors<B>(s);
  }
  return true;
}

bool BlockCholesky::pivots_are_sound(std::size_t supernode) const {
  const Supernode& node = supernodes()[supernode];
  const double* pivot = factor_.panel(supernode);
  for (int column = node.first; column < node.end(); ++column) {
    const int begin = structure_.column_start[column];
    const std::ptrdiff_t stride =
        static_cast<std::ptrdiff_t>(block_size()) * (structure_.column_start[column + 1] - begin);
    const double* diagonal = values_.data() + static_cast<std::ptrdiff_t>(block_size()) * block_size() * begin;
    for (int k = 0; k < block_size(); ++k, diagonal += stride + 1, pivot += panels()[supernode].rows + 1)
      if (!(*pivot * *pivot > kSmallestPivotShare * *diagonal)) return false;
  }
  return true;
}

const CholeskyFactor& BlockCholesky::factor() const {
  TUTTI_CHECK(is_factorised_, "no factor");
  return factor_;
}

CholeskyFactor BlockCholesky::take_factor() {
  TUTTI_CHECK(is_factorised_, "no factor to take");
  is_factorised_ = false;
  return {factor_.layout, std::move(factor_.values)};
}

void BlockCholesky::solve(Eigen::Ref<Eigen::MatrixXd> b) const {
  TUTTI_CHECK(b.rows() == static_cast<Eigen::Index>(block_size()) * structure_.variables, "{} rows", b.rows());
  TUTTI_CHECK(is_factorised_, "nothing to solve with");
  const SingleThread single_thread;
  const auto size = static_cast<Eigen::Index>(block_size());
  const auto within = [&](std::size_t s) { return b.middleRows(size * supernodes()[s].first, panels()[s].columns); };
  for (std::size_t s = 0; s < supernodes().size(); ++s) {
    factor_.solve_within(s, false, within(s));
    if (panels()[s].below() == 0) continue;
    const Eigen::MatrixXd product = factor_.times_below(s, within(s));
    Eigen::Index k = 0;
    for (const int row : supernodes()[s].below) b.middleRows(size * row, size) -= product.middleRows(size * k++, size);
  }
  Eigen::MatrixXd b_I;
  for (std::size_t s = supernodes().size(); s-- > 0;) {
    if (panels()[s].below() > 0) {
      b_I.resize(panels()[s].below(), b.cols());
      Eigen::Index k = 0;
      for (const int row : supernodes()[s].below) b_I.middleRows(size * k++, size) = b.middleRows(size * row, size);
      factor_.subtract_below(s, b_I, within(s));
    }
    factor_.solve_within(s, true, within(s));
  }
}

}  // namespace tutti::estimation::internal
