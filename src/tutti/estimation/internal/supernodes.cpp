// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/supernodes.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace tutti::estimation::internal {
namespace {

/// Columns of one structure: column j + 1 goes with j when it is j's parent and has no row that j has not.
std::vector<Supernode> fundamental(const BlockStructure& s) {
  std::vector<Supernode> out;
  std::vector<std::vector<int>> children(s.variables);  // per column, those that it is the first row below of
  std::vector<int> seen_by(s.variables, -1);
  for (int j = 0; j < s.variables; ++j) {
    std::vector<int> rows;
    const auto take = [&](const auto begin, const auto end) {
      for (auto row = begin; row != end; ++row)
        if (*row != j && std::exchange(seen_by[*row], j) != j) rows.push_back(*row);
    };
    const bool is_parent = !out.empty() && !out.back().below.empty() && out.back().below.front() == j;
    if (is_parent) take(out.back().below.begin(), out.back().below.end());
    const std::size_t known = rows.size();
    take(s.block_row.begin() + s.column_start[j], s.block_row.begin() + s.column_start[j + 1]);
    for (const int child : children[j]) take(out[child].below.begin(), out[child].below.end());
    if (is_parent && rows.size() == known) {
      ++out.back().columns;
      out.back().below = std::move(rows);
      continue;
    }
    if (!out.empty() && !is_parent && !out.back().below.empty())
      children[out.back().below.front()].push_back(static_cast<int>(out.size()) - 1);
    std::ranges::sort(rows);
    out.push_back({.first = j, .columns = 1, .below = std::move(rows), .ancestors = {}});
  }
  return out;
}

/// Block entries of a panel's lower half.
std::int64_t entries_of(std::int64_t columns, std::int64_t below) {
  return columns * (columns + 1) / 2 + columns * below;
}

/// Measured on torus3D, parking-garage and chains with few closures: larger panels take more memory and no less time.
bool is_worth_it(std::int64_t columns, std::int64_t zeros, std::int64_t entries) {
  const double most = columns <= 6 ? 0.3 : columns <= 20 ? 0.1 : 0.05;
  return static_cast<double>(zeros) < most * static_cast<double>(entries);
}

std::vector<Supernode> merged(std::vector<Supernode> fine) {
  std::vector<Supernode> out;
  std::vector<std::int64_t> zeros;  // per supernode of `out`
  for (Supernode& next : fine) {
    out.push_back(std::move(next));
    zeros.push_back(0);
    while (out.size() > 1) {
      Supernode& last = out.back();
      const Supernode& before = out[out.size() - 2];
      if (before.below.empty() || before.below.front() >= last.end()) break;  // not its child
      const auto new_zeros =
          static_cast<std::int64_t>(before.columns) * (last.rows() - static_cast<std::int64_t>(before.below.size()));
      const int columns = before.columns + last.columns;
      const std::int64_t all_zeros = zeros[out.size() - 2] + zeros.back() + new_zeros;
      if (!is_worth_it(columns, all_zeros, entries_of(columns, static_cast<std::int64_t>(last.below.size())))) break;
      last.first = before.first;
      last.columns = columns;
      out.erase(out.end() - 2);
      zeros.pop_back();
      zeros.back() = all_zeros;
    }
  }
  return out;
}

}  // namespace

int Supernode::position_of(int row) const {
  if (row < end()) return row - first;
  return columns + static_cast<int>(std::ranges::lower_bound(below, row) - below.begin());
}

std::vector<Supernode> find_supernodes(const BlockStructure& structure) {
  std::vector<Supernode> out = merged(fundamental(structure));
  std::vector<int> of_column(structure.variables);
  for (std::size_t s = 0; s < out.size(); ++s)
    std::fill_n(of_column.begin() + out[s].first, out[s].columns, static_cast<int>(s));
  for (Supernode& node : out) {
    for (std::size_t begin = 0, end = 0; begin < node.below.size(); begin = end) {
      const int supernode = of_column[node.below[begin]];
      const Supernode& of = out[supernode];
      while (end < node.below.size() && node.below[end] < of.end()) ++end;
      Supernode::Ancestor& ancestor = node.ancestors.emplace_back(Supernode::Ancestor{supernode, begin, end, {}});
      for (std::size_t k = begin; k < node.below.size(); ++k) ancestor.at.push_back(of.position_of(node.below[k]));
    }
  }
  return out;
}

}  // namespace tutti::estimation::internal
