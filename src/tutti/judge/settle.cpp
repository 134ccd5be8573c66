// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/settle.hpp"

#include <algorithm>
#include <cstddef>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/edge_roles.hpp"
#include "tutti/estimation/switched_graph.hpp"

namespace tutti::judge {
namespace {

/// A closure that went so often does not come again.
constexpr int kTimesOut = 2;
/// A closure of a small map is judged by what it may cost in one of so many: a drive's only loop tells as much of its
/// odometry as of itself, and odometry misses more than it states more often than chance makes it.
constexpr std::size_t kLeastAsked = 100;
/// Prices change with the map, which is settled long before.
constexpr int kRounds = 30;

/// Which closures are in next, by their prices.
std::vector<char> next_round(const Settled& now, const std::vector<bool>& certain, double limit,
                             std::vector<int>& times_out) {
  // Right neighbours of a wrong closure may go with it, and come again without it.
  const auto is_too_dear = [&](std::size_t c) { return now.in[c] != 0 && !certain[c] && now.prices[c].paid > limit; };
  std::vector<char> next = now.in;
  bool any_goes = false;
  for (std::size_t c = 0; c < next.size(); ++c) {
    if (!is_too_dear(c)) continue;
    any_goes = true;
    next[c] = 0;
    ++times_out[c];
  }
  if (any_goes) return next;
  for (std::size_t c = 0; c < next.size(); ++c)
    if (next[c] == 0 && !certain[c] && now.prices[c].paid <= limit && times_out[c] < kTimesOut) next[c] = 1;
  return next;
}

}  // namespace

double most_paid(const OutlierRejectionConfig& config, std::size_t asked) {
  return chi_square_exceeded_with(config.right_refused / static_cast<double>(std::max<std::size_t>(asked, 1)), 6);
}

double most_paid_for_closure(const OutlierRejectionConfig& config, std::size_t closures) {
  return most_paid(config, std::max(closures, kLeastAsked));
}

Settled settle_closures(const PoseGraph& graph, std::size_t odometry_edges, std::vector<char> in,
                        const std::vector<bool>& certain, const OutlierRejectionConfig& config,
                        const estimation::SolverConfig& solver) {
  const std::size_t closures = in.size();
  const std::vector<estimation::EdgeRole> roles = estimation::roles_of(graph, odometry_edges);
  estimation::SwitchedGraph switched(graph, roles, solver);
  std::vector<char> edges(graph.edges.size(), 1);
  std::vector<int> times_out(closures, 0);
  const double limit = most_paid_for_closure(config, closures);
  Settled out{.in = std::move(in), .prices = std::vector<Price>(closures, Price{.most = limit})};
  for (std::size_t c = 0; c < closures; ++c)
    if (certain[c]) out.in[c] = 1;
  for (int round = 0;; ++round) {
    std::ranges::copy(out.in, edges.begin() + static_cast<std::ptrdiff_t>(odometry_edges));
    out.termination = switched.solve(edges);
    if (!estimation::is_usable(out.termination)) break;
    const std::vector<double> prices = switched.prices();
    if (prices.empty()) out.termination = estimation::Termination::singular;
    if (prices.empty()) break;
    for (std::size_t c = 0; c < closures; ++c) out.prices[c].paid = prices[odometry_edges + c];
    if (round == kRounds) break;
    std::vector<char> next = next_round(out, certain, limit, times_out);
    // Closures that have come and gone may have led the poses into a basin of their own.
    if (next == out.in && !switched.improve_from_measurements()) break;
    out.in = std::move(next);
  }
  out.poses = switched.poses();
  out.factorisations = static_cast<std::size_t>(switched.factorisations());
  return out;
}

}  // namespace tutti::judge
