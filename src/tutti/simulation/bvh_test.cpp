// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/bvh.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "tutti/base/random.hpp"

namespace tutti::simulation {
namespace bvh_test {

/// Triangles of any size down to none, some of them in one plane.
TriangleMesh any_soup(std::size_t triangles, Rng& rng) {
  TriangleMesh mesh;
  const double flat = rng.bernoulli(0.3) ? 0.0 : 1.0;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const Eigen::Vector3d middle(rng.uniform(-5, 5), rng.uniform(-5, 5), flat * rng.uniform(-5, 5));
    const double size = std::pow(10.0, rng.uniform(-2.0, 0.5));
    for (int corner = 0; corner < 3; ++corner)
      mesh.vertices.push_back(
          (middle + size * Eigen::Vector3d(rng.normal(), rng.normal(), flat * rng.normal())).cast<float>());
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

struct Truth {
  double distance = std::numeric_limits<double>::infinity();
  double inside = 0.0;  ///< Smallest barycentric coordinate.
};

/// Crossing of a ray with the plane of a triangle, by solving for it in double precision.
Truth crossing(const TriangleMesh& mesh, std::size_t triangle, const Eigen::Vector3f& o, const Eigen::Vector3f& d) {
  const auto corner = [&](std::size_t i) { return mesh.vertices[mesh.triangles[triangle][i]].cast<double>(); };
  Eigen::Matrix3d columns;
  columns << corner(1) - corner(0), corner(2) - corner(0), -d.cast<double>();
  const double sine = std::abs(columns.col(0).normalized().cross(columns.col(1).normalized()).dot(d.cast<double>()));
  if (!(sine > 1e-2 * d.norm())) return {};  // Too nearly parallel or thin to decide.
  const Eigen::Vector3d x = columns.inverse() * (o.cast<double>() - corner(0));
  return {x.z(), std::min({x.x(), x.y(), 1.0 - x.x() - x.y()})};
}

Eigen::Vector3f any_direction(Rng& rng) {
  if (rng.bernoulli(0.3)) {  // Along an axis or in the plane of two: zeros of either sign.
    const auto component = [&] { return static_cast<float>(static_cast<int>(rng.index(3)) - 1) * -1.0F; };
    return {component(), component(), component()};
  }
  return Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).cast<float>();
}

RC_GTEST_PROP(Bvh, FindsWhatTryingAllTrianglesFinds, (std::uint32_t seed)) {
  Rng rng(seed);
  const TriangleMesh mesh = any_soup(*rc::gen::element<std::size_t>(0, 1, 2, 4, 5, 30, 300), rng);
  const Bvh bvh(mesh);
  RC_ASSERT(bvh.size() == mesh.triangles.size());
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3f origin(static_cast<float>(rng.uniform(-7, 7)), static_cast<float>(rng.uniform(-7, 7)),
                                 static_cast<float>(rng.uniform(-7, 7)));
    const Eigen::Vector3f direction = any_direction(rng);
    const auto range = rng.bernoulli(0.2) ? std::numeric_limits<float>::infinity()
                                          : static_cast<float>(rng.bernoulli(0.5) ? 100.0 : rng.uniform(0.0, 10.0));
    const auto hit = bvh.cast(origin, direction, range);
    double nearest = std::numeric_limits<double>::infinity();  // Among those that the ray certainly meets.
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Truth truth = crossing(mesh, t, origin, direction);
      if (truth.inside > 1e-3 && truth.distance > 1e-3 && truth.distance < range - 1e-3)
        nearest = std::min(nearest, truth.distance);
    }
    if (std::isfinite(nearest)) {
      RC_ASSERT(hit.has_value());
      RC_ASSERT(hit->distance <= nearest + 1e-3);
    }
    if (!hit) continue;
    RC_ASSERT(hit->distance > 0.0F);
    RC_ASSERT(hit->distance <= range);
    const Truth truth = crossing(mesh, hit->triangle, origin, direction);
    if (!std::isfinite(truth.distance)) continue;
    RC_ASSERT(truth.inside > -1e-3);
    RC_ASSERT(std::abs(truth.distance - hit->distance) < 1e-3);
  }
}

/// Each triangle is ten times as far and as large as the one before, which would make a tree as deep as there are
/// scales.
TEST(Bvh, FindsTrianglesOfAllScales) {
  TriangleMesh mesh;
  for (int scale = -8; scale < 8; ++scale)
    for (int twin = 0; twin < 40; ++twin) {
      const auto x = static_cast<float>(std::pow(10.0, scale)), side = 0.1F * x;
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const Eigen::Vector3f& corner :
           {Eigen::Vector3f(x, -side, -side), Eigen::Vector3f(x, side, -side), Eigen::Vector3f(x, 0, side)})
        mesh.vertices.push_back(corner * (1.0F + 0.01F * static_cast<float>(twin)));
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
  const Bvh bvh(mesh);
  for (int scale = -8; scale < 8; ++scale) {
    const auto x = static_cast<float>(std::pow(10.0, scale));
    const auto hit =
        bvh.cast({0.99F * x, 0.0F, 0.0F}, Eigen::Vector3f::UnitX(), std::numeric_limits<float>::infinity());
    ASSERT_TRUE(hit) << scale;
    EXPECT_NEAR(hit->distance, 0.01F * x, 1e-5F * x) << scale;
  }
}

TEST(Bvh, NoRaySlipsThroughSharedEdges) {
  TriangleMesh mesh;  // A bumpy sheet above z = 0.
  constexpr std::uint32_t kSide = 30;
  Rng rng(1);
  for (std::uint32_t x = 0; x <= kSide; ++x)
    for (std::uint32_t y = 0; y <= kSide; ++y)
      mesh.vertices.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(rng.uniform(1, 2)));
  for (std::uint32_t x = 0; x < kSide; ++x)
    for (std::uint32_t y = 0; y < kSide; ++y) {
      const std::uint32_t at = x * (kSide + 1) + y;
      mesh.triangles.push_back({at, at + kSide + 1, at + 1});
      mesh.triangles.push_back({at + 1, at + kSide + 1, at + kSide + 2});
    }
  const Bvh bvh(mesh);
  for (int i = 0; i < 100000; ++i) {  // Aimed at edges.
    const Eigen::Vector3f origin(15.0F, 15.0F, -20.0F);
    const auto& corners = mesh.triangles[rng.index(mesh.triangles.size())];
    const auto share = static_cast<float>(rng.uniform(0.0, 1.0));
    const Eigen::Vector3f at = share * mesh.vertices[corners[0]] + (1.0F - share) * mesh.vertices[corners[1]];
    if (at.head<2>().minCoeff() < 0.1F || at.head<2>().maxCoeff() > 29.9F) continue;
    ASSERT_TRUE(bvh.cast(origin, at - origin, 10.0F)) << at.transpose();
  }
}

TEST(Bvh, NormalIsOnTheCounterClockwiseSide) {
  const TriangleMesh mesh{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}, {0, 0, 1}}};
  const Bvh bvh(mesh);
  EXPECT_EQ(bvh.normal(0), Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(bvh.normal(1), Eigen::Vector3f(0, 0, 0));
  for (const float side : {-1.0F, 1.0F}) {
    const auto hit = bvh.cast({0.5F, 0.5F, 3.0F * side}, {0, 0, -2.0F * side}, 10.0F);
    ASSERT_TRUE(hit);
    EXPECT_FLOAT_EQ(hit->distance, 1.5F);
  }
  EXPECT_FALSE(bvh.cast({0.5F, 0.5F, 3}, {0, 0, -2}, 1.4F));
  EXPECT_FALSE(bvh.cast({0.5F, 0.5F, 3}, {0, 0, 0}, 10.0F));
  EXPECT_THROW(Bvh({{{0, 0, 0}}, {{0, 0, 1}}}), std::logic_error);
}

}  // namespace bvh_test
}  // namespace tutti::simulation
