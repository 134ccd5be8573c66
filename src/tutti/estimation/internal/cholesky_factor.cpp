// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/cholesky_factor.hpp"

#include <cblas.h>

#include <algorithm>
#include <utility>

namespace tutti::estimation::internal {

CholeskyFactor::Layout::Layout(std::vector<Supernode> nodes, int block)
    : block_size(block), supernodes(std::move(nodes)) {
  for (const Supernode& node : supernodes) {
    const Panel& panel = panels.emplace_back(Panel{size, block * node.rows(), block * node.columns});
    size += static_cast<std::ptrdiff_t>(panel.rows) * panel.columns;
    supernode_of.insert(supernode_of.end(), static_cast<std::size_t>(node.columns),
                        static_cast<int>(panels.size()) - 1);
  }
}

CholeskyFactor CholeskyFactor::copy() const {
  CholeskyFactor out{layout, nullptr};
  if (!values) return out;
  out.values = std::make_unique_for_overwrite<double[]>(static_cast<std::size_t>(layout->size));
  std::copy_n(values.get(), layout->size, out.values.get());
  return out;
}

void CholeskyFactor::solve_within(std::size_t supernode, bool is_transposed, Eigen::Ref<Eigen::MatrixXd> b_J) const {
  const Panel& node = layout->panels[supernode];
  const CBLAS_TRANSPOSE how = is_transposed ? CblasTrans : CblasNoTrans;
  if (b_J.cols() == 1)
    cblas_dtrsv(CblasColMajor, CblasLower, how, CblasNonUnit, node.columns, panel(supernode), node.rows, b_J.data(), 1);
  else
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, how, CblasNonUnit, node.columns, static_cast<int>(b_J.cols()),
                1.0, panel(supernode), node.rows, b_J.data(), static_cast<int>(b_J.outerStride()));
}

Eigen::MatrixXd CholeskyFactor::times_below(std::size_t supernode, const Eigen::Ref<const Eigen::MatrixXd>& b_J) const {
  const Panel& node = layout->panels[supernode];
  const double* const L_IJ = panel(supernode) + node.columns;
  const int m = node.below(), columns = static_cast<int>(b_J.cols());
  Eigen::MatrixXd product(m, columns);
  if (columns == 1)
    cblas_dgemv(CblasColMajor, CblasNoTrans, m, node.columns, 1.0, L_IJ, node.rows, b_J.data(), 1, 0.0, product.data(),
                1);
  else
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, columns, node.columns, 1.0, L_IJ, node.rows, b_J.data(),
                static_cast<int>(b_J.outerStride()), 0.0, product.data(), m);
  return product;
}

void CholeskyFactor::subtract_below(std::size_t supernode, const Eigen::MatrixXd& b_I,
                                    Eigen::Ref<Eigen::MatrixXd> b_J) const {
  const Panel& node = layout->panels[supernode];
  const double* const L_IJ = panel(supernode) + node.columns;
  const int m = node.below(), columns = static_cast<int>(b_J.cols());
  if (columns == 1)
    cblas_dgemv(CblasColMajor, CblasTrans, m, node.columns, -1.0, L_IJ, node.rows, b_I.data(), 1, 1.0, b_J.data(), 1);
  else
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, node.columns, columns, m, -1.0, L_IJ, node.rows, b_I.data(), m,
                1.0, b_J.data(), static_cast<int>(b_J.outerStride()));
}

CholeskyFactor::Block CholeskyFactor::block(std::size_t supernode, int row, int column) const {
  const std::ptrdiff_t height = layout->panels[supernode].rows;
  return Block(panel(supernode) + 6 * column * height + 6 * row, Eigen::OuterStride<>(height));
}

CholeskyFactor::Column::Column(const CholeskyFactor& factor, std::size_t column)
    : factor_(factor),
      supernode_(static_cast<std::size_t>(factor.layout->supernode_of[column])),
      node_(factor.layout->supernodes[supernode_]),
      column_(static_cast<int>(column) - node_.first) {}

std::optional<std::size_t> CholeskyFactor::Column::parent() const {
  return below() > 0 ? std::optional(row(0)) : std::nullopt;
}

}  // namespace tutti::estimation::internal
