// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/columns.hpp"
#include "tutti/wire/internal/quantise.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

using Stamps = std::vector<std::array<std::int64_t, 1>>;
using Edges = std::vector<std::array<std::int64_t, 1>>;

void write_runs(const ProxyGraph& graph, v1::ProxyGraph& out) {
  std::map<RobotId, std::pair<std::uint32_t, std::uint32_t>> counts;
  for (const ProxyNode& node : graph.nodes) ++counts[node.robot].first;
  for (const EliminatedNode& node : graph.eliminated) ++counts[node.robot].second;
  for (const auto& [robot, count] : counts) {
    v1::RobotRun& run = *out.add_run();
    run.set_robot(robot.value);
    run.set_nodes(count.first);
    run.set_eliminated(count.second);
  }
}

void write_nodes(const ProxyGraph& graph, v1::ProxyGraph& out) {
  Stamps stamps, eliminated;
  std::vector<PoseCode> poses;
  std::vector<CovarianceCode> covariances;
  for (const ProxyNode& node : graph.nodes) {
    stamps.push_back({node.stamp.ns});
    poses.push_back(quantise(node.T_world_body, kProxyPoseSteps));
    covariances.push_back(quantise(node.covariance, kProxyCovarianceStep));
    out.add_support(node.support);
  }
  for (const EliminatedNode& node : graph.eliminated) eliminated.push_back({node.stamp.ns});
  write_columns(stamps, *out.mutable_stamp_ns());
  write_columns(poses, *out.mutable_pose());
  write_columns(covariances, *out.mutable_covariance());
  write_columns(eliminated, *out.mutable_eliminated_stamp_ns());
}

void write_edges(const ProxyGraph& graph, v1::ProxyGraph& out) {
  Edges a;
  for (const ProxyEdge& edge : graph.edges) {
    a.push_back({edge.a});
    out.add_edge_b(std::int64_t{edge.b} - std::int64_t{edge.a});
    out.add_edge_weight(static_cast<float>(edge.weight));
  }
  write_columns(a, *out.mutable_edge_a());
}

/// Robot of every node and eliminated node.
struct Robots {
  std::vector<RobotId> nodes;
  std::vector<RobotId> eliminated;
};

Result<Robots> read_runs(const v1::ProxyGraph& in) {
  if (static_cast<std::size_t>(in.run_size()) > kMaxRobots)
    return fail(ErrorCode::invalid, "{} robots, at most {} are accepted", in.run_size(), kMaxRobots);
  Robots robots;
  for (const v1::RobotRun& run : in.run()) {
    const auto nodes = robots.nodes.size() + run.nodes();
    const auto eliminated = robots.eliminated.size() + run.eliminated();
    if (nodes > kMaxProxyNodes || eliminated > kMaxProxyNodes)
      return fail(ErrorCode::invalid, "{} nodes and {} eliminated ones, at most {} each", nodes, eliminated,
                  kMaxProxyNodes);
    robots.nodes.resize(nodes, RobotId{run.robot()});
    robots.eliminated.resize(eliminated, RobotId{run.robot()});
  }
  return robots;
}

Status read_nodes(const v1::ProxyGraph& in, const Robots& robots, ProxyGraph& graph) {
  const std::size_t count = robots.nodes.size();
  const auto stamps = read_columns<1>(in.stamp_ns(), count);
  const auto poses = read_columns<6>(in.pose(), count);
  const auto covariances = read_columns<21>(in.covariance(), count);
  const auto eliminated = read_columns<1>(in.eliminated_stamp_ns(), robots.eliminated.size());
  if (!stamps || !poses || !covariances || !eliminated || static_cast<std::size_t>(in.support_size()) != count)
    return fail(ErrorCode::parse,
                "{} stamps, {} pose numbers, {} covariance numbers, {} supports for {} nodes; {} "
                "stamps for {} eliminated ones",
                in.stamp_ns_size(), in.pose_size(), in.covariance_size(), in.support_size(), count,
                in.eliminated_stamp_ns_size(), robots.eliminated.size());
  graph.nodes.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto T_world_body = dequantise((*poses)[i], kProxyPoseSteps);
    const auto covariance = dequantise((*covariances)[i], kProxyCovarianceStep);
    if (!T_world_body || !covariance) return fail(ErrorCode::invalid, "node {} is out of range", i);
    graph.nodes.push_back(
        {robots.nodes[i], Timestamp{(*stamps)[i][0]}, *T_world_body, *covariance, in.support(static_cast<int>(i))});
  }
  for (std::size_t i = 0; i < robots.eliminated.size(); ++i)
    graph.eliminated.push_back({robots.eliminated[i], Timestamp{(*eliminated)[i][0]}});
  return {};
}

Status read_edges(const v1::ProxyGraph& in, ProxyGraph& graph) {
  const auto count = static_cast<std::size_t>(in.edge_b_size());
  if (count > kMaxProxyEdges)
    return fail(ErrorCode::invalid, "{} edges, at most {} are accepted", count, kMaxProxyEdges);
  const auto a = read_columns<1>(in.edge_a(), count);
  if (!a || in.edge_weight_size() != in.edge_b_size())
    return fail(ErrorCode::parse, "edges have {} first ends, {} second ends, {} weights", in.edge_a_size(),
                in.edge_b_size(), in.edge_weight_size());
  graph.edges.reserve(count);
  const auto nodes = static_cast<std::int64_t>(graph.nodes.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t from = (*a)[i][0];
    const std::int64_t to = sum(from, in.edge_b(static_cast<int>(i)));
    if (from < 0 || from >= nodes || to < 0 || to >= nodes)
      return fail(ErrorCode::invalid, "edge {} joins nodes {} and {} of {}", i, from, to, nodes);
    graph.edges.push_back({static_cast<std::uint32_t>(from), static_cast<std::uint32_t>(to),
                           static_cast<double>(in.edge_weight(static_cast<int>(i)))});
  }
  return {};
}

Status read_components(const v1::ProxyGraph& in, ProxyGraph& graph) {
  if (in.component_size() != in.component_robot_size() || static_cast<std::size_t>(in.component_size()) > kMaxRobots)
    return fail(ErrorCode::parse, "{} components for {} robots", in.component_size(), in.component_robot_size());
  for (int i = 0; i < in.component_size(); ++i)
    graph.components.push_back({RobotId{in.component_robot(i)}, in.component(i)});
  return {};
}

}  // namespace

std::string encode(const ProxyGraphMessage& message) {
  const Status valid = validate(message);
  TUTTI_CHECK(valid.has_value(), "{}", valid.error().message);
  const ProxyGraph& graph = message.graph;
  v1::ProxyGraph out;
  out.mutable_header()->set_robot(message.header.robot.value);
  out.mutable_header()->set_session(message.header.session);
  out.mutable_header()->set_sequence(message.header.sequence);
  out.set_revision(graph.revision);
  out.set_radius_m(graph.radius_m);
  out.set_sigma_m(graph.sigma_m);
  out.set_reduced(graph.reduced);
  write_runs(graph, out);
  write_nodes(graph, out);
  write_edges(graph, out);
  for (const RobotComponent& component : graph.components) {
    out.add_component_robot(component.robot.value);
    out.add_component(component.component);
  }
  return pack_frame(MessageKind::proxy_graph, out.SerializeAsString());
}

Result<ProxyGraphMessage> decode_proxy_graph(std::string_view bytes) {
  const Result<std::string> payload = unpack_frame(MessageKind::proxy_graph, bytes);
  if (!payload) return tl::unexpected(payload.error());
  v1::ProxyGraph in;
  if (!in.ParseFromString(*payload)) return fail(ErrorCode::parse, "proxy graph: not the protobuf message expected");

  ProxyGraphMessage message;
  message.header = {RobotId{in.header().robot()}, in.header().session(), in.header().sequence()};
  ProxyGraph& graph = message.graph;
  graph.revision = in.revision();
  graph.radius_m = in.radius_m();
  graph.sigma_m = in.sigma_m();
  graph.reduced = in.reduced();
  const std::string where = fmt::format("proxy graph {}", graph.revision);
  const Result<Robots> robots = read_runs(in);
  if (!robots) return in_context(where, robots.error());
  if (auto ok = read_nodes(in, *robots, graph); !ok) return in_context(where, ok.error());
  if (auto ok = read_edges(in, graph); !ok) return in_context(where, ok.error());
  if (auto ok = read_components(in, graph); !ok) return in_context(where, ok.error());
  if (auto ok = validate(message); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace tutti::wire
