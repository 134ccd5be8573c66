// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/block_structure.hpp"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <tuple>

#include "tutti/base/check.hpp"

namespace tutti::estimation::internal {
namespace {

using Pair = std::pair<int, int>;  // column < row

/// Per node: fixed, or the first of a component without a fixed one.
std::vector<bool> anchors(const BlockStructure& s, std::span<const std::size_t> fixed) {
  std::vector<bool> anchored(s.component.size(), false);
  std::vector<bool> anchored_component(s.components, false);  // per component
  const auto anchor = [&](std::size_t i) { anchored[i] = anchored_component[s.component[i]] = true; };
  for (const std::size_t i : fixed) {
    TUTTI_CHECK(i < anchored.size(), "fixed node {} of {} nodes", i, anchored.size());
    anchor(i);
  }
  for (std::size_t i = 0; i < anchored.size(); ++i)
    if (!anchored_component[s.component[i]]) anchor(i);
  return anchored;
}

/// Nested dissection costs several times what minimum degree costs and pays back, over the factorisations of one solve,
/// from about this many operations per factorisation of the 6 x 6 blocks (measured on sphere2500 and torus3D).
constexpr double kDissectionPaysFrom = 5e8;

/// Runs one fill-reducing, postordered analysis; `order[k]` = variable eliminated k-th. Returns the operation count.
double analyse_with(int method, cholmod_sparse& matrix, std::vector<int>& order) {
  // METIS draws from the C library's one random sequence; two runs at a time would disturb each other's result.
  static std::mutex metis_mutex;
  const std::scoped_lock lock(metis_mutex);
  cholmod_common common;
  cholmod_start(&common);
  common.print = 0;
  common.nmethods = 1;
  common.method[0].ordering = method;
  common.supernodal = CHOLMOD_SIMPLICIAL;
  cholmod_factor* factor = cholmod_analyze(&matrix, &common);
  double operations = std::numeric_limits<double>::infinity();
  if (factor != nullptr) {
    const auto* permutation = static_cast<const int*>(factor->Perm);
    order.assign(permutation, permutation + factor->n);
    operations = common.fl * 6.0 * 6.0 * 6.0;
  }
  cholmod_free_factor(&factor, &common);
  cholmod_finish(&common);
  return operations;
}

/// Position of each variable in the elimination order. `pairs`: sorted, unique.
std::vector<int> elimination_positions(int n, const std::vector<Pair>& pairs) {
  std::vector<int> start(n + 1, 0);
  std::vector<int> rows(pairs.size());
  for (const auto& [column, row] : pairs) ++start[column + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  for (std::size_t k = 0; k < pairs.size(); ++k) rows[k] = pairs[k].second;
  cholmod_sparse matrix{};
  matrix.nrow = matrix.ncol = static_cast<std::size_t>(n);
  matrix.nzmax = pairs.size();
  matrix.p = start.data();
  matrix.i = rows.data();
  matrix.stype = -1;
  matrix.itype = CHOLMOD_INT;
  matrix.xtype = CHOLMOD_PATTERN;
  matrix.sorted = 1;
  matrix.packed = 1;

  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  const double operations = analyse_with(CHOLMOD_AMD, matrix, order);
  if (std::vector<int> dissection;
      operations > kDissectionPaysFrom && analyse_with(CHOLMOD_METIS, matrix, dissection) < operations)
    order = std::move(dissection);
  std::vector<int> position(n);
  for (int k = 0; k < n; ++k) position[order[k]] = k;
  return position;
}

void sort_unique(std::vector<Pair>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

}  // namespace

BlockStructure analyse_blocks(const PoseGraph& graph, std::span<const std::pair<std::size_t, std::size_t>> extra,
                              std::span<const std::size_t> fixed) {
  const std::size_t nodes = graph.poses.size();
  for (const auto& edge : graph.edges)
    TUTTI_CHECK(edge.from < nodes && edge.to < nodes, "edge {} -> {} of {} nodes", edge.from, edge.to, nodes);
  BlockStructure s;
  std::tie(s.component, s.components) = components(graph);
  const std::vector<bool> anchored = anchors(s, fixed);
  s.variable.assign(nodes, -1);
  for (std::size_t i = 0; i < nodes; ++i)
    if (!anchored[i]) s.variable[i] = s.variables++;

  std::vector<Pair> pairs;
  pairs.reserve(graph.edges.size() + extra.size());
  const auto add = [&](std::size_t a, std::size_t b) {
    const int u = s.variable[a];
    const int v = s.variable[b];
    if (u >= 0 && v >= 0 && u != v && s.component[a] == s.component[b])
      pairs.emplace_back(std::min(u, v), std::max(u, v));
  };
  for (const auto& edge : graph.edges) add(edge.from, edge.to);
  for (const auto& [a, b] : extra) {
    TUTTI_CHECK(a < nodes && b < nodes, "pair {}, {} of {} nodes", a, b, nodes);
    add(a, b);
  }
  sort_unique(pairs);
  const std::vector<int> position = elimination_positions(s.variables, pairs);
  for (int& variable : s.variable)
    if (variable >= 0) variable = position[variable];
  for (auto& [column, row] : pairs) std::tie(column, row) = std::minmax({position[column], position[row]});
  for (int k = 0; k < s.variables; ++k) pairs.emplace_back(k, k);
  sort_unique(pairs);

  s.column_start.assign(s.variables + 1, 0);
  s.block_row.reserve(pairs.size());
  for (const auto& [column, row] : pairs) {
    ++s.column_start[column + 1];
    s.block_row.push_back(row);
  }
  std::partial_sum(s.column_start.begin(), s.column_start.end(), s.column_start.begin());

  s.edges.reserve(graph.edges.size());
  for (const auto& edge : graph.edges) {
    EdgeSlot slot{.from = s.variable[edge.from], .to = s.variable[edge.to]};
    if (slot.from >= 0 && slot.to >= 0 && slot.from != slot.to) {
      const auto [column, row] = std::minmax(slot.from, slot.to);
      const auto begin = s.block_row.begin();
      slot.block = static_cast<int>(
          std::lower_bound(begin + s.column_start[column], begin + s.column_start[column + 1], row) - begin);
      slot.row_is_from = row == slot.from;
    }
    s.edges.push_back(slot);
  }
  return s;
}

bool is_finite(const PoseGraph& graph) {
  return std::all_of(graph.poses.begin(), graph.poses.end(), [](const Pose3& T) { return is_valid(T, 1e-3); }) &&
         std::all_of(graph.edges.begin(), graph.edges.end(), [](const PoseGraphEdge& edge) {
           return is_valid(edge.T_from_to, 1e-3) && edge.information.allFinite();
         });
}

}  // namespace tutti::estimation::internal
