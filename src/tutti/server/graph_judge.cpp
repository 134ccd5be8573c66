// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_judge.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::server {
namespace {

/// Information below this share of the largest is no information along its axis.
constexpr double kLeastShare = 1e-12;

RelativePose measurement_of(const PoseGraphEdge& edge) {
  const auto [values, vectors] = eigen_of(edge.information);
  const Vector6d variances = values.cwiseMax(kLeastShare * values(5)).cwiseInverse();
  const Matrix6d covariance = vectors * variances.asDiagonal() * vectors.transpose();
  return {edge.T_from_to, 0.5 * (covariance + covariance.transpose())};
}

/// From the smaller vertex to the larger one.
struct Closure {
  std::size_t edge = 0;
  LoopClosure closure;
};

/// The graph as submaps: one for every segment of odometry without a gap.
class Submaps {
 public:
  explicit Submaps(const RobotGraph& graph) : graph_(graph), step_(graph.vertices.size()), segment_(step_.size()) {
    find_steps();
    for (std::size_t v = 0; v < graph.vertices.size(); ++v) add_vertex(v);
    close_segment();
    for (std::size_t e = 0; e < graph.graph.edges.size(); ++e)
      if (!is_step(e)) add_closure(e);
    std::ranges::stable_sort(closures_, {}, [](const Closure& c) { return std::pair(c.closure.from, c.closure.to); });
  }

  [[nodiscard]] bool is_step(std::size_t edge) const { return step_[later_end(edge)] == edge; }
  [[nodiscard]] const SubmapSet& submaps() const { return submaps_; }
  [[nodiscard]] const std::vector<Closure>& closures() const { return closures_; }
  [[nodiscard]] VerdictSet verdicts() const {
    VerdictSet out;
    for (const Closure& c : closures_) {
      const PoseGraphEdge& edge = graph_.graph.edges[c.edge];
      const SubmapPair pair{std::min(segment_[edge.from], segment_[edge.to]),
                            std::max(segment_[edge.from], segment_[edge.to])};
      ClosureVerdict& verdict = out[pair];
      verdict.pair = pair;
      verdict.closures.push_back(c.closure);
    }
    return out;
  }

 private:
  [[nodiscard]] std::size_t later_end(std::size_t edge) const {
    return std::max(graph_.graph.edges[edge].from, graph_.graph.edges[edge].to);
  }

  void find_steps() {
    for (std::size_t e = 0; e < graph_.graph.edges.size(); ++e) {
      const auto [a, b] = std::minmax(graph_.graph.edges[e].from, graph_.graph.edges[e].to);
      if (b == a + 1 && graph_.vertices[a].chain == graph_.vertices[b].chain && !step_[b]) step_[b] = e;
    }
  }

  void add_vertex(std::size_t v) {
    const KeyframeId& id = graph_.vertices[v];
    Pose3 T_odom_body;
    if (step_[v]) {
      const PoseGraphEdge& edge = graph_.graph.edges[*step_[v]];
      const RelativePose stated = measurement_of(edge);
      open_.odometry.push_back(edge.from < edge.to ? stated : inverse(stated));
      T_odom_body = open_.keyframes.back().T_odom_body * open_.odometry.back().T_a_b;
    } else {
      close_segment();
      const bool same_chain = !submaps_.empty() && submaps_.rbegin()->first.chain == id.chain;
      open_.id = {id.chain, same_chain ? submaps_.rbegin()->first.index + 1 : 0};
    }
    open_.keyframes.push_back({id.index, graph_.stamps[v], T_odom_body, true});
    segment_[v] = open_.id;
  }

  void close_segment() {
    if (!open_.keyframes.empty()) submaps_.emplace(open_.id, std::make_shared<const Submap>(std::move(open_)));
    open_ = {};
  }

  void add_closure(std::size_t e) {
    const PoseGraphEdge& edge = graph_.graph.edges[e];
    const RelativePose stated = measurement_of(edge);
    const auto [a, b] = std::minmax(edge.from, edge.to);
    closures_.push_back({e, {graph_.vertices[a], graph_.vertices[b], edge.from == a ? stated : inverse(stated)}});
  }

  const RobotGraph& graph_;
  std::vector<std::optional<std::size_t>> step_;  // per vertex: the odometry that ends there
  std::vector<SubmapId> segment_;                 // per vertex
  Submap open_;
  SubmapSet submaps_;
  std::vector<Closure> closures_;
};

void check(const RobotGraph& graph) {
  const std::size_t size = graph.graph.poses.size();
  TUTTI_CHECK(graph.vertices.size() == size && graph.stamps.size() == size, "{} poses, {} vertices, {} stamps", size,
              graph.vertices.size(), graph.stamps.size());
  for (std::size_t v = 1; v < size; ++v) {
    TUTTI_CHECK(graph.vertices[v - 1] < graph.vertices[v], "vertex {} does not come after the one before", v);
    TUTTI_CHECK(graph.vertices[v - 1].chain != graph.vertices[v].chain || graph.stamps[v - 1] < graph.stamps[v],
                "the stamp of vertex {} does not come after the one before", v);
  }
  for (const PoseGraphEdge& edge : graph.graph.edges)
    TUTTI_CHECK(edge.from < size && edge.to < size && edge.from != edge.to, "edge from {} to {} of {} vertices",
                edge.from, edge.to, size);
}

}  // namespace

JudgedGraph judge_graph(const RobotGraph& graph, const MapConfig& config) {
  check(graph);
  const Submaps submaps(graph);
  MapConfig all_judged = config;
  // A submap here is a whole trajectory, not 10 s of one.
  all_judged.most_closed_pairs = all_judged.most_pairs_in_all = std::numeric_limits<int>::max();
  JudgedGraph out{.map = estimate_map(submaps.submaps(), submaps.verdicts(), all_judged), .edges = {}};
  out.edges.resize(graph.graph.edges.size());
  for (std::size_t e = 0; e < out.edges.size(); ++e) out.edges[e].odometry = submaps.is_step(e);
  auto judged = out.map.closures.begin();
  for (const Closure& c : submaps.closures()) {
    JudgedEdge& edge = out.edges[c.edge];
    const bool is_judged = find_node(out.map, c.closure.from) != nullptr && find_node(out.map, c.closure.to) != nullptr;
    edge.accepted = is_judged && judged->accepted;
    edge.objection = is_judged ? judged->objection : judge::Objection::no_map;
    if (is_judged) edge.price = judged->price;
    if (is_judged) ++judged;
  }
  return out;
}

}  // namespace tutti::server
