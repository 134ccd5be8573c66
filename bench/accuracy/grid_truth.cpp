// SPDX-License-Identifier: BSD-3-Clause
// A map to drive on against the simulated world in which it was made: docs/results/grid.md.
// usage: tutti_grid_truth MISSION.yaml MAP [SEED]
#include "tutti/lab/grid_truth.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

using namespace tutti;
using grids::OccupancyGrid, lab::TrueCell;

constexpr double kNear_m = 3.0;

Status print_rows(const std::string& mission_file, const std::string& map_file, std::uint64_t seed) {
  const auto mission = lab::load_mission(mission_file, {});
  if (!mission) return tl::unexpected(mission.error());
  const auto map = mapfile::open(map_file);
  if (!map) return tl::unexpected(map.error());
  const auto content = mapfile::read(**map);
  if (!content) return tl::unexpected(content.error());
  const server::MapEstimate estimate = mapfile::estimate(*content);
  fmt::print(
      "| cells of | said | cells | free | surface | rock | within a cell of a surface "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const double resolution_m : {0.05, 0.1, 0.2}) {
    grids::MapGridConfig config;
    config.grid.resolution_m = resolution_m;
    const auto made = grids::grid_of_map(**map, *content, estimate, config);
    if (!made) return tl::unexpected(made.error());
    const auto score =
        lab::score_grid(*made, config.grid, estimate, *mission, seed, kNear_m, resolution_m < 0.1 ? 2 : 1);
    if (!score) return tl::unexpected(score.error());
    for (const auto& [state, name] :
         {std::pair{OccupancyGrid::free, "free"}, std::pair{OccupancyGrid::occupied, "occupied"},
          std::pair{OccupancyGrid::unknown, "unknown"}}) {
      const std::size_t free = score->of(state, TrueCell::free), surface = score->of(state, TrueCell::surface),
                        rock = score->of(state, TrueCell::rock), all = free + surface + rock;
      const auto share = [&](std::size_t count) {
        return fmt::format("{:.1f} %", all > 0 ? 100.0 * static_cast<double>(count) / static_cast<double>(all) : 0.0);
      };
      fmt::print("| {} m | {} | {} | {} | {} | {} | {} |\n", resolution_m, name, all, share(free), share(surface),
                 share(rock), state == OccupancyGrid::occupied ? share(score->occupied_near_surface) : "");
    }
    std::fflush(stdout);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    fmt::print(stderr, "usage: tutti_grid_truth MISSION.yaml MAP [SEED]\n");
    return 2;
  }
  const auto done = print_rows(argv[1], argv[2], argc == 4 ? std::strtoull(argv[3], nullptr, 10) : 1);
  if (!done) fmt::print(stderr, "{}\n", done.error().message);
  return done ? 0 : 1;
}
