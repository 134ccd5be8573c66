// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "tutti/base/check.hpp"
#include "tutti/simulation/free_space.hpp"

namespace tutti::simulation {
namespace {

/// Cell (and sample) coordinates of the whole grid in one key; 21 bits each.
std::uint64_t key_of(const Eigen::Vector3i& cell) {
  const auto part = [](int x) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x + (1 << 20)) & 0x1fffffU);
  };
  return part(cell.x()) << 42U | part(cell.y()) << 21U | part(cell.z());
}

/// A sign change along the grid edge from a sample to the next one along `axis`.
struct Crossing {
  Eigen::Vector3i sample;
  int axis = 0;
  bool into_rock = false;  ///< The first sample is free.
};

class SurfaceNets {
 public:
  SurfaceNets(const FreeSpace& space, double cell_m)
      : space_(space), cell_m_(cell_m), n_(static_cast<int>(std::lround(space.block_m() / cell_m))) {}

  TriangleMesh run() {
    for (const auto& [at, nearby] : space_.blocks()) add_block(Eigen::Vector3i(at[0], at[1], at[2]) * n_, nearby);
    for (const Crossing& crossing : crossings_) add_quad(crossing);
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] float& sample(int x, int y, int z) {
    return samples_[static_cast<std::size_t>((x * (n_ + 1) + y) * (n_ + 1) + z)];
  }
  [[nodiscard]] Eigen::Vector3d position(const Eigen::Vector3i& at) const { return cell_m_ * at.cast<double>(); }

  void add_block(const Eigen::Vector3i& first, const FreeSpace::Nearby& nearby) {
    samples_.resize(static_cast<std::size_t>((n_ + 1) * (n_ + 1) * (n_ + 1)));
    for (int x = 0; x <= n_; ++x)
      for (int y = 0; y <= n_; ++y)
        for (int z = 0; z <= n_; ++z)
          sample(x, y, z) = static_cast<float>(space_.value(nearby, position(first + Eigen::Vector3i(x, y, z))));
    for (int x = 0; x < n_; ++x)
      for (int y = 0; y < n_; ++y)
        for (int z = 0; z < n_; ++z) {
          const Eigen::Vector3i in_block(x, y, z);
          add_vertex(first, in_block, nearby);
          for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3i next = in_block + Eigen::Vector3i::Unit(axis);
            const bool free = sample(x, y, z) < 0.0F;
            if (free != (sample(next.x(), next.y(), next.z()) < 0.0F))
              crossings_.push_back({first + in_block, axis, free});
          }
        }
  }

  /// One vertex per cell that the surface passes: the mean of the crossings of its edges, moved onto the zero set.
  void add_vertex(const Eigen::Vector3i& first, const Eigen::Vector3i& in_block, const FreeSpace::Nearby& nearby) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (int corner = 0; corner < 8; ++corner)
      for (int axis = 0; axis < 3; ++axis) {
        if ((corner >> axis & 1) != 0) continue;
        const Eigen::Vector3i a(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const Eigen::Vector3i at = in_block + a, to = at + Eigen::Vector3i::Unit(axis);
        const float from_value = sample(at.x(), at.y(), at.z()), to_value = sample(to.x(), to.y(), to.z());
        if ((from_value < 0.0F) == (to_value < 0.0F)) continue;
        const double share = from_value / (from_value - to_value);
        sum += a.cast<double>() + share * Eigen::Vector3d::Unit(axis);
        ++count;
      }
    if (count == 0) return;
    const Eigen::Vector3i cell = first + in_block;
    const Eigen::Vector3d corner = position(cell);
    if (!space_.is_known(nearby, corner + Eigen::Vector3d::Constant(0.5 * cell_m_))) return;
    const Eigen::Vector3d vertex = settle(corner + cell_m_ * sum / count, corner, nearby);
    vertex_of_.emplace(key_of(cell), static_cast<std::uint32_t>(mesh_.vertices.size()));
    mesh_.vertices.push_back(vertex.cast<float>());
  }

  /// A Newton step along the gradient, within the cell, where it helps: at a crease it may not.
  Eigen::Vector3d settle(const Eigen::Vector3d& p, const Eigen::Vector3d& corner,
                         const FreeSpace::Nearby& nearby) const {
    const double h = 0.02 * cell_m_;
    const double value = space_.value(nearby, p);
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] = (space_.value(nearby, p + h * Eigen::Vector3d::Unit(axis)) - value) / h;
    const Eigen::Vector3d step = -value / std::max(0.5, gradient.squaredNorm()) * gradient;
    if (step.norm() > 0.3 * cell_m_) return p;
    const Eigen::Vector3d moved = (p + step).cwiseMax(corner).cwiseMin(corner + Eigen::Vector3d::Constant(cell_m_));
    return std::abs(space_.value(nearby, moved)) < std::abs(value) ? moved : p;
  }

  /// The four cells around a crossed edge, facing the free side; none where one of them is unknown.
  void add_quad(const Crossing& crossing) {
    const Eigen::Vector3i u = Eigen::Vector3i::Unit((crossing.axis + 1) % 3);
    const Eigen::Vector3i v = Eigen::Vector3i::Unit((crossing.axis + 2) % 3);
    const Eigen::Vector3i cells[] = {crossing.sample - u - v, crossing.sample - v, crossing.sample,
                                     crossing.sample - u};
    std::array<std::uint32_t, 4> quad;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto found = vertex_of_.find(key_of(cells[i]));
      if (found == vertex_of_.end()) return;
      quad[crossing.into_rock ? 3 - i : i] = found->second;
    }
    const auto error = [&](std::size_t i) {  // That of the diagonal from corner i.
      const Eigen::Vector3f middle = 0.5F * (mesh_.vertices[quad[i]] + mesh_.vertices[quad[i + 2]]);
      return std::abs(space_.value(middle.cast<double>()));
    };
    const std::size_t from = error(0) <= error(1) ? 0 : 1;
    mesh_.triangles.push_back({quad[from], quad[from + 1], quad[from + 2]});
    mesh_.triangles.push_back({quad[from], quad[from + 2], quad[(from + 3) % 4]});
  }

  const FreeSpace& space_;
  double cell_m_;
  int n_;  ///< Cells along a block.
  std::vector<float> samples_;
  std::vector<Crossing> crossings_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_of_;
  TriangleMesh mesh_;
};

}  // namespace

Status check_surface(const CorridorWorld& world, const SurfaceConfig& config) {
  constexpr double kMostCells = 1e9;
  constexpr double kAround_m = 2.0;  // alcoves, and the blocks that the walls lie in
  const double width = std::max(config.width_m, config.office_width_m) + 2.0 * kAround_m;
  const double height = std::max(kHeight_m, kOfficeHeight_m) + 2.0 * kAround_m;
  double volume = 0.0;
  Eigen::AlignedBox2d roof;
  for (const Corridor& corridor : world.corridors) {
    volume += (corridor.length_m + width) * width * height;
    if (corridor.kind != CorridorKind::open) continue;
    roof.extend(world.junctions[corridor.a].head<2>());
    roof.extend(world.junctions[corridor.b].head<2>());
  }
  if (!roof.isEmpty())
    volume += (roof.sizes().array() + 2.0 * kRoofMargin_m).prod() * (config.parapet_height_m + 2.0 * kAround_m);
  const double cells = volume / std::pow(config.cell_m, 3);
  if (cells <= kMostCells) return {};
  return fail(ErrorCode::configuration,
              "surface.cell_m is {}: the world's walls take about {:.2g} cells, expected at most {:g}; larger cells, "
              "narrower or fewer corridors take fewer",
              config.cell_m, cells, kMostCells);
}

TriangleMesh extract_surface(const FreeSpace& space, double cell_m) { return SurfaceNets(space, cell_m).run(); }

TriangleMesh world_surface(const CorridorWorld& world, const SurfaceConfig& config, Rng rng) {
  return extract_surface(FreeSpace(world, config, rng), config.cell_m);
}

PointCloud sample_surface(const TriangleMesh& mesh, double spacing_m, Rng rng) {
  TUTTI_CHECK(spacing_m > 0.0, "spacing_m = {}", spacing_m);
  PointCloud cloud;
  double due = rng.uniform(0.0, 1.0);  // Points owed to the area passed so far; systematic, so evenly spread.
  for (const auto& corners : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[corners[0]];
    const Eigen::Vector3f ab = mesh.vertices[corners[1]] - a, ac = mesh.vertices[corners[2]] - a;
    due += 0.5 * ab.cross(ac).norm() / (spacing_m * spacing_m);
    for (; due >= 1.0; due -= 1.0) {
      auto u = static_cast<float>(rng.uniform(0.0, 1.0)), v = static_cast<float>(rng.uniform(0.0, 1.0));
      if (u + v > 1.0F) u = 1.0F - u, v = 1.0F - v;
      cloud.points.push_back(a + u * ab + v * ac);
    }
  }
  return cloud;
}

}  // namespace tutti::simulation
