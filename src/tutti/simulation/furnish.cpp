// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "tutti/simulation/free_space.hpp"
#include "tutti/simulation/world.hpp"

namespace tutti::simulation {
namespace {

constexpr double kRoughness_m = 0.15;       ///< Rough walls stray from smooth by about this at most,
constexpr double kWidthVariation = 0.2;     ///< and their corridors widen and narrow by up to this share.
constexpr double kAlcovesPer100m = 8.0;     ///< Dug into the walls of rough corridors,
constexpr double kObstaclesPer100m = 8.0;   ///< and standing at them.
constexpr double kFurniturePer100m = 10.0;  ///< Office: cupboards and pillars at the walls.
constexpr double kAtJunction = 3.0;         ///< Nothing stands this near to a junction, where robots cut corners.
constexpr double kClearance = 1.0;          ///< Around the lines that robots walk along (offices: 0.75).
constexpr double kIntoWall = 0.6;           ///< How far things reach into the wall they stand at.
constexpr double kGoneSection_m = 2.0;      ///< Length of a section of wall that is gone,
constexpr double kBehindWall_m = 2.0;       ///< and depth of the space behind it.
constexpr double kStairhouseIn = 2.0;       ///< The door's house, inside the roof's edge.
constexpr double kStairhouseOut = 1.5;      ///< And beyond it, so that sky and rock never meet.

/// A corridor as furniture sees it.
struct Aisle {
  Eigen::Vector3d start;  ///< Floor.
  Eigen::Vector2d along;
  double length = 0.0;  ///< Horizontal.
  double slope = 0.0;
  double half_width = 0.0;
};

/// From `near_u` to `far_u` beyond the middle line (side -1 or 1), from the floor up to `height`.
Box box_at(const Aisle& aisle, double s, double half_length, double side, double near_u, double far_u, double height,
           double roughness) {
  const Eigen::Vector2d left(-aisle.along.y(), aisle.along.x());
  const Eigen::Vector2d xy = aisle.start.head<2>() + s * aisle.along + side * 0.5 * (near_u + far_u) * left;
  const double floor = aisle.start.z() + s * aisle.slope;
  return {{xy.x(), xy.y(), floor + 0.5 * height},
          aisle.along,
          {half_length, 0.5 * (far_u - near_u), 0.5 * height},
          roughness};
}

/// Places along an aisle, irregular, none near its ends.
std::vector<double> places(const Aisle& aisle, double per_100m, Rng& rng) {
  const double free = aisle.length - 2.0 * kAtJunction;
  if (free <= 0.0) return {};
  std::vector<double> out(static_cast<std::size_t>(0.01 * per_100m * aisle.length + rng.uniform(0.0, 1.0)));
  for (double& s : out) s = kAtJunction + rng.uniform(0.0, free);
  return out;
}

double either_side(Rng& rng) { return rng.bernoulli(0.5) ? 1.0 : -1.0; }

/// `on_another_day`: what stands at the walls stands elsewhere; the walls with their alcoves are the same.
void furnish_tunnel(const Aisle& aisle, bool on_another_day, SpaceParts& parts, Rng rng) {
  for (const double s : places(aisle, kAlcovesPer100m, rng)) {
    const double depth = rng.uniform(0.6, 1.6);
    const double height = rng.uniform(1.4, 2.3);
    const double side = either_side(rng);
    parts.openings.push_back(box_at(aisle, s, rng.uniform(0.5, 1.5), side, aisle.half_width - 0.6,
                                    aisle.half_width + depth, height, kRoughness_m));
  }
  if (on_another_day) rng = rng.fork("another day");
  for (const double s : places(aisle, kObstaclesPer100m, rng)) {
    const double front = std::max(kClearance, aisle.half_width - rng.uniform(0.2, 0.5)) + kRoughness_m;
    const double height = rng.bernoulli(0.3) ? kHeight_m + 1.0 : rng.uniform(0.4, 1.8);
    const double side = either_side(rng);
    parts.solids.push_back(
        box_at(aisle, s, rng.uniform(0.2, 0.7), side, front, aisle.half_width + kIntoWall, height, kRoughness_m));
  }
}

/// Takes this share of both walls away, in sections.
void open_walls(const Aisle& aisle, double share, SpaceParts& parts, Rng rng) {
  const double half = 0.5 * kGoneSection_m;
  for (const double side : {-1.0, 1.0})
    for (double s = kAtJunction + half; s + half <= aisle.length - kAtJunction; s += kGoneSection_m)
      if (rng.bernoulli(share))
        parts.openings.push_back(
            box_at(aisle, s, half, side, aisle.half_width - 0.6, aisle.half_width + kBehindWall_m, kHeight_m, 0.0));
}

/// A room may not break into another corridor, nor reach under the open sky.
bool has_space(const Box& room, const CorridorWorld& world, std::size_t own, double half_width) {
  const double reach = room.half.head<2>().norm() + half_width + 0.4;
  for (std::size_t i = 0; i < world.corridors.size(); ++i) {
    if (i == own) continue;
    const Corridor& corridor = world.corridors[i];
    const Eigen::Vector2d a = world.junctions[corridor.a].head<2>();
    const Eigen::Vector2d ab = world.junctions[corridor.b].head<2>() - a;
    const double share = std::clamp((room.centre.head<2>() - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    if ((room.centre.head<2>() - a - share * ab).norm() < reach) return false;
  }
  return true;
}

void furnish_office(const CorridorWorld& world, std::size_t corridor, const Aisle& aisle, const SurfaceConfig& config,
                    SpaceParts& parts, Rng rng) {
  for (const double s : places(aisle, config.doors_per_100m, rng)) {
    const double side = either_side(rng), wall = aisle.half_width;
    const bool open = rng.bernoulli(1.0 / 3.0);
    const double depth = rng.uniform(0.12, 0.3);
    const double room_depth = rng.uniform(2.8, 4.5);
    const double room_width = rng.uniform(1.4, 2.2);
    const Box room = box_at(aisle, s + rng.uniform(-0.8, 0.8), room_width, side, wall + 0.35, wall + room_depth,
                            kOfficeHeight_m - 0.1, 0.0);
    const Box table = box_at(aisle, s + rng.uniform(-0.8, 0.8), 0.6, side, wall + 1.8, wall + 2.5, 0.75, 0.0);
    const bool has_room = open && has_space(room, world, corridor, wall);
    parts.openings.push_back(box_at(aisle, s, 0.5, side, wall - 0.5, wall + (has_room ? 0.6 : depth), 2.1, 0.0));
    if (!has_room) continue;
    parts.openings.push_back(room);
    parts.solids.push_back(table);
  }
  for (const double s : places(aisle, kFurniturePer100m, rng)) {
    const double front = aisle.half_width - rng.uniform(0.25, 0.45);
    const bool pillar = rng.bernoulli(0.3);
    const double height = pillar ? kOfficeHeight_m + 1.0 : rng.uniform(0.8, 2.0);
    const double side = either_side(rng);
    const double width = pillar ? 0.2 : rng.uniform(0.4, 0.8);
    parts.solids.push_back(box_at(aisle, s, width, side, front, aisle.half_width + kIntoWall, height, 0.0));
  }
}

Passage passage_of(CorridorKind kind, const SurfaceConfig& config, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (kind == CorridorKind::office) return {a, b, 0.5 * config.office_width_m, kOfficeHeight_m, 0.0, 0.0, 0.0, 0.0};
  Passage passage{a, b, 0.5 * config.width_m, kHeight_m, 1.2, 0.8, 0.0, 0.0};
  if (kind == CorridorKind::rough) {
    passage.bottom_radius = 0.4;
    passage.roughness = kRoughness_m;
    passage.variation = kWidthVariation;
  }
  return passage;
}

/// The house around the door through which `corridor` comes out onto the roof.
Box stairhouse(const Passage& corridor, const Roof& roof, bool comes_out_at_b) {
  const Eigen::Vector2d end = (comes_out_at_b ? corridor.b : corridor.a).head<2>();
  const Eigen::Vector2d in = (end - (comes_out_at_b ? corridor.a : corridor.b).head<2>()).normalized();
  double to_edge = std::numeric_limits<double>::infinity();  // From `end` back along the corridor.
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(in[axis]) < 1e-9) continue;
    to_edge = std::min(to_edge, (end[axis] - (in[axis] > 0.0 ? roof.low : roof.high)[axis]) / in[axis]);
  }
  const Eigen::Vector2d xy = end - in * (to_edge - 0.5 * (kStairhouseIn - kStairhouseOut));
  const double height = corridor.height + 1.0;
  return {{xy.x(), xy.y(), roof.floor + 0.5 * height - 0.5},
          in,
          {0.5 * (kStairhouseIn + kStairhouseOut), corridor.half_width + 1.0, 0.5 * height + 0.5},
          0.0};
}

void add_chimneys(const CorridorWorld& world, const SurfaceConfig& config, Roof& roof, Rng rng) {
  const std::size_t wanted = roof.solids.size() + static_cast<std::size_t>(config.chimneys);
  for (int tries = 0; tries < 1000 && roof.solids.size() < wanted; ++tries) {
    const double y = rng.uniform(roof.low.y() + 1.0, roof.high.y() - 1.0);
    const double x = rng.uniform(roof.low.x() + 1.0, roof.high.x() - 1.0);
    const Eigen::Vector3d at(x, y, roof.floor + config.body_height_m);
    if (corridor_at(world, at, 2.5)) continue;
    const double angle = rng.uniform(0.0, 1.5), height = rng.uniform(0.8, 1.6);
    roof.solids.push_back({{at.x(), at.y(), roof.floor + 0.5 * height - 0.25},
                           {std::cos(angle), std::sin(angle)},
                           {rng.uniform(0.25, 0.5), rng.uniform(0.25, 0.5), 0.5 * height + 0.25},
                           0.0});
  }
}

void add_parapet(const SurfaceConfig& config, Roof& roof) {
  const Eigen::Vector2d middle = 0.5 * (roof.low + roof.high), half = 0.5 * (roof.high - roof.low);
  const double z = roof.floor + 0.5 * config.parapet_height_m - 0.25, half_z = 0.5 * config.parapet_height_m + 0.25;
  const double half_width = 0.1 + config.cell_m;  // The mesh ends within a cell of the roof's edge: not on this side.
  for (const double sign : {-1.0, 1.0}) {
    roof.solids.push_back({{middle.x() + sign * half.x(), middle.y(), z},
                           Eigen::Vector2d::UnitX(),
                           {half_width, half.y() + half_width, half_z}});
    roof.solids.push_back({{middle.x(), middle.y() + sign * half.y(), z},
                           Eigen::Vector2d::UnitX(),
                           {half.x() + half_width, half_width, half_z}});
  }
}

/// Floor of all open corridors at the height of the lowest: they are meant to be level.
std::optional<Roof> roof_of(const CorridorWorld& world, const SurfaceConfig& config) {
  Eigen::AlignedBox3d bounds;
  for (const Corridor& corridor : world.corridors) {
    if (corridor.kind != CorridorKind::open) continue;
    bounds.extend(world.junctions[corridor.a]);
    bounds.extend(world.junctions[corridor.b]);
  }
  if (bounds.isEmpty()) return std::nullopt;
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(kRoofMargin_m);
  Roof roof{
      bounds.min().head<2>() - margin, bounds.max().head<2>() + margin, bounds.min().z() - config.body_height_m, {}};
  add_parapet(config, roof);
  return roof;
}

}  // namespace

SpaceParts furnish(const CorridorWorld& world, const SurfaceConfig& config, Rng rng) {
  const Eigen::Vector3d down(0.0, 0.0, -config.body_height_m);
  SpaceParts parts;
  parts.roof = roof_of(world, config);
  std::vector<std::optional<Passage>> chambers(world.junctions.size());
  std::vector<bool> is_open(world.junctions.size(), false);
  for (const Corridor& corridor : world.corridors)
    if (corridor.kind == CorridorKind::open) is_open[corridor.a] = is_open[corridor.b] = true;
  for (std::size_t i = 0; i < world.corridors.size(); ++i) {
    const Corridor& corridor = world.corridors[i];
    if (corridor.kind == CorridorKind::open) continue;
    const Passage passage =
        passage_of(corridor.kind, config, world.junctions[corridor.a] + down, world.junctions[corridor.b] + down);
    parts.passages.push_back(passage);
    const Eigen::Vector3d ab = passage.b - passage.a;
    const double length = ab.head<2>().norm();
    const Aisle aisle{passage.a, ab.head<2>() / length, length, ab.z() / length, passage.half_width};
    if (corridor.kind == CorridorKind::office)
      furnish_office(world, i, aisle, config, parts, rng.fork(i));
    else
      open_walls(aisle, config.changed_share, parts, rng.fork("gone").fork(i));
    if (corridor.kind == CorridorKind::rough) furnish_tunnel(aisle, config.changed_share > 0.0, parts, rng.fork(i));
    for (const std::size_t end : {corridor.a, corridor.b}) {
      const Eigen::Vector3d at = world.junctions[end] + down;
      if (is_open[end]) {
        parts.roof->solids.push_back(stairhouse(passage, *parts.roof, end == corridor.b));
      } else if (corridor.kind != CorridorKind::office) {
        chambers[end] = passage_of(CorridorKind::rough, config, at, at);
      } else if (world.corridors_at[end].size() == 2) {  // Corners of an office are not round.
        const Eigen::Vector3d up(0.0, 0.0, 0.5 * passage.height);
        parts.openings.push_back({at + up, aisle.along, {passage.half_width, passage.half_width, up.z()}, 0.0});
      }
    }
  }
  for (std::size_t i = 0; i < chambers.size(); ++i) {
    if (!chambers[i]) continue;
    chambers[i]->half_width *= rng.fork("chamber").fork(i).uniform(1.2, 1.5);
    parts.passages.push_back(*chambers[i]);
  }
  if (parts.roof) add_chimneys(world, config, *parts.roof, rng.fork("chimneys"));
  return parts;
}

}  // namespace tutti::simulation
