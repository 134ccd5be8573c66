// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/corridor_world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

using Ends = std::pair<std::size_t, std::size_t>;

/// Per junction the first of those that corridors join it to.
std::vector<std::size_t> networks(std::size_t junctions, const std::vector<Ends>& corridors) {
  std::vector<std::vector<std::size_t>> neighbours(junctions);
  for (const auto& [a, b] : corridors) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  std::vector<std::size_t> out(junctions, junctions);  // in none yet
  for (std::size_t first = 0; first < junctions; ++first) {
    if (out[first] != junctions) continue;
    out[first] = first;
    std::vector<std::size_t> stack{first};
    while (!stack.empty()) {
      const std::size_t at = stack.back();
      stack.pop_back();
      for (const std::size_t next : neighbours[at])
        if (std::exchange(out[next], first) == junctions) stack.push_back(next);
    }
  }
  return out;
}

bool is_connected(std::size_t junctions, const std::vector<Ends>& corridors) {
  return std::ranges::all_of(networks(junctions, corridors), [](std::size_t first) { return first == 0; });
}

std::vector<Ends> grid_corridors(std::size_t rows, std::size_t columns) {
  std::vector<Ends> corridors;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t at = row * columns + column;
      if (column + 1 < columns) corridors.emplace_back(at, at + 1);
      if (row + 1 < rows) corridors.emplace_back(at, at + columns);
    }
  return corridors;
}

/// Leaves out up to `count` corridors; what remains is connected and has no dead ends.
void thin_out(std::vector<Ends>& corridors, std::size_t junctions, std::size_t count, Rng& rng) {
  std::vector<int> degree(junctions, 0);
  for (const auto& [a, b] : corridors) ++degree[a], ++degree[b];
  std::vector<Ends> order = corridors;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.index(i)]);
  for (const Ends& candidate : order) {
    if (count == 0) return;
    if (degree[candidate.first] <= 2 || degree[candidate.second] <= 2) continue;
    std::vector<Ends> rest = corridors;
    std::erase(rest, candidate);
    if (!is_connected(junctions, rest)) continue;
    corridors = std::move(rest);
    --degree[candidate.first], --degree[candidate.second];
    --count;
  }
}

/// Scales random heights so that the steepest corridor has `max_slope`.
void set_heights(std::vector<Eigen::Vector3d>& junctions, const std::vector<Ends>& corridors, double max_slope,
                 Rng& rng) {
  for (auto& junction : junctions) junction.z() = rng.uniform(-1.0, 1.0);
  double steepest = 0.0;
  for (const auto& [a, b] : corridors) {
    const Eigen::Vector3d d = junctions[b] - junctions[a];
    steepest = std::max(steepest, std::abs(d.z()) / d.head<2>().norm());
  }
  for (auto& junction : junctions) junction.z() *= max_slope / steepest;
}

}  // namespace

CorridorWorld make_corridor_world(const CorridorWorldConfig& config, Rng rng) {
  TUTTI_CHECK(config.rows >= 2 && config.columns >= 2, "{} x {}", config.rows, config.columns);
  const auto rows = static_cast<std::size_t>(config.rows);
  const auto columns = static_cast<std::size_t>(config.columns);
  // A quarter block at most: corridors of neighbouring rows then cannot cross.
  const double jitter = std::min(config.jitter_m, 0.25 * config.block_m);

  CorridorWorld world;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column) {
      const double x = static_cast<double>(column) * config.block_m + rng.uniform(-jitter, jitter);
      const double y = static_cast<double>(row) * config.block_m + rng.uniform(-jitter, jitter);
      world.junctions.emplace_back(x, y, 0.0);
    }
  std::vector<Ends> corridors = grid_corridors(rows, columns);
  const auto missing = static_cast<std::size_t>(config.missing_share * static_cast<double>(corridors.size()));
  thin_out(corridors, world.junctions.size(), missing, rng);
  set_heights(world.junctions, corridors, config.max_slope, rng);

  world.corridors_at.resize(world.junctions.size());
  for (const auto& [a, b] : corridors) {
    world.corridors_at[a].push_back(world.corridors.size());
    world.corridors_at[b].push_back(world.corridors.size());
    world.corridors.push_back({a, b, (world.junctions[b] - world.junctions[a]).norm()});
  }
  return world;
}

std::vector<std::size_t> networks_of(const CorridorWorld& world) {
  std::vector<Ends> corridors;
  for (const Corridor& corridor : world.corridors) corridors.emplace_back(corridor.a, corridor.b);
  return networks(world.junctions.size(), corridors);
}

std::vector<std::size_t> spread_starts(const CorridorWorld& world, std::size_t count, Rng rng) {
  const std::vector<std::size_t> network = networks_of(world);
  std::vector<std::size_t> starts;
  std::vector<double> distance(world.junctions.size(), std::numeric_limits<double>::infinity());
  std::vector<std::ptrdiff_t> in_network(world.junctions.size(), 0);  // starts, by network
  const auto merit = [&](std::size_t i) { return std::pair(-in_network[network[i]], distance[i]); };
  const auto all = std::views::iota(std::size_t{0}, world.junctions.size());
  while (starts.size() < count) {
    const std::size_t next =
        starts.empty() ? rng.index(world.junctions.size()) : *std::ranges::max_element(all, {}, merit);
    starts.push_back(next);
    ++in_network[network[next]];
    for (std::size_t i = 0; i < distance.size(); ++i)
      distance[i] = std::min(distance[i], (world.junctions[i] - world.junctions[next]).norm());
  }
  return starts;
}

}  // namespace tutti::simulation
