// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/free_space.hpp"

#include <algorithm>
#include <cmath>

namespace tutti::simulation {
namespace {

constexpr double kSolid = 1.0;  ///< Value in rock far from everything.
constexpr double kReach = 0.8;  ///< Parts matter this far outside of themselves.
constexpr int kCellsPerBlock = 8;
constexpr double kRoughnessLength_m = 1.0;   ///< Between bumps of rough walls.
constexpr double kVariationLength_m = 12.0;  ///< How far apart wide places are.

double gradient_dot(std::uint32_t hash, double x, double y, double z) {
  // The twelve directions to the middles of a cube's edges, four of them twice (Perlin, "Improving Noise", 2002).
  const std::uint32_t h = hash & 15U;
  const double u = h < 8U ? x : y;
  const double v = h < 4U ? y : (h == 12U || h == 14U ? x : z);
  return ((h & 1U) != 0U ? -u : u) + ((h & 2U) != 0U ? -v : v);
}

std::uint32_t lattice_hash(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed ^ (static_cast<std::uint32_t>(x) * 0x8da6b343U) ^
                    (static_cast<std::uint32_t>(y) * 0xd8163841U) ^ (static_cast<std::uint32_t>(z) * 0xcb1ab31fU);
  h = (h ^ (h >> 16U)) * 0x7feb352dU;  // Finaliser "lowbias32" (Wellons, "Prospecting for Hash Functions", 2018).
  h = (h ^ (h >> 15U)) * 0x846ca68bU;
  return h ^ (h >> 16U);
}

/// Gradient noise with bumps about 1 apart, within +-1.
double noise(double x, double y, double z, std::uint32_t seed) {
  const double at[3] = {x, y, z};
  int cell[3];
  double f[3], fade[3];
  for (int i = 0; i < 3; ++i) {
    const double low = std::floor(at[i]);
    cell[i] = static_cast<int>(low);
    f[i] = at[i] - low;
    fade[i] = f[i] * f[i] * f[i] * (f[i] * (f[i] * 6.0 - 15.0) + 10.0);
  }
  double plane[2];
  for (int k = 0; k < 2; ++k) {
    double row[2];
    for (int j = 0; j < 2; ++j) {
      const double left = gradient_dot(lattice_hash(cell[0], cell[1] + j, cell[2] + k, seed), f[0], f[1] - j, f[2] - k);
      const double right =
          gradient_dot(lattice_hash(cell[0] + 1, cell[1] + j, cell[2] + k, seed), f[0] - 1.0, f[1] - j, f[2] - k);
      row[j] = std::lerp(left, right, fade[0]);
    }
    plane[k] = std::lerp(row[0], row[1], fade[1]);
  }
  return std::lerp(plane[0], plane[1], fade[2]);
}

/// Signed distance to a rectangle |x| <= half_x, |y| <= half_y with rounded corners.
double rounded_rectangle(double x, double y, double half_x, double half_y, double radius) {
  const double dx = std::abs(x) - half_x + radius;
  const double dy = std::abs(y) - half_y + radius;
  return Eigen::Vector2d(std::max(dx, 0.0), std::max(dy, 0.0)).norm() + std::min(std::max(dx, dy), 0.0) - radius;
}

bool within(const Roof& roof, const Eigen::Vector3d& p, double margin) {
  const Eigen::Array2d xy = p.head<2>().array();
  return (xy >= roof.low.array() + margin).all() && (xy <= roof.high.array() - margin).all();
}

}  // namespace

FreeSpace::FreeSpace(const CorridorWorld& world, const SurfaceConfig& config, Rng rng)
    : parts_(furnish(world, config, rng.fork("furnish"))),
      block_m_(kCellsPerBlock * config.cell_m),
      cell_m_(config.cell_m),
      seed_(static_cast<std::uint32_t>(rng.fork("noise").index(1ULL << 32U))) {
  index_parts();
}

double FreeSpace::bumps(const Eigen::Vector3d& p) const {
  const double coarse = 1.0 / kRoughnessLength_m, fine = 2.7 * coarse;
  return noise(p.x() * coarse, p.y() * coarse, p.z() * coarse, seed_) +
         0.4 * noise(p.x() * fine, p.y() * fine, p.z() * fine, seed_ + 1U);
}

double FreeSpace::passage(const Passage& passage, const Eigen::Vector3d& p) const {
  const Eigen::Vector2d along = (passage.b - passage.a).head<2>();
  const Eigen::Vector2d from_a = (p - passage.a).head<2>();
  const double squared = along.squaredNorm();
  const double share = squared > 0.0 ? std::clamp(from_a.dot(along) / squared, 0.0, 1.0) : 0.0;
  const double across = (from_a - share * along).norm();
  const double above = p.z() - std::lerp(passage.a.z(), passage.b.z(), share);
  double half_width = passage.half_width, height = passage.height;
  if (passage.variation > 0.0) {
    // Both walls and the roof on their own; the two walls meet where the sign of `side` changes, inside the corridor.
    const bool left = along.x() * from_a.y() - along.y() * from_a.x() > 0.0;
    const Eigen::Vector2d at = (passage.a.head<2>() + share * along) / kVariationLength_m;
    half_width *= 1.0 + 1.3 * passage.variation * noise(at.x(), at.y(), left ? 0.3 : 7.3, seed_ + 2U);
    height *= 1.0 + 0.8 * passage.variation * noise(at.x(), at.y(), 13.3, seed_ + 2U);
  }
  const double radius = above > 0.5 * height ? passage.top_radius : passage.bottom_radius;
  const double smooth = rounded_rectangle(across, above - 0.5 * height, half_width, 0.5 * height,
                                          std::min({radius, half_width, 0.5 * height}));
  if (passage.roughness <= 0.0 || std::abs(smooth) > 3.0 * passage.roughness) return smooth;
  const double floor = std::clamp((above - 0.1) / 0.5, 0.0, 1.0);  // Whatever walks on it has made it smoother.
  return smooth + passage.roughness * (0.3 + 0.7 * floor) * bumps(p);
}

double FreeSpace::box(const Box& box, const Eigen::Vector3d& p) const {
  const Eigen::Vector3d d = p - box.centre;
  const Eigen::Vector3d local(box.along.x() * d.x() + box.along.y() * d.y(),
                              box.along.x() * d.y() - box.along.y() * d.x(), d.z());
  const Eigen::Vector3d q = local.cwiseAbs() - box.half;
  const double smooth = q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  if (box.roughness <= 0.0 || std::abs(smooth) > 3.0 * box.roughness) return smooth;
  return smooth + box.roughness * bumps(p);
}

double FreeSpace::roof(const Eigen::Vector3d& p) const {
  const Roof& roof = *parts_.roof;
  if (!within(roof, p, 0.0)) return kSolid;
  double value = roof.floor - p.z();
  for (const Box& solid : roof.solids) value = std::max(value, -box(solid, p));
  return value;
}

double FreeSpace::enclosed(const Nearby& nearby, const Eigen::Vector3d& p) const {
  double value = kSolid;
  for (const std::uint32_t i : nearby.passages) value = std::min(value, passage(parts_.passages[i], p));
  for (const std::uint32_t i : nearby.openings) value = std::min(value, box(parts_.openings[i], p));
  for (const std::uint32_t i : nearby.solids) value = std::max(value, -box(parts_.solids[i], p));
  return value;
}

double FreeSpace::value(const Nearby& nearby, const Eigen::Vector3d& p) const {
  const double value = enclosed(nearby, p);
  return nearby.roof ? std::min(value, roof(p)) : value;
}

bool FreeSpace::is_known(const Nearby& nearby, const Eigen::Vector3d& p) const {
  return !nearby.roof || within(*parts_.roof, p, 0.5 * cell_m_) || enclosed(nearby, p) < 2.0 * cell_m_;
}

double FreeSpace::value(const Eigen::Vector3d& p) const {
  const Eigen::Array3i at = (p.array() / block_m_).floor().cast<int>();
  const auto found = blocks_.find({at.x(), at.y(), at.z()});
  if (found != blocks_.end()) return value(found->second, p);
  return parts_.roof ? roof(p) : kSolid;
}

void FreeSpace::index_parts() {
  const double half_diagonal = 0.5 * std::sqrt(3.0) * block_m_;
  const auto for_blocks = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high, const auto& visit) {
    const Eigen::Array3i first = ((low.array() - kReach) / block_m_).floor().cast<int>();
    const Eigen::Array3i last = ((high.array() + kReach) / block_m_).floor().cast<int>();
    for (int x = first.x(); x <= last.x(); ++x)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int z = first.z(); z <= last.z(); ++z)
          visit(BlockIndex{x, y, z}, Eigen::Vector3d(block_m_ * (x + 0.5), block_m_ * (y + 0.5), block_m_ * (z + 0.5)));
  };
  for (std::uint32_t i = 0; i < parts_.passages.size(); ++i) {
    const Passage& passage = parts_.passages[i];
    const double grown = 1.0 + 2.0 * passage.variation;
    const double side = grown * passage.half_width;
    const Eigen::Vector3d low = passage.a.cwiseMin(passage.b) - Eigen::Vector3d(side, side, 0.0);
    const Eigen::Vector3d high = passage.a.cwiseMax(passage.b) + Eigen::Vector3d(side, side, grown * passage.height);
    const Eigen::Vector2d along = (passage.b - passage.a).head<2>();
    for_blocks(low, high, [&](const BlockIndex& at, const Eigen::Vector3d& centre) {
      const Eigen::Vector2d from_a = (centre - passage.a).head<2>();
      const double squared = along.squaredNorm();
      const double share = squared > 0.0 ? std::clamp(from_a.dot(along) / squared, 0.0, 1.0) : 0.0;
      if ((from_a - share * along).norm() < side + kReach + half_diagonal) blocks_[at].passages.push_back(i);
    });
  }
  const auto for_box = [&](const Box& box, const auto& visit) {
    const double side = box.half.head<2>().norm();
    const Eigen::Vector3d reach(side, side, box.half.z());
    for_blocks(box.centre - reach, box.centre + reach,
               [&](const BlockIndex& at, const Eigen::Vector3d&) { visit(at); });
  };
  for (std::uint32_t i = 0; i < parts_.openings.size(); ++i)
    for_box(parts_.openings[i], [&](const BlockIndex& at) { blocks_[at].openings.push_back(i); });
  for (std::uint32_t i = 0; i < parts_.solids.size(); ++i)  // Where nothing is free they make no difference.
    for_box(parts_.solids[i], [&](const BlockIndex& at) {
      if (const auto found = blocks_.find(at); found != blocks_.end()) found->second.solids.push_back(i);
    });
  if (!parts_.roof) return;
  const Roof& roof = *parts_.roof;
  double top = roof.floor;
  for (const Box& solid : roof.solids) top = std::max(top, solid.centre.z() + solid.half.z());
  for_blocks({roof.low.x(), roof.low.y(), roof.floor}, {roof.high.x(), roof.high.y(), top},
             [&](const BlockIndex& at, const Eigen::Vector3d&) { blocks_[at].roof = true; });
}

}  // namespace tutti::simulation
