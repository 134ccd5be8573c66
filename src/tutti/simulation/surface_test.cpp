// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/free_space.hpp"
#include "tutti/simulation/world.hpp"

namespace tutti::simulation {
namespace surface_test {

struct Place {
  CorridorWorld world;
  SurfaceConfig config;
  FreeSpace space{world, config, Rng(2)};
  TriangleMesh mesh = extract_surface(space, config.cell_m);
  Bvh bvh{mesh};
};

CorridorWorld small_world(const std::string& kind) {
  WorldConfig config;
  config.kind = kind;
  config.network = {.rows = 2, .columns = 2, .block_m = 18.0, .jitter_m = 2.0, .missing_share = 0.0};
  config.featureless_share = 0.3;
  config.roof_length_m = config.roof_width_m = 20.0;
  return make_world(config, Rng(1));
}

const Place& tunnel() {
  static const Place place{small_world("tunnel")};
  return place;
}

const Place& terrace() {
  static const Place place{small_world("terrace")};
  return place;
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// Edges that are not run through equally often in both directions.
std::vector<Edge> open_edges(const TriangleMesh& mesh) {
  std::map<Edge, int> balance;
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& [from, to] : {Edge{a, b}, {b, c}, {c, a}}) balance[std::minmax({from, to})] += from < to ? 1 : -1;
  std::vector<Edge> open;
  for (const auto& [edge, sum] : balance)
    if (sum != 0) open.push_back(edge);
  return open;
}

Eigen::Vector3d on_line(const Place& place, std::size_t corridor, double share) {
  const Corridor& c = place.world.corridors[corridor];
  return place.world.junctions[c.a] + share * (place.world.junctions[c.b] - place.world.junctions[c.a]);
}

std::size_t first_of(const Place& place, CorridorKind kind) {
  const auto found = std::ranges::find(place.world.corridors, kind, &Corridor::kind);
  EXPECT_NE(found, place.world.corridors.end());
  return static_cast<std::size_t>(found - place.world.corridors.begin());
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

TEST(Surface, OfATunnelIsClosed) {
  EXPECT_GT(tunnel().mesh.triangles.size(), 10000U);
  EXPECT_TRUE(open_edges(tunnel().mesh).empty());
}

TEST(Surface, OfATerraceEndsAtTheEdgeOfTheRoofOnly) {
  const Roof& roof = *terrace().space.parts().roof;
  const auto edges = open_edges(terrace().mesh);
  EXPECT_FALSE(edges.empty());
  for (const Edge& edge : edges) {
    const Eigen::Vector2d p = terrace().mesh.vertices[edge.first].head<2>().cast<double>();
    const double to_edge = std::min((p - roof.low).cwiseAbs().minCoeff(), (roof.high - p).cwiseAbs().minCoeff());
    ASSERT_LT(to_edge, 0.11 + terrace().config.cell_m) << p.transpose();  // On the parapet.
  }
}

TEST(Surface, AParapetStandsAroundTheRoof) {
  const Place& place = terrace();
  const Roof& roof = *place.space.parts().roof;
  const double height = roof.floor + 0.5 * place.config.parapet_height_m;
  const Eigen::Vector2d middle = 0.5 * (roof.low + roof.high);
  for (const Eigen::Vector2d& side : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
    const Eigen::Vector2d from = middle + side.cwiseProduct(0.5 * (roof.high - roof.low)) - 2.0 * side;
    const auto hit = place.bvh.cast(Eigen::Vector3d(from.x(), from.y(), height).cast<float>(),
                                    Eigen::Vector3d(side.x(), side.y(), 0.0).cast<float>(), 60.0F);
    ASSERT_TRUE(hit) << side.transpose();
    EXPECT_NEAR(hit->distance, 2.0 - 0.1 - place.config.cell_m, 0.25 * place.config.cell_m);
  }
}

TEST(Surface, LiesOnTheZeroSetAndFacesFreeSpace) {
  for (const Place* place : {&tunnel(), &terrace()}) {
    std::vector<double> off;
    std::size_t facing = 0;
    for (const auto& corners : place->mesh.triangles) {
      const Eigen::Vector3f& a = place->mesh.vertices[corners[0]];
      const Eigen::Vector3f& b = place->mesh.vertices[corners[1]];
      const Eigen::Vector3f& c = place->mesh.vertices[corners[2]];
      const Eigen::Vector3d middle = ((a + b + c) / 3.0F).cast<double>();
      const Eigen::Vector3d out = 0.05 * (b - a).cross(c - a).cast<double>().normalized();
      off.push_back(std::abs(place->space.value(middle)));
      facing += place->space.value(middle + out) < place->space.value(middle - out);
    }
    EXPECT_LT(quantile(off, 0.5), 0.01);
    EXPECT_LT(quantile(off, 0.95), 0.08);  // Corners are cut off within a cell.
    EXPECT_LT(quantile(off, 1.0), place->config.cell_m);
    EXPECT_GT(static_cast<double>(facing), 0.99 * static_cast<double>(off.size()));
  }
}

TEST(Surface, EveryRayInATunnelHitsItsWalls) {
  Rng rng(3);
  std::vector<double> off;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d from = on_line(tunnel(), rng.index(tunnel().world.corridors.size()), rng.uniform(0.0, 1.0));
    const Eigen::Vector3d direction = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    const auto hit = tunnel().bvh.cast(from.cast<float>(), direction.cast<float>(), 60.0F);
    ASSERT_TRUE(hit) << from.transpose() << " towards " << direction.transpose();
    ASSERT_GT(hit->distance, 0.45) << "something stands where robots walk, at " << from.transpose();
    ASSERT_LT(tunnel().bvh.normal(hit->triangle).cast<double>().dot(direction), 1e-4) << "seen from behind";
    off.push_back(std::abs(tunnel().space.value(from + hit->distance * direction)));
  }
  EXPECT_LT(quantile(off, 0.5), 0.015);
  EXPECT_LT(quantile(off, 0.95), 0.08);
}

/// Ranges into a fan of directions across a corridor.
std::vector<double> profile(const Place& place, std::size_t corridor, double share) {
  const Eigen::Vector3d from = on_line(place, corridor, share);
  const Eigen::Vector3d along = on_line(place, corridor, 1.0) - on_line(place, corridor, 0.0);
  const Eigen::Vector3d across = along.cross(Eigen::Vector3d::UnitZ()).normalized();
  std::vector<double> ranges;
  for (double angle = 0.0; angle < 6.28; angle += 0.1) {
    const Eigen::Vector3d direction = std::cos(angle) * across + std::sin(angle) * Eigen::Vector3d::UnitZ();
    const auto hit = place.bvh.cast(from.cast<float>(), direction.cast<float>(), 60.0F);
    ranges.push_back(hit ? hit->distance : 1e3);
  }
  return ranges;
}

double largest_change(const Place& place, std::size_t corridor) {
  const auto first = profile(place, corridor, 0.35);
  double largest = 0.0;
  for (double share = 0.35; share < 0.65; share += 0.01) {
    const auto here = profile(place, corridor, share);
    for (std::size_t i = 0; i < here.size(); ++i) largest = std::max(largest, std::abs(here[i] - first[i]));
  }
  return largest;
}

TEST(Surface, FeaturelessCorridorsLookTheSameAllAlong) {
  EXPECT_LT(largest_change(tunnel(), first_of(tunnel(), CorridorKind::featureless)), 0.025);
  EXPECT_GT(largest_change(tunnel(), first_of(tunnel(), CorridorKind::rough)), 0.2);
}

/// A tunnel today, and the same on a day when a fifth of its walls is gone.
struct TwoDays {
  CorridorWorld world = small_world("tunnel");
  SurfaceConfig later{.changed_share = 0.2};
  FreeSpace first{world, SurfaceConfig{}, Rng(2)}, second{world, later, Rng(2)};
};

TEST(Surface, OnAnotherDayAShareOfTheWallsIsGone) {
  const TwoDays days;
  const TriangleMesh mesh = extract_surface(days.second, days.later.cell_m);
  EXPECT_TRUE(open_edges(mesh).empty());  // there is a wall behind what is gone
  const Bvh walls(mesh);
  int same = 0, farther = 0, nearer = 0;
  Rng rng(5);
  for (int i = 0; i < 20000; ++i) {
    const std::size_t c = rng.index(days.world.corridors.size());
    const Corridor& corridor = days.world.corridors[c];
    const Eigen::Vector3d ab = days.world.junctions[corridor.b] - days.world.junctions[corridor.a];
    const double share = rng.uniform(3.0, corridor.length_m - 3.0) / corridor.length_m;
    const Eigen::Vector3f from = (days.world.junctions[corridor.a] + share * ab).cast<float>();
    const Eigen::Vector3f side =
        ((rng.bernoulli(0.5) ? 1.0 : -1.0) * Eigen::Vector3d(-ab.y(), ab.x(), 0.0).normalized()).cast<float>();
    const auto before = tunnel().bvh.cast(from, side, 60.0F), after = walls.cast(from, side, 60.0F);
    ASSERT_TRUE(before && after);
    const float moved = after->distance - before->distance;
    (std::abs(moved) < 0.1F ? same : moved > 0.0F ? farther : nearer) += 1;
  }
  EXPECT_NEAR(farther, 0.2 * 20000, 0.08 * 20000);  // and where something stood, or an alcove is
  EXPECT_GT(nearer, 0);                             // what stands elsewhere
  EXPECT_GT(same, 0.6 * 20000);
}

TEST(Surface, OnAnotherDayAlcovesStayAndOtherThingsStandElsewhere) {
  const TwoDays days;
  const SpaceParts &first = days.first.parts(), &second = days.second.parts();
  ASSERT_FALSE(first.solids.empty());
  for (const Box& solid : second.solids)
    for (const Box& before : first.solids) EXPECT_GT((solid.centre - before.centre).norm(), 0.01);
  for (const Box& alcove : first.openings)
    EXPECT_TRUE(std::ranges::any_of(second.openings, [&](const Box& box) { return box.centre == alcove.centre; }));
}

TEST(Surface, NothingIsAboveTheRoof) {
  const Place& place = terrace();
  Rng rng(4);
  const Eigen::Vector3d door = place.world.junctions[10];
  int rays = 0;
  for (int i = 0; i < 5000; ++i) {
    const std::size_t corridor = rng.index(place.world.corridors.size());
    const Eigen::Vector3d from = on_line(place, corridor, rng.uniform(0.0, 1.0));
    if (place.world.corridors[corridor].kind != CorridorKind::open || (from - door).norm() < 8.0) continue;
    const double azimuth = rng.uniform(0.0, 6.3), elevation = rng.uniform(0.55, 1.57);
    const Eigen::Vector3d up(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                             std::sin(elevation));
    EXPECT_FALSE(place.bvh.cast(from.cast<float>(), up.cast<float>(), 60.0F)) << from.transpose();
    const auto floor = place.bvh.cast(from.cast<float>(), -Eigen::Vector3f::UnitZ(), 60.0F);
    ASSERT_TRUE(floor);
    EXPECT_NEAR(floor->distance, place.config.body_height_m, 0.02);
    ++rays;
  }
  EXPECT_GT(rays, 500);
}

TEST(Surface, TheDoorToTheRoofIsOpen) {
  const Place& place = terrace();
  const Eigen::Vector3d office = place.world.junctions[4], roof = place.world.junctions[10];
  const Eigen::Vector3d ray = roof + 3.0 * (roof - office).normalized() - office;
  const auto hit = place.bvh.cast(office.cast<float>(), ray.normalized().cast<float>(), 60.0F);
  EXPECT_TRUE(!hit || hit->distance > ray.norm());
}

TEST(Surface, SameSeedSameSurface) {
  const SurfaceConfig coarse{.cell_m = 0.5};
  const TriangleMesh mesh = world_surface(tunnel().world, coarse, Rng(2));
  EXPECT_EQ(world_surface(tunnel().world, coarse, Rng(2)), mesh);
  EXPECT_NE(world_surface(tunnel().world, coarse, Rng(3)), mesh);
}

TEST(Surface, SurveyPointsAreEvenlySpread) {
  const TriangleMesh mesh{{{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {0, 2, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const PointCloud cloud = sample_surface(mesh, 0.02, Rng(5));
  EXPECT_NEAR(static_cast<double>(cloud.points.size()), 8.0 / (0.02 * 0.02), 1.0);
  int counts[4][2] = {};
  for (const Eigen::Vector3f& p : cloud.points) {
    ASSERT_EQ(p.z(), 0.0F);
    ++counts[std::clamp(static_cast<int>(p.x()), 0, 3)][std::clamp(static_cast<int>(p.y()), 0, 1)];
  }
  for (const auto& column : counts)
    for (const int count : column) EXPECT_NEAR(count, 2500, 200);  // 4 sigma
  EXPECT_EQ(sample_surface(mesh, 0.02, Rng(5)), cloud);
}

}  // namespace surface_test
}  // namespace tutti::simulation
