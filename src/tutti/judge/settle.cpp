// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/settle.hpp"

#include <algorithm>
#include <limits>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/switched_graph.hpp"

namespace tutti::judge {
namespace {

/// Closures that are too dear go at once if they cost this share of what the dearest does.
constexpr double kDearest = 0.5;
/// A closure that went so often does not come again.
constexpr int kTimesOut = 2;
/// Prices change with the map, which is settled long before.
constexpr int kRounds = 30;

}  // namespace

double most_paid(const OutlierRejectionConfig& config) { return chi_square_exceeded_with(config.right_refused, 6); }

Settled settle_closures(const PoseGraph& graph, std::size_t odometry_edges, std::vector<char> in,
                        const std::vector<bool>& certain, const OutlierRejectionConfig& config,
                        const estimation::SolverConfig& solver) {
  const std::size_t closures = in.size();
  std::vector<estimation::EdgeRole> roles(graph.edges.size(), estimation::EdgeRole::robust);
  std::fill_n(roles.begin(), odometry_edges, estimation::EdgeRole::trusted);
  estimation::SwitchedGraph switched(graph, roles, solver);
  std::vector<char> edges(graph.edges.size(), 1);
  std::vector<int> times_out(closures, 0);
  const double limit = most_paid(config);
  Settled out{.in = std::move(in), .prices = std::vector<double>(closures, std::numeric_limits<double>::infinity())};
  for (std::size_t c = 0; c < closures; ++c)
    if (certain[c]) out.in[c] = 1;
  for (int round = 0;; ++round) {
    std::ranges::copy(out.in, edges.begin() + static_cast<std::ptrdiff_t>(odometry_edges));
    out.termination = switched.solve(edges);
    if (!estimation::is_usable(out.termination)) break;
    const std::vector<double> prices = switched.prices();
    out.prices.assign(prices.begin() + static_cast<std::ptrdiff_t>(odometry_edges), prices.end());
    // A wrong closure makes its right neighbours dear, so the dearest go first, alone.
    double dearest = limit;
    for (std::size_t c = 0; c < closures; ++c)
      if (out.in[c] != 0 && !certain[c]) dearest = std::max(dearest, out.prices[c]);
    const bool any_too_dear = dearest > limit;
    bool changed = false;
    for (std::size_t c = 0; c < closures; ++c) {
      if (certain[c]) continue;
      const bool goes = out.in[c] != 0 && any_too_dear && out.prices[c] > std::max(limit, kDearest * dearest);
      const bool comes = out.in[c] == 0 && !any_too_dear && out.prices[c] <= limit && times_out[c] < kTimesOut;
      if (!goes && !comes) continue;
      times_out[c] += goes ? 1 : 0;
      out.in[c] = comes ? 1 : 0;
      changed = true;
    }
    if (!changed || round == kRounds) break;
  }
  out.poses = switched.poses();
  out.factorisations = static_cast<std::size_t>(switched.factorisations());
  return out;
}

}  // namespace tutti::judge
