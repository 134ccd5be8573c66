// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/world.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

constexpr double kJunctionSpacing = 10.0;  ///< Along both loops of the terrace.
constexpr double kJunctionJitter = 1.5;    ///< Along the office's corridors: no two are alike.

void join(CorridorWorld& world, std::size_t a, std::size_t b, CorridorKind kind) {
  if (a > b) std::swap(a, b);
  world.corridors_at.resize(world.junctions.size());
  world.corridors_at[a].push_back(world.corridors.size());
  world.corridors_at[b].push_back(world.corridors.size());
  world.corridors.push_back({a, b, (world.junctions[b] - world.junctions[a]).norm(), kind});
}

std::size_t segments(double length) {
  return static_cast<std::size_t>(std::max(1L, std::lround(length / kJunctionSpacing)));
}

/// Junctions from `from` to just before `to`, evenly spaced but for the jitter.
void add_side(CorridorWorld& world, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double jitter, Rng& rng) {
  const double length = (to - from).norm();
  const std::size_t count = segments(length);
  for (std::size_t i = 0; i < count; ++i) {
    const double moved = i == 0 ? 0.0 : rng.uniform(-jitter, jitter);
    world.junctions.push_back(from +
                              (static_cast<double>(i) / static_cast<double>(count) + moved / length) * (to - from));
  }
}

/// Joins the junctions from `first` on to a loop.
void close_loop(CorridorWorld& world, std::size_t first, CorridorKind kind) {
  for (std::size_t i = first; i + 1 < world.junctions.size(); ++i) join(world, i, i + 1, kind);
  join(world, first, world.junctions.size() - 1, kind);
}

std::optional<std::size_t> corridor_between(const CorridorWorld& world, int a, int b) {
  const auto [low, high] = std::minmax({static_cast<std::size_t>(a), static_cast<std::size_t>(b)});
  for (std::size_t i = 0; i < world.corridors.size(); ++i)
    if (world.corridors[i].a == low && world.corridors[i].b == high) return i;
  return std::nullopt;
}

CorridorWorld make_tunnel(const WorldConfig& config, Rng rng) {
  CorridorWorld world = make_corridor_world(config.network, rng.fork("network"));
  std::vector<std::size_t> order(world.corridors.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return world.corridors[i].length_m; });
  const auto count =
      static_cast<std::size_t>(std::lround(config.featureless_share * static_cast<double>(order.size())));
  for (std::size_t i = 0; i < count; ++i) world.corridors[order[i]].kind = CorridorKind::featureless;
  for (std::size_t i = 0; i + 1 < config.featureless.size(); i += 2)
    if (const auto named = corridor_between(world, config.featureless[i], config.featureless[i + 1]))
      world.corridors[*named].kind = CorridorKind::featureless;
  return world;
}

CorridorWorld make_storeys(const WorldConfig& config, Rng rng) {
  CorridorWorld world;
  for (const std::uint64_t storey : {0U, 1U}) {
    const CorridorWorld one = make_tunnel(config, rng.fork(storey));
    const std::size_t before = world.junctions.size();
    for (const Eigen::Vector3d& junction : one.junctions)
      world.junctions.emplace_back(junction + Eigen::Vector3d(0.0, 0.0, kStorey_m * static_cast<double>(storey)));
    for (const Corridor& corridor : one.corridors) join(world, before + corridor.a, before + corridor.b, corridor.kind);
  }
  return world;
}

CorridorWorld make_terrace(const WorldConfig& config, Rng rng) {
  CorridorWorld world;
  const double length = config.office_length_m, width = config.office_width_m;
  const std::size_t along = segments(length), across = segments(width);
  const Eigen::Vector3d corners[] = {{0, 0, 0}, {length, 0, 0}, {length, width, 0}, {0, width, 0}};
  for (std::size_t side = 0; side < 4; ++side)
    add_side(world, corners[side], corners[(side + 1) % 4], kJunctionJitter, rng);
  close_loop(world, 0, CorridorKind::office);
  if (along >= 2) join(world, along / 2, 2 * along + across - along / 2, CorridorKind::office);

  const std::size_t ramp = along + across / 2;
  const std::size_t door = world.junctions.size();
  const Eigen::Vector3d entry = world.junctions[ramp] + Eigen::Vector3d(config.ramp_length_m, 0, config.ramp_rise_m);
  const double x = config.roof_length_m, y = 0.5 * config.roof_width_m;
  world.junctions.push_back(entry);
  add_side(world, entry + Eigen::Vector3d(0, -y, 0), entry + Eigen::Vector3d(x, -y, 0), 0.0, rng);
  add_side(world, entry + Eigen::Vector3d(x, -y, 0), entry + Eigen::Vector3d(x, y, 0), 0.0, rng);
  add_side(world, entry + Eigen::Vector3d(x, y, 0), entry + Eigen::Vector3d(0, y, 0), 0.0, rng);
  world.junctions.push_back(entry + Eigen::Vector3d(0, y, 0));
  close_loop(world, door, CorridorKind::open);
  join(world, ramp, door, CorridorKind::office);
  return world;
}

}  // namespace

const std::vector<WorldKind>& world_kinds() {
  static const std::vector<WorldKind> rows{
      {"tunnel", "a network of rough corridors", &make_tunnel},
      {"storeys", "two tunnels, one above the other, which nothing joins", &make_storeys},
      {"terrace", "an office loop and a rooftop with almost nothing to see", &make_terrace},
  };
  return rows;
}

CorridorWorld make_world(const WorldConfig& config, Rng rng) {
  const WorldKind* kind = row_of(world_kinds(), config.kind);
  TUTTI_CHECK(kind != nullptr, "world.kind is {}", config.kind);
  return kind->make(config, std::move(rng));
}

Status check_world(const CorridorWorld& world, const WorldConfig& config) {
  const std::vector<int>& named = config.featureless;
  if (named.size() % 2 != 0)
    return fail(ErrorCode::configuration, "world.featureless: {} junctions, expected an even number", named.size());
  for (std::size_t i = 0; i < named.size(); i += 2)
    if (!corridor_between(world, named[i], named[i + 1]))
      return fail(ErrorCode::configuration, "world.featureless: no corridor joins junctions {} and {}", named[i],
                  named[i + 1]);
  return {};
}

std::optional<std::size_t> corridor_at(const CorridorWorld& world, const Eigen::Vector3d& position,
                                       double max_distance_m) {
  std::optional<std::size_t> nearest;
  double least = max_distance_m;
  for (std::size_t i = 0; i < world.corridors.size(); ++i) {
    const Eigen::Vector3d& a = world.junctions[world.corridors[i].a];
    const Eigen::Vector3d along = world.junctions[world.corridors[i].b] - a;
    const double share = std::clamp((position - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const double distance = (position - a - share * along).norm();
    if (distance > least || (nearest && distance == least)) continue;
    least = distance;
    nearest = i;
  }
  return nearest;
}

}  // namespace tutti::simulation
