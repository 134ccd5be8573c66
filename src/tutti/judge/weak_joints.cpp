// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/weak_joints.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "tutti/estimation/between_factor.hpp"

namespace tutti::judge {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// A spanning forest of a map by depth-first search, and its bridges: edges without which what they join falls apart
/// (Tarjan, "A note on finding the bridges of a graph", 1974).
class Forest {
 public:
  explicit Forest(const PoseGraph& map) : map_(map), at_(map.poses.size()), edges_(map.poses.size()) {
    for (std::size_t e = 0; e < map.edges.size(); ++e) {
      edges_[map.edges[e].from].push_back(e);
      edges_[map.edges[e].to].push_back(e);
    }
    for (std::size_t root = 0; root < at_.size(); ++root)
      if (at_[root].begin == kNone) visit_from(root);
  }

  /// The same for all nodes that hang together.
  [[nodiscard]] std::size_t part(std::size_t node) const { return at_[node].part; }
  /// The node below this edge, if it is a bridge.
  [[nodiscard]] std::optional<std::size_t> below(std::size_t edge) const {
    for (const std::size_t node : {map_.edges[edge].from, map_.edges[edge].to})
      if (at_[node].edge == edge && at_[node].least == at_[node].begin) return node;
    return std::nullopt;
  }
  [[nodiscard]] bool is_below(std::size_t node, std::size_t top) const {
    return at_[top].begin <= at_[node].begin && at_[node].begin < at_[top].end;
  }

 private:
  struct At {
    std::size_t part = 0;
    std::size_t edge = kNone;            // from the node above
    std::size_t begin = kNone, end = 0;  // the numbers of this node and those below it
    std::size_t least = 0;               // the least number that one of these reaches, but by `edge`
    std::size_t next = 0;                // of its edges
  };

  void visit_from(std::size_t root) {
    std::vector<std::size_t> open;
    const auto enter = [&](std::size_t node, std::size_t edge) {
      at_[node] = {.part = root, .edge = edge, .begin = number_, .end = 0, .least = number_, .next = 0};
      ++number_;
      open.push_back(node);
    };
    enter(root, kNone);
    while (!open.empty()) {
      At& at = at_[open.back()];
      if (at.next < edges_[open.back()].size()) {
        const std::size_t edge = edges_[open.back()][at.next++];
        if (edge == at.edge) continue;
        const PoseGraphEdge& ends = map_.edges[edge];
        const std::size_t other = ends.from == open.back() ? ends.to : ends.from;
        if (at_[other].begin == kNone)
          enter(other, edge);
        else
          at.least = std::min(at.least, at_[other].begin);
        continue;
      }
      at.end = number_;
      open.pop_back();
      if (!open.empty()) at_[open.back()].least = std::min(at_[open.back()].least, at.least);
    }
  }

  const PoseGraph& map_;
  std::vector<At> at_;
  std::vector<std::vector<std::size_t>> edges_;  // per node
  std::size_t number_ = 0;
};

/// Per pair of parts.
std::vector<WeakJoint> between_parts(const Forest& forest, std::span<const PoseGraphEdge> closures,
                                     std::span<const std::size_t> refused) {
  std::map<std::pair<std::size_t, std::size_t>, WeakJoint> joints;
  for (const std::size_t c : refused) {
    const std::size_t from = forest.part(closures[c].from), to = forest.part(closures[c].to);
    if (from != to) joints[std::minmax(from, to)].across.push_back({c, from < to});
  }
  std::vector<WeakJoint> out;
  for (auto& [parts, joint] : joints) out.push_back(std::move(joint));
  return out;
}

/// The joint at an edge of odometry; without closures across where others join its sides.
WeakJoint at_edge(const Forest& forest, const PoseGraph& map, std::size_t edge, std::span<const PoseGraphEdge> closures,
                  std::span<const std::size_t> refused) {
  WeakJoint out{.odometry = {{map.edges[edge].from, map.edges[edge].to}}, .across = {}};
  const auto below = forest.below(edge);
  if (!below) return out;
  const std::size_t part = forest.part(*below);
  const bool first_is_below = map.edges[edge].from == *below;
  for (const std::size_t c : refused) {
    if (forest.part(closures[c].from) != part || forest.part(closures[c].to) != part) continue;
    const bool from = forest.is_below(closures[c].from, *below), to = forest.is_below(closures[c].to, *below);
    if (from != to) out.across.push_back({c, from == first_is_below});
  }
  return out;
}

double nth_of(std::vector<double>& of, std::size_t position) {
  const auto at = of.begin() + static_cast<std::ptrdiff_t>(position);
  std::ranges::nth_element(of, at);
  return *at;
}

}  // namespace

std::vector<WeakJoint> weak_joints(const PoseGraph& map, std::size_t odometry_edges,
                                   std::span<const PoseGraphEdge> closures, std::span<const std::size_t> refused,
                                   std::size_t least) {
  if (refused.size() < least) return {};
  const Forest forest(map);
  std::vector<WeakJoint> out = between_parts(forest, closures, refused);
  std::erase_if(out, [&](const WeakJoint& joint) { return joint.across.size() < least; });
  for (std::size_t e = 0; e < odometry_edges; ++e) {
    WeakJoint joint = at_edge(forest, map, e, closures, refused);
    if (joint.across.size() < least) continue;
    const bool goes_on = !out.empty() && out.back().odometry && out.back().odometry->second == joint.odometry->first &&
                         out.back().across == joint.across;
    if (goes_on)
      out.back().odometry->second = joint.odometry->second;
    else
      out.push_back(std::move(joint));
  }
  return out;
}

JointAgreement most_agreed(std::span<const Pose3> poses, std::span<const PoseGraphEdge> closures,
                           const WeakJoint& joint, std::span<const std::vector<std::size_t>> places,
                           std::size_t least_places) {
  std::map<std::size_t, bool> leads_to_second;
  for (const WeakJoint::Across& across : joint.across) leads_to_second[across.closure] = across.leads_to_second;
  JointAgreement best{.closure = 0, .T_first_second = {}, .error = std::numeric_limits<double>::infinity()};
  std::vector<double> errors, of_place;
  for (const WeakJoint::Across& across : joint.across) {
    const PoseGraphEdge& closure = closures[across.closure];
    const Pose3 T = poses[closure.from] * closure.T_from_to * poses[closure.to].inverse();  // it holds if that moves so
    const Pose3 T_first_second = across.leads_to_second ? T : T.inverse(), T_second_first = T_first_second.inverse();
    errors.clear();
    for (const std::vector<std::size_t>& place : places) {
      of_place.clear();
      for (const std::size_t c : place) {
        const PoseGraphEdge& other = closures[c];
        const Pose3& moved = leads_to_second.at(c) ? T_first_second : T_second_first;
        const Vector6d residual =
            estimation::between_residual(poses[other.from], moved * poses[other.to], other.T_from_to);
        of_place.push_back(residual.dot(other.information * residual));
      }
      errors.push_back(nth_of(of_place, of_place.size() / 2));
    }
    const double error = nth_of(errors, std::max(errors.size() / 4, least_places - 1));
    if (error < best.error) best = {across.closure, T_first_second, error};
  }
  return best;
}

}  // namespace tutti::judge
