// SPDX-License-Identifier: BSD-3-Clause
// Where a robot's raw odometry and the map part, by place, time and scale, as messages: what the robot itself finds
// when it compares (robot/agent.cpp), found again from its submaps.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

FieldJson number(double value, double digits) {
  return std::isfinite(value) ? FieldJson(std::round(digits * value) / digits) : FieldJson(nullptr);
}

/// The data of one chain's comparison, which has pointers into it.
struct Comparison {
  ProxyGraph graph;
  std::vector<consistency::RobotNode> nodes;
  std::vector<consistency::NodePair> pairs;
  std::optional<consistency::DisagreementTest> test;

  Comparison(const mapfile::ShownMap& map, const ChainId& chain)
      : graph(consistency::without_doubted(consistency::own_part(map.broadcast, chain.robot), chain)),
        nodes(robot_nodes(map.content.submaps, chain)),
        pairs(consistency::synchronise(graph, chain, nodes).pairs) {
    if (pairs.size() >= 2) test.emplace(graph, chain, pairs, kConfig.for_run_of(pairs.size()));
  }
  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;
  static inline const consistency::DisagreementConfig kConfig{};
};

}  // namespace

std::vector<consistency::RobotNode> robot_nodes(const server::SubmapSet& submaps, const ChainId& chain) {
  std::vector<consistency::RobotNode> out;
  const RelativePose nothing{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  RelativePose since = nothing;  // the last representative, by odometry
  std::optional<std::uint32_t> last;
  for (auto entry = submaps.lower_bound({chain, 0}); entry != submaps.end() && entry->first.chain == chain; ++entry) {
    const Submap& submap = *entry->second;
    if (last && submap.keyframes.front().index != *last) break;
    for (std::size_t k = last ? 1 : 0; k < submap.keyframes.size(); ++k) {
      const Keyframe& keyframe = submap.keyframes[k];
      if (k > 0) since = compound(since, submap.odometry[k - 1]);
      if (!keyframe.representative) continue;
      out.push_back({.stamp = keyframe.stamp,
                     .T_map_body = keyframe.T_odom_body,
                     .chain_index = keyframe.index,
                     .odometry = std::exchange(since, nothing),
                     .submap = entry->first.index});
    }
    last = submap.keyframes.back().index;
  }
  return out;
}

Message disagreement_message(const DisagreementOf& of, const consistency::Explanation& found,
                             const std::function<double(Timestamp)>& time_of) {
  FieldJson nodes = FieldJson::array(), lengths = FieldJson::array(), origins = FieldJson::array();
  for (std::size_t i = 0; i < found.stamps.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    FieldJson position = FieldJson::array(), significance = FieldJson::array();
    for (Eigen::Index scale = 0; scale < found.position_m.cols(); ++scale) {
      position.push_back(number(found.position_m(row, scale), 1e3));
      significance.push_back(number(found.significance(row, scale), 1e2));
    }
    FieldJson& node = nodes.emplace_back(FieldJson{{"t", number(time_of(found.stamps[i]), 1e2)},
                                                   {"distance_m", number(found.distance_m[i], 1e2)},
                                                   {"d", std::move(position)},
                                                   {"significance", std::move(significance)}});
    if (i < of.submaps.size()) node["submap"] = of.submaps[i];
  }
  for (const double length_m : found.scale_length_m) lengths.push_back(number(length_m, 10.0));
  for (const consistency::SuspectedOrigin& origin : found.origins)
    origins.push_back(
        {{"from_s", number(time_of(origin.from), 1e2)},
         {"until_s", number(time_of(origin.until), 1e2)},
         {"scale", origin.scale},
         {"place", {number(origin.place_m.x(), 1e3), number(origin.place_m.y(), 1e3), number(origin.place_m.z(), 1e3)}},
         {"translation_m", number(origin.translation_m, 1e3)},
         {"rotation_rad", number(origin.rotation_rad, 1e5)},
         {"significance", number(origin.significance, 1e2)},
         {"alert", origin.alert}});
  const FieldJson out{{"robot", of.robot.value},        {"component", of.component},
                      {"disagrees", found.disagrees()}, {"scale_length_m", std::move(lengths)},
                      {"nodes", std::move(nodes)},      {"origins", std::move(origins)}};
  return {"disagreement/" + of.name, of.time_s, text_of(out)};
}

Comparisons compare_all(const mapfile::ShownMap& map) {
  Comparisons out;
  const server::ClosureNames names = map.content.closure_names();
  std::optional<ChainId> last;
  for (const auto& [id, submap] : map.content.submaps) {
    if (std::exchange(last, id.chain) == id.chain) continue;
    const Comparison comparison(map, id.chain);
    if (!comparison.test || !comparison.test->is_informed()) continue;
    const Eigen::VectorXd& sigma_m = comparison.test->sigma_m();
    DisagreementOf of{.name = names.of(id.chain), .robot = id.chain.robot, .time_s = map.time - Timestamp{}};
    for (std::size_t i = 0; i < comparison.pairs.size(); ++i) {
      const SubmapId in{id.chain, comparison.nodes[comparison.pairs[i].robot].submap};
      of.submaps.push_back(to_string(in));
      double& largest = out.sigma_m[in];
      if (const auto row = static_cast<Eigen::Index>(i); row < sigma_m.size())
        largest = std::max(largest, sigma_m(row));
    }
    if (const MapNode* node = find_node(map.map, {id.chain, submap->keyframes.front().index}))
      of.component = node->component;
    const auto explanation =
        consistency::explain(comparison.graph, id.chain, comparison.nodes, comparison.pairs, *comparison.test,
                             (*comparison.test)(consistency::odometry_at(comparison.nodes, comparison.pairs)),
                             Comparison::kConfig.false_alarm_rate);
    out.messages.push_back(disagreement_message(of, explanation, [](Timestamp stamp) { return stamp - Timestamp{}; }));
  }
  return out;
}

}  // namespace tutti::page
