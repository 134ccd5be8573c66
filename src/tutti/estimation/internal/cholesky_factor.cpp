// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/cholesky_factor.hpp"

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
