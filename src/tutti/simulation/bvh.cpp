// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/bvh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

constexpr int kBins = 16;
constexpr std::uint32_t kLeafSize = 2;     ///< Never split.
constexpr std::uint32_t kMaxLeafSize = 8;  ///< Always split above, if any two centres differ.
constexpr int kMaxDepth = 60;
constexpr float kTraversalCost = 1.5F;  ///< In intersections of a triangle.
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kSlack = 1.000002F;  ///< A few ulp: rounding may shrink a flat box's slab to less than nothing.
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

struct Box {
  Eigen::Array3f low = Eigen::Array3f::Constant(kFar);
  Eigen::Array3f high = Eigen::Array3f::Constant(-kFar);
  void add(const Box& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
  [[nodiscard]] float half_area() const {
    const Eigen::Array3f size = (high - low).max(0.0F);
    return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
  }
};

struct Item {
  Box box;
  std::uint32_t triangle = 0;
  [[nodiscard]] Eigen::Array3f centre() const { return 0.5F * (box.low + box.high); }
};

struct Split {
  int axis = -1;
  int bin = 0;  ///< Items of bins up to this one go left.
  float cost = kFar;
};

int bin_of(float centre, float low, float scale) {
  return std::clamp(static_cast<int>((centre - low) * scale), 0, kBins - 1);
}

Split best_split(const Item* items, std::uint32_t count, const Box& centres, int axis) {
  const float extent = centres.high[axis] - centres.low[axis];
  if (!(extent > 0.0F)) return {};
  const float scale = static_cast<float>(kBins) / extent;
  std::array<Box, kBins> boxes;
  std::array<std::uint32_t, kBins> counts{};
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto bin = static_cast<std::size_t>(bin_of(items[i].centre()[axis], centres.low[axis], scale));
    boxes[bin].add(items[i].box);
    ++counts[bin];
  }
  std::array<float, kBins> right_cost{};
  Box right;
  std::uint32_t right_count = 0;
  for (std::size_t bin = kBins - 1; bin > 0; --bin) {
    right.add(boxes[bin]);
    right_count += counts[bin];
    right_cost[bin] = right_count == 0 ? 0.0F : right.half_area() * static_cast<float>(right_count);
  }
  Split best;
  Box left;
  std::uint32_t left_count = 0;
  for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
    left.add(boxes[bin]);
    left_count += counts[bin];
    if (left_count == 0 || left_count == count) continue;
    const float cost = left.half_area() * static_cast<float>(left_count) + right_cost[bin + 1];
    if (cost < best.cost) best = {axis, static_cast<int>(bin), cost};
  }
  return best;
}

}  // namespace

struct Bvh::Builder {
  Bvh& bvh;
  std::vector<Item> items;

  struct Child {
    std::uint32_t index = 0;
    std::uint32_t count = 0;
  };

  /// Items [begin, end) reordered so that the left child has [begin, result); nothing when a leaf is better.
  std::optional<std::uint32_t> partition(std::uint32_t begin, std::uint32_t end, const Box& box, int depth) {
    const std::uint32_t count = end - begin;
    if (count <= kLeafSize || depth >= kMaxDepth) return std::nullopt;
    Box centres;
    for (std::uint32_t i = begin; i < end; ++i) centres.add({items[i].centre(), items[i].centre()});
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const Split split = best_split(items.data() + begin, count, centres, axis);
      if (split.cost < best.cost) best = split;
    }
    const float area = box.half_area();
    const bool pays = best.cost + kTraversalCost * area < static_cast<float>(count) * area;
    if (best.axis < 0 || (!pays && count <= kMaxLeafSize)) return std::nullopt;
    const float low = centres.low[best.axis];
    const float scale = static_cast<float>(kBins) / (centres.high[best.axis] - low);
    const auto middle = std::partition(items.begin() + begin, items.begin() + end, [&](const Item& item) {
      return bin_of(item.centre()[best.axis], low, scale) <= best.bin;
    });
    return static_cast<std::uint32_t>(middle - items.begin());
  }

  Box box_of(std::uint32_t begin, std::uint32_t end) const {
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.add(items[i].box);
    return box;
  }

  Child build(std::uint32_t begin, std::uint32_t end, const Box& box, int depth) {
    const auto middle = partition(begin, end, box, depth);
    if (!middle) return {begin, end - begin};
    const auto at = static_cast<std::uint32_t>(bvh.nodes_.size());
    bvh.nodes_.emplace_back();
    const std::uint32_t ends[] = {begin, *middle, end};
    for (std::size_t side = 0; side < 2; ++side) {
      const Box part = box_of(ends[side], ends[side + 1]);
      set(at, side, part, build(ends[side], ends[side + 1], part, depth + 1));
    }
    return {at, 0};
  }

  void set(std::uint32_t at, std::size_t side, const Box& box, Child child) {
    Node& node = bvh.nodes_[at];
    for (int axis = 0; axis < 3; ++axis) {
      node.low[side][axis] = box.low[axis];
      node.high[side][axis] = box.high[axis];
    }
    node.index[side] = child.index;
    node.count[side] = child.count;
  }
};

Bvh::Bvh(const TriangleMesh& mesh) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  Builder builder{*this, std::vector<Item>(count)};
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      TUTTI_CHECK(corner < mesh.vertices.size(), "corner {} of {}", corner, mesh.vertices.size());
      const Eigen::Array3f p = mesh.vertices[corner].array();
      builder.items[i].box.add({p, p});
    }
    builder.items[i].triangle = i;
  }
  nodes_.reserve(count / 2 + 1);
  if (count == 0) return;
  const Box box = builder.box_of(0, count);
  const Builder::Child root = builder.build(0, count, box, 0);
  if (root.count > 0) {  // A handful of triangles: cast() wants a node to begin with.
    nodes_.emplace_back();
    for (std::size_t side = 0; side < 2; ++side) builder.set(0, side, box, root);
  }

  triangles_.reserve(count);
  mesh_index_.reserve(count);
  place_.resize(count);
  for (const Item& item : builder.items) {
    const auto& corners = mesh.triangles[item.triangle];
    const Eigen::Vector3f& a = mesh.vertices[corners[0]];
    place_[item.triangle] = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back({a, mesh.vertices[corners[1]] - a, mesh.vertices[corners[2]] - a});
    mesh_index_.push_back(item.triangle);
  }
}

/// A ray and the nearest hit so far.
struct Bvh::Ray {
  Eigen::Vector3f origin, direction;
  float inverse[3];
  RayHit hit;

  Ray(const Eigen::Vector3f& from, const Eigen::Vector3f& towards, float max_distance)
      : origin(from), direction(towards), hit{max_distance, kNone} {
    // The inverse of zero is infinite and 0 * infinity = NaN; with a tiny component every product stays a number.
    for (int axis = 0; axis < 3; ++axis) {
      const float d = towards[axis];
      inverse[axis] = 1.0F / (std::abs(d) < 1e-20F ? std::copysign(1e-20F, d) : d);
    }
  }

  /// Distance at which the ray enters a child's box; infinite when it misses it or a nearer hit is known.
  float enter(const Node& node, int side) const {
    const float x0 = (node.low[side][0] - origin[0]) * inverse[0], x1 = (node.high[side][0] - origin[0]) * inverse[0];
    const float y0 = (node.low[side][1] - origin[1]) * inverse[1], y1 = (node.high[side][1] - origin[1]) * inverse[1];
    const float z0 = (node.low[side][2] - origin[2]) * inverse[2], z1 = (node.high[side][2] - origin[2]) * inverse[2];
    const float in = std::max(std::max(std::min(x0, x1), std::min(y0, y1)), std::max(std::min(z0, z1), 0.0F));
    const float out = std::min(std::min(std::max(x0, x1), std::max(y0, y1)), std::min(std::max(z0, z1), hit.distance));
    return in <= out * kSlack ? in : kFar;
  }

  void intersect(const Triangle& triangle, std::uint32_t index) {
    const Eigen::Vector3f p = direction.cross(triangle.edge2);
    const float determinant = triangle.edge1.dot(p);
    if (determinant == 0.0F) return;
    const float scale = 1.0F / determinant;
    const Eigen::Vector3f s = origin - triangle.corner;
    const float u = s.dot(p) * scale;
    if (!(u >= 0.0F && u <= 1.0F)) return;
    const Eigen::Vector3f q = s.cross(triangle.edge1);
    const float v = direction.dot(q) * scale;
    if (!(v >= 0.0F && u + v <= 1.0F)) return;
    const float distance = triangle.edge2.dot(q) * scale;
    if (!(distance > 0.0F && distance <= hit.distance)) return;
    if (distance == hit.distance && index >= hit.triangle) return;  // A shared edge: whatever the order of the search.
    hit = {distance, index};
  }
};

std::optional<RayHit> Bvh::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                float max_distance) const {
  if (nodes_.empty()) return std::nullopt;
  Ray ray(origin, direction, max_distance);
  struct Pending {
    std::uint32_t node;
    float entry;
  };
  std::array<Pending, kMaxDepth + 2> stack;
  std::size_t waiting = 0;
  std::uint32_t at = 0;
  while (true) {
    const Node& node = nodes_[at];
    float entry[2] = {ray.enter(node, 0), ray.enter(node, 1)};
    for (int side = 0; side < 2; ++side) {
      if (node.count[side] == 0 || entry[side] == kFar) continue;
      for (std::uint32_t i = node.index[side]; i < node.index[side] + node.count[side]; ++i)
        ray.intersect(triangles_[i], mesh_index_[i]);
      entry[side] = kFar;
    }
    const int near = entry[0] <= entry[1] ? 0 : 1;
    if (entry[near] < kFar) {
      at = node.index[near];
      if (entry[1 - near] < kFar) stack[waiting++] = {node.index[1 - near], entry[1 - near]};
      continue;
    }
    while (waiting > 0 && stack[waiting - 1].entry > ray.hit.distance) --waiting;
    if (waiting == 0) break;
    at = stack[--waiting].node;
  }
  if (ray.hit.triangle == kNone) return std::nullopt;
  return ray.hit;
}

Eigen::Vector3f Bvh::normal(std::uint32_t triangle) const {
  const Triangle& t = triangles_[place_[triangle]];
  const Eigen::Vector3f n = t.edge1.cross(t.edge2);
  return n.squaredNorm() > 0.0F ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f(Eigen::Vector3f::Zero());
}

}  // namespace tutti::simulation
