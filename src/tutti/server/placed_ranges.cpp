// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/placed_ranges.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>

namespace tutti::server {
namespace {

using Eigen::Vector3d;

/// Over a longer time between two keyframes nobody knows where the robot was.
constexpr double kLongestBetween_s = 5.0;
constexpr double kShortestBetween_s = 1e-3;
/// Ranges that follow the one before between the same robots sooner are not used: robots send one a second.
constexpr double kFinestPlaced_s = 0.5;

/// A point of a robot's body at some time, and its velocity, seen from the node that is nearest in time.
struct SeenPoint {
  std::size_t node = 0;
  Vector3d p_node, v_node;
};

/// By raw odometry between the keyframes before and after that time.
std::optional<SeenPoint> see_point(std::span<const MapNode> all, std::span<const MapNode> chain, Timestamp stamp,
                                   const Vector3d& p_body) {
  const auto after = std::ranges::lower_bound(chain, stamp, {}, &MapNode::stamp);
  if (after == chain.end() || (after == chain.begin() && after->stamp != stamp)) return std::nullopt;
  const auto before = after == chain.begin() ? after : std::prev(after);
  const double step_s = after->stamp - before->stamp;
  if (step_s > kLongestBetween_s && after->stamp != stamp) return std::nullopt;
  const double share = step_s > 0.0 ? (stamp - before->stamp) / step_s : 0.0;
  const MapNode& nearest = share < 0.5 ? *before : *after;
  const Pose3 T_node_odom = nearest.T_odom_body.inverse();
  const Vector3d moved = after->T_odom_body * p_body - before->T_odom_body * p_body;
  return SeenPoint{.node = static_cast<std::size_t>(&nearest - all.data()),
                   .p_node = T_node_odom * (interpolate(before->T_odom_body, after->T_odom_body, share) * p_body),
                   .v_node = T_node_odom.rotation * moved / std::max(step_s, kShortestBetween_s)};
}

/// Where robots were, by the nodes of their sessions, which follow each other in the map.
class Whereabouts {
 public:
  Whereabouts(std::span<const MapNode> nodes, const SubmapSet& submaps) : nodes_(nodes) {
    for (std::size_t first = 0; first < nodes.size();) {
      std::size_t end = first;
      while (end < nodes.size() && nodes[end].id.chain == nodes[first].id.chain) ++end;
      chains_[nodes[first].id.chain] = nodes.subspan(first, end - first);
      first = end;
    }
    for (const auto& [id, submap] : submaps)
      if (!submap->ranges.empty()) antennas_.try_emplace(id.chain.robot, submap->ranges.front().p_body_antenna);
  }

  [[nodiscard]] std::optional<SeenPoint> see(const ChainId& chain, Timestamp stamp, const Vector3d& p_body) const {
    const auto nodes = chains_.find(chain);
    return nodes == chains_.end() ? std::nullopt : see_point(nodes_, nodes->second, stamp, p_body);
  }
  /// The robot's antenna, in whichever of its sessions has that time. Its own ranges say where on the body that is; who
  /// only answers others has it at the origin.
  [[nodiscard]] std::optional<SeenPoint> see_antenna(RobotId robot, Timestamp stamp) const {
    const auto antenna = antennas_.find(robot);
    const Vector3d p_body = antenna == antennas_.end() ? Vector3d(Vector3d::Zero()) : antenna->second;
    for (auto it = chains_.lower_bound(robot); it != chains_.end() && it->first.robot == robot; ++it)
      if (const auto seen = see_point(nodes_, it->second, stamp, p_body)) return seen;
    return std::nullopt;
  }

 private:
  std::span<const MapNode> nodes_;
  std::map<ChainId, std::span<const MapNode>> chains_;
  std::map<RobotId, Vector3d> antennas_;
};

}  // namespace

std::vector<PlacedRange> place_ranges(const MapEstimate& map, const SubmapSet& submaps, Ranges& counts) {
  std::map<std::pair<ChainId, RobotId>, std::size_t> at;
  for (const auto& [id, submap] : submaps)
    for (const RobotRange& range : submap->ranges) at.try_emplace({id.chain, range.to});
  for (auto& [ends, position] : at) {
    position = counts.judged.size();
    counts.judged.push_back({.from = ends.first, .to = ends.second});
  }
  std::vector<std::optional<Timestamp>> placed(counts.judged.size());
  const Whereabouts robots(map.nodes, submaps);
  std::vector<PlacedRange> out;
  for (const auto& [id, submap] : submaps)
    for (const RobotRange& range : submap->ranges) {
      const std::size_t judged = at.at({id.chain, range.to});
      std::optional<Timestamp>& newest = placed[judged];
      ++counts.judged[judged].ranges;
      ++counts.judged[judged].unplaced;
      if (newest && !(range.stamp - *newest >= kFinestPlaced_s)) continue;
      const auto own = robots.see(id.chain, range.stamp, range.p_body_antenna);
      const auto other = robots.see_antenna(range.to, range.stamp);
      if (!own || !other || map.nodes[own->node].component != map.nodes[other->node].component) continue;
      const double sigma_m = range.sigma_m > 0.0 ? range.sigma_m : kUnknownRange_m;
      out.push_back({{own->node, other->node, {own->p_node, other->p_node, range.distance_m}, sigma_m},
                     judged,
                     own->v_node,
                     other->v_node});
      newest = range.stamp;
      --counts.judged[judged].unplaced;
    }
  return out;
}

}  // namespace tutti::server
