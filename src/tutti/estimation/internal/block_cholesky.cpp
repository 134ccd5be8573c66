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
  if (!is_factorised_) return;
  const SingleThread single_thread;
  for (std::size_t s = 0; s < supernodes().size(); ++s) {
    substitute(s, false, b);
    if (panels()[s].below() > 0) take_below(s, b);
  }
  for (std::size_t s = supernodes().size(); s-- > 0;) {
    if (panels()[s].below() > 0) take_from_below(s, b);
    substitute(s, true, b);
  }
}

/// b_J <- L_JJ^-1 b_J, or L_JJ^-T b_J.
void BlockCholesky::substitute(std::size_t supernode, bool is_transposed, Eigen::Ref<Eigen::MatrixXd> b) const {
  const Panel& panel = panels()[supernode];
  const CBLAS_TRANSPOSE how = is_transposed ? CblasTrans : CblasNoTrans;
  const double* const L = factor_.panel(supernode);
  double* const b_J = b.data() + static_cast<std::ptrdiff_t>(block_size()) * supernodes()[supernode].first;
  if (b.cols() == 1)
    cblas_dtrsv(CblasColMajor, CblasLower, how, CblasNonUnit, panel.columns, L, panel.rows, b_J, 1);
  else
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, how, CblasNonUnit, panel.columns, static_cast<int>(b.cols()), 1.0,
                L, panel.rows, b_J, static_cast<int>(b.outerStride()));
}

/// b_I <- b_I - L_IJ b_J
void BlockCholesky::take_below(std::size_t supernode, Eigen::Ref<Eigen::MatrixXd> b) const {
  const Panel& panel = panels()[supernode];
  const int m = panel.below(), columns = static_cast<int>(b.cols());
  const double* const L = factor_.panel(supernode) + panel.columns;
  const double* const b_J = b.data() + static_cast<std::ptrdiff_t>(block_size()) * supernodes()[supernode].first;
  Eigen::MatrixXd product(m, columns);
  if (columns == 1)
    cblas_dgemv(CblasColMajor, CblasNoTrans, m, panel.columns, 1.0, L, panel.rows, b_J, 1, 0.0, product.data(), 1);
  else
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, columns, panel.columns, 1.0, L, panel.rows, b_J,
                static_cast<int>(b.outerStride()), 0.0, product.data(), m);
  Eigen::Index k = 0;
  for (const int row : supernodes()[supernode].below)
    b.middleRows(static_cast<Eigen::Index>(block_size()) * row, block_size()) -=
        product.middleRows(block_size() * k++, block_size());
}

/// b_J <- b_J - L_IJ^T b_I
void BlockCholesky::take_from_below(std::size_t supernode, Eigen::Ref<Eigen::MatrixXd> b) const {
  const Panel& panel = panels()[supernode];
  const int m = panel.below(), columns = static_cast<int>(b.cols());
  const double* const L = factor_.panel(supernode) + panel.columns;
  double* const b_J = b.data() + static_cast<std::ptrdiff_t>(block_size()) * supernodes()[supernode].first;
  Eigen::MatrixXd b_I(m, columns);
  Eigen::Index k = 0;
  for (const int row : supernodes()[supernode].below)
    b_I.middleRows(block_size() * k++, block_size()) =
        b.middleRows(static_cast<Eigen::Index>(block_size()) * row, block_size());
  if (columns == 1)
    cblas_dgemv(CblasColMajor, CblasTrans, m, panel.columns, -1.0, L, panel.rows, b_I.data(), 1, 1.0, b_J, 1);
  else
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, panel.columns, columns, m, -1.0, L, panel.rows, b_I.data(), m,
                1.0, b_J, static_cast<int>(b.outerStride()));
}

}  // namespace tutti::estimation::internal
