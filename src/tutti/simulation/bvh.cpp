// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/bvh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

constexpr int kBins = 16;       ///< Places along an axis where a range may be split.
constexpr int kFreeDepth = 48;  ///< Deeper nodes are split into halves,
constexpr int kStack = 256;     ///< so that this is enough.
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kFarthest = 1e30F;      ///< Where a ray ends at the latest: empty boxes are at infinity.
constexpr float kSlack = 1.000002F;     ///< A few ulp: rounding may shrink a flat box's slab to less than nothing.
constexpr float kTriangleEdge = 1e-5F;  ///< As a share of a triangle's size.
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

struct Bounds {
  Eigen::Array3f low = Eigen::Array3f::Constant(kFar);
  Eigen::Array3f high = Eigen::Array3f::Constant(-kFar);
  void add(const Bounds& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  [[nodiscard]] float half_area() const {
    const Eigen::Array3f size = (high - low).max(0.0F);
    return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
  }
};

struct Item {
  Bounds box;
  std::uint32_t triangle = 0;
  [[nodiscard]] Eigen::Array3f centre() const { return 0.5F * (box.low + box.high); }
};

}  // namespace

struct Bvh::Builder {
  Bvh& bvh;
  const TriangleMesh& mesh;
  std::vector<Item> items;

  struct Range {
    std::uint32_t begin = 0, end = 0;
    Bounds box;
    [[nodiscard]] std::uint32_t size() const { return end - begin; }
    /// How much there is to gain from splitting it.
    [[nodiscard]] float weight() const { return size() <= kWidth ? -1.0F : box.half_area(); }
  };

  Range range(std::uint32_t begin, std::uint32_t end) const {
    Range out{begin, end, {}};
    for (std::uint32_t i = begin; i < end; ++i) out.box.add(items[i].box);
    return out;
  }

  /// Where a range is split: so many of its items, by where their centres lie along the axis, come first.
  struct Split {
    int axis = 0;
    std::uint32_t first = 0;
  };

  /// Half of the packets' triangles, on the axis on which centres spread most.
  static Split halves(const Range& range, const Bounds& centres) {
    Split out;
    (centres.high - centres.low).maxCoeff(&out.axis);
    out.first = (range.size() / 2 + kWidth - 1) / kWidth * kWidth;
    return out;
  }

  /// The split after which a ray is expected to meet the fewest packets: the surface area heuristic in bins (Wald 2007,
  /// "On fast construction of SAH-based bounding volume hierarchies").
  Split best_split(const Range& range, const Bounds& centres) const {
    Split best = halves(range, centres);
    float least = kFar;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = centres.low[axis], size = centres.high[axis] - low;
      if (!(size > 0.0F)) continue;
      struct Bin {
        Bounds box, after;  // after: of this bin and those behind it
        std::uint32_t count = 0;
      };
      std::array<Bin, kBins> bins;
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        const float share = (items[i].centre()[axis] - low) / size;
        Bin& bin = bins[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(kBins * share)))];
        bin.box.add(items[i].box);
        ++bin.count;
      }
      Bounds behind, before;
      for (auto bin = bins.rbegin(); bin != bins.rend(); ++bin) {
        behind.add(bin->box);
        bin->after = behind;
      }
      std::uint32_t first = 0;
      for (std::size_t i = 0; i + 1 < bins.size(); ++i) {
        before.add(bins[i].box);
        first += bins[i].count;
        if (first == 0 || first == range.size()) continue;
        const float cost =
            before.half_area() * packets_of(first) + bins[i + 1].after.half_area() * packets_of(range.size() - first);
        if (cost < least) {
          least = cost;
          best = {axis, first};
        }
      }
    }
    return best;
  }
  static float packets_of(std::uint32_t triangles) { return static_cast<float>((triangles + kWidth - 1) / kWidth); }

  /// Reorders the items of a range and returns where its second part begins.
  std::uint32_t split(const Range& range, int depth) {
    Bounds centres;
    for (std::uint32_t i = range.begin; i < range.end; ++i) centres.add({items[i].centre(), items[i].centre()});
    const auto [axis, first] = depth < kFreeDepth ? best_split(range, centres) : halves(range, centres);
    const std::uint32_t middle = range.begin + first;
    std::nth_element(items.begin() + range.begin, items.begin() + middle, items.begin() + range.end,
                     [axis](const Item& a, const Item& b) { return a.centre()[axis] < b.centre()[axis]; });
    return middle;
  }

  /// Index of the node of a range.
  std::int32_t build(const Range& whole, int depth) {
    std::array<Range, kWidth> parts{whole};
    std::size_t count = 1;
    while (count < kWidth) {
      const auto largest = std::max_element(parts.begin(), parts.begin() + count,
                                            [](const Range& a, const Range& b) { return a.weight() < b.weight(); });
      if (largest->size() <= kWidth) break;
      const std::uint32_t middle = split(*largest, depth);
      parts[count++] = range(middle, largest->end);
      *largest = range(largest->begin, middle);
    }
    const auto at = static_cast<std::int32_t>(bvh.nodes_.size());
    bvh.nodes_.emplace_back();
    for (std::size_t i = 0; i < kWidth; ++i) {
      const bool leaf = parts[i].size() <= kWidth;
      const std::int32_t child = i >= count ? 0 : leaf ? pack(parts[i]) : build(parts[i], depth + 1);
      Node& node = bvh.nodes_[static_cast<std::size_t>(at)];
      node.children[i] = child;
      for (int axis = 0; axis < 3; ++axis) {
        node.bounds[0][axis][i] = parts[i].box.low[axis];
        node.bounds[1][axis][i] = parts[i].box.high[axis];
      }
    }
    return at;
  }

  /// ~index of the packet of up to kWidth triangles.
  std::int32_t pack(const Range& range) {
    Packet packet{};  // Lanes left over have triangles without area, which nothing hits.
    std::fill_n(packet.triangle, kWidth, kNone);
    for (std::uint32_t i = 0; i < range.size(); ++i) {
      const std::uint32_t triangle = items[range.begin + i].triangle;
      const auto& corners = mesh.triangles[triangle];
      const Eigen::Vector3f& a = mesh.vertices[corners[0]];
      const Eigen::Vector3f edge1 = mesh.vertices[corners[1]] - a, edge2 = mesh.vertices[corners[2]] - a;
      for (int axis = 0; axis < 3; ++axis) {
        packet.corner[axis][i] = a[axis];
        packet.edge1[axis][i] = edge1[axis];
        packet.edge2[axis][i] = edge2[axis];
      }
      packet.triangle[i] = triangle;
      bvh.place_[triangle] = static_cast<std::uint32_t>(kWidth * bvh.packets_.size()) + i;
    }
    bvh.packets_.push_back(packet);
    return ~static_cast<std::int32_t>(bvh.packets_.size() - 1);
  }
};

Bvh::Bvh(const TriangleMesh& mesh) : place_(mesh.triangles.size()) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  Builder builder{*this, mesh, std::vector<Item>(count)};
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      TUTTI_CHECK(corner < mesh.vertices.size(), "corner {} of {}", corner, mesh.vertices.size());
      const Eigen::Array3f p = mesh.vertices[corner].array();
      builder.items[i].box.add({p, p});
    }
    builder.items[i].triangle = i;
  }
  nodes_.reserve(count / 4 + 1);
  packets_.reserve(count / 2 + 1);
  builder.build(builder.range(0, count), 0);
}

/// A ray and the nearest hit so far. Comparisons are written so that a NaN (0 * infinity, where a ray runs within the
/// plane of a box's side) changes nothing.
struct Bvh::Ray {
  Eigen::Vector3f origin, direction;
  float inverse[3];
  int backwards[3];  ///< 1 where the direction is negative: the ray then enters a box at its high side.
  RayHit hit;

  Ray(const Eigen::Vector3f& from, const Eigen::Vector3f& towards, float max_distance)
      : origin(from), direction(towards), hit{std::min(max_distance, kFarthest), kNone} {
    for (int axis = 0; axis < 3; ++axis) {
      inverse[axis] = 1.0F / towards[axis];
      backwards[axis] = std::signbit(towards[axis]) ? 1 : 0;
    }
  }

  /// Distances at which the ray enters a node's boxes, and a bit for each that it hits before the nearest hit.
  struct Entries {
    Lanes distance;
    unsigned hit;
  };
  [[nodiscard]] Entries enter(const Node& node) const {
    Lanes in = all(0.0F), out = all(hit.distance);
    for (int axis = 0; axis < 3; ++axis) {
      const Lanes near = (node.bounds[backwards[axis]][axis] - origin[axis]) * inverse[axis];
      const Lanes far = (node.bounds[1 - backwards[axis]][axis] - origin[axis]) * inverse[axis];
      in = near > in ? near : in;
      out = far < out ? far : out;
    }
    return {in, bits(in <= out * kSlack)};
  }

  void intersect(const Packet& packet) {
    const float dx = direction.x(), dy = direction.y(), dz = direction.z();
    const auto& [bx, by, bz] = packet.edge1;
    const auto& [cx, cy, cz] = packet.edge2;
    const Lanes px = dy * cz - dz * cy, py = dz * cx - dx * cz, pz = dx * cy - dy * cx;
    const Lanes scale = 1.0F / (bx * px + by * py + bz * pz);
    const Lanes sx = origin.x() - packet.corner[0], sy = origin.y() - packet.corner[1],
                sz = origin.z() - packet.corner[2];
    const Lanes qx = sy * bz - sz * by, qy = sz * bx - sx * bz, qz = sx * by - sy * bx;
    const Lanes u = (sx * px + sy * py + sz * pz) * scale;
    const Lanes v = (dx * qx + dy * qy + dz * qz) * scale;
    const Lanes t = (cx * qx + cy * qy + cz * qz) * scale;
    const auto inside = (u >= -kTriangleEdge) & (v >= -kTriangleEdge) & (u + v <= 1.0F + kTriangleEdge) & (t > 0.0F) &
                        (t <= hit.distance);
    for (unsigned left = bits(inside); left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      const bool nearer = t[i] < hit.distance;
      // Where two triangles meet, the same one whatever the order of the search.
      const bool as_near = t[i] == hit.distance && packet.triangle[i] < hit.triangle;
      if (nearer || as_near) hit = {t[i], packet.triangle[i]};
    }
  }

  /// A bit for each lane of a comparison that is true.
  template <class Mask>
  static unsigned bits(Mask mask) {
#ifdef __SSE__
    return static_cast<unsigned>(__builtin_ia32_movmskps(std::bit_cast<Lanes>(mask)));
#else
    unsigned out = 0;
    for (int i = 0; i < kWidth; ++i) out |= (mask[i] != 0 ? 1U : 0U) << i;
    return out;
#endif
  }

  static Lanes all(float value) { return Lanes{value, value, value, value}; }
};

std::optional<RayHit> Bvh::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                float max_distance) const {
  Ray ray(origin, direction, max_distance);
  struct Pending {
    std::int32_t child;
    float entry;
  };
  Pending stack[kStack];
  int waiting = 0;
  Pending next{0, 0.0F};
  for (;;) {
    if (next.child < 0) {
      ray.intersect(packets_[static_cast<std::size_t>(~next.child)]);
    } else {
      const Node& node = nodes_[static_cast<std::size_t>(next.child)];
      Ray::Entries found = ray.enter(node);
      const auto take = [&node, &found] {
        const int i = std::countr_zero(found.hit);
        found.hit &= found.hit - 1;
        return Pending{node.children[i], found.distance[i]};
      };
      if (found.hit != 0) {  // On with the nearest one; the others wait, the nearest of them on top.
        next = take();
        for (const int first = waiting; found.hit != 0;) {
          Pending other = take();
          if (other.entry < next.entry) std::swap(other, next);
          int at = waiting++;
          for (; at > first && stack[at - 1].entry < other.entry; --at) stack[at] = stack[at - 1];
          stack[at] = other;
        }
        continue;
      }
    }
    do {
      if (waiting == 0) return ray.hit.triangle == kNone ? std::nullopt : std::optional(ray.hit);
      next = stack[--waiting];
    } while (next.entry > ray.hit.distance);
  }
}

Eigen::Vector3f Bvh::normal(std::uint32_t triangle) const {
  const Packet& packet = packets_[place_[triangle] / kWidth];
  const std::uint32_t lane = place_[triangle] % kWidth;
  const auto edge = [lane](const Lanes* e) { return Eigen::Vector3f(e[0][lane], e[1][lane], e[2][lane]); };
  const Eigen::Vector3f n = edge(packet.edge1).cross(edge(packet.edge2));
  return n.squaredNorm() > 0.0F ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f(Eigen::Vector3f::Zero());
}

}  // namespace tutti::simulation
