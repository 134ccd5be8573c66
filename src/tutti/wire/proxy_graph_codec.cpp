// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/proxy_graph_columns.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

/// Where robots were last seen, at most once in each chain of a component; hands them to add(seen). False when a number
/// is outside what encoding makes.
template <class Coder, class Add>
bool code_last_seen(Coder& coder, const std::vector<ChainComponent>& chains, const std::vector<LastSeen>& in, Add add) {
  IntegerModel is_seen, stamps;
  std::array<IntegerModel, 6> poses;
  std::int64_t stamp_ns = 0;
  for (const ChainComponent& entry : chains) {
    const auto found = std::ranges::find(in, entry.chain, &LastSeen::chain);
    if (coder.code(is_seen, found == in.end() ? 0 : 1) == 0) continue;
    const LastSeen seen = found == in.end() ? LastSeen{} : *found;
    stamp_ns = sum(stamp_ns, coder.code(stamps, difference(seen.stamp.ns, stamp_ns)));
    PoseCode pose = quantise(seen.T_world_body, kProxyPoseSteps);
    for (std::size_t i = 0; i < pose.size(); ++i) pose[i] = coder.code(poses[i], pose[i]);
    const auto T_world_body = dequantise(pose, kProxyPoseSteps);
    if (!T_world_body) return false;
    add(LastSeen{entry.chain, {stamp_ns}, *T_world_body, {}});
  }
  return true;
}

std::vector<Run> runs_of(const ProxyGraph& graph) {
  std::map<ChainId, Run> runs;
  const auto add = [&](const auto& nodes, std::size_t Run::*count) {
    for (const auto& node : nodes) {
      Run& run = runs[node.chain];
      const auto stamp = static_cast<std::uint64_t>(node.stamp.ns);
      run.chain = node.chain;
      if (run.nodes + run.eliminated == 0) run.clock = {stamp, 0};
      run.clock.step_ns = std::gcd(run.clock.step_ns, stamp - run.clock.offset_ns);
      ++(run.*count);
    }
  };
  add(graph.nodes, &Run::nodes);
  add(graph.eliminated, &Run::eliminated);
  for (const ChainUncertainty& uncertainty : graph.uncertainties) runs[uncertainty.chain].has_uncertainty = true;
  std::vector<Run> out;
  for (auto& [chain, run] : runs) {
    run.clock.step_ns = std::max<std::uint64_t>(run.clock.step_ns, 1);
    out.push_back(run);
  }
  return out;
}

Result<std::vector<Run>> read_runs(const v1::ProxyGraph& in) {
  std::vector<Run> runs;
  std::size_t nodes = 0;
  std::size_t eliminated = 0;
  for (const v1::RobotRun& run : in.run()) {
    nodes += run.nodes();
    eliminated += run.eliminated();
    if (nodes > kMaxProxyNodes || eliminated > kMaxProxyNodes)
      return fail(ErrorCode::invalid, "{} nodes and {} eliminated ones, at most {} each", nodes, eliminated,
                  kMaxProxyNodes);
    if (run.stamp_step_ns() == 0)
      return fail(ErrorCode::invalid, "robot {}: a step of 0 ns between stamps", run.robot());
    runs.push_back({{RobotId{run.robot()}, run.session()},
                    {static_cast<std::uint64_t>(run.stamp_offset_ns()), run.stamp_step_ns()},
                    run.nodes(),
                    run.eliminated(),
                    run.uncertainty()});
  }
  return runs;
}

void write_body(const ProxyGraph& graph, const ProxyGraph& base, const std::vector<Run>& runs, v1::ProxyGraph& out) {
  ColumnWriter writer;
  NodeColumns nodes;
  StampColumn eliminated;
  UncertaintyColumns uncertainties;
  auto node = graph.nodes.begin();
  auto gone = graph.eliminated.begin();
  auto uncertainty = graph.uncertainties.begin();
  for (const Run& run : runs) {
    nodes.start_run(nodes_of(base, run.chain));
    eliminated.start_run();
    for (std::size_t i = 0; i < run.nodes; ++i)
      TUTTI_CHECK(nodes.code(writer, run, *node++).has_value(), "node {} of robot {}", i, to_string(run.chain));
    for (std::size_t i = 0; i < run.eliminated; ++i) eliminated.code(writer, run.clock, (gone++)->stamp);
    if (run.has_uncertainty) uncertainties.code(writer, run, *uncertainty++);
  }
  EdgeColumns edges;
  const auto count = static_cast<std::int64_t>(graph.nodes.size());
  for (const ProxyEdge& edge : graph.edges) edges.code(writer, count, edge);
  TUTTI_CHECK(code_last_seen(writer, graph.components, graph.last_seen, [](const LastSeen&) {}), "robots last seen");
  out.set_edges(static_cast<std::uint32_t>(graph.edges.size()));
  out.set_body(writer.out.finish());
}

/// Stops as soon as it has read more than there is: what is claimed may be more than what is there. Needs the graph's
/// components.
Status read_body(const v1::ProxyGraph& in, const ProxyGraph& base, const std::vector<Run>& runs, ProxyGraph& graph) {
  if (in.edges() > kMaxProxyEdges)
    return fail(ErrorCode::invalid, "{} edges, at most {} are accepted", in.edges(), kMaxProxyEdges);
  ColumnReader reader{RangeDecoder(in.body())};
  NodeColumns nodes;
  StampColumn eliminated;
  UncertaintyColumns uncertainties;
  for (const Run& run : runs) {
    nodes.start_run(nodes_of(base, run.chain));
    eliminated.start_run();
    for (std::size_t i = 0; i < run.nodes && !reader.in.overrun(); ++i) {
      const auto node = nodes.code(reader, run, {});
      if (!node) return fail(ErrorCode::invalid, "node {} of robot {} is out of range", i, to_string(run.chain));
      graph.nodes.push_back(*node);
    }
    for (std::size_t i = 0; i < run.eliminated && !reader.in.overrun(); ++i)
      graph.eliminated.push_back({run.chain, eliminated.code(reader, run.clock, {})});
    if (!run.has_uncertainty || reader.in.overrun()) continue;
    auto uncertainty = uncertainties.code(reader, run, {});
    if (!uncertainty)
      return fail(ErrorCode::invalid, "the uncertainty of robot {} is out of range", to_string(run.chain));
    graph.uncertainties.push_back(std::move(*uncertainty));
  }
  EdgeColumns edges;
  for (std::size_t i = 0; i < in.edges() && !reader.in.overrun(); ++i) {
    const auto edge = edges.code(reader, static_cast<std::int64_t>(graph.nodes.size()), {});
    if (!edge)
      return fail(ErrorCode::invalid, "edge {} joins nodes {} and {} of {}", i, edges.a, edges.b, graph.nodes.size());
    graph.edges.push_back(*edge);
  }
  if (!code_last_seen(reader, graph.components, {}, [&](const LastSeen& seen) { graph.last_seen.push_back(seen); }))
    return fail(ErrorCode::invalid, "robot {} as last seen is out of range", graph.last_seen.size());
  if (!reader.in.finished())
    return fail(ErrorCode::parse, "body of {} bytes is {} than what it is said to hold", in.body().size(),
                reader.in.overrun() ? "shorter" : "longer");
  return {};
}

Status read_components(const v1::ProxyGraph& in, ProxyGraph& graph) {
  const bool sessions = in.component_session_size() > 0;  // none: all are 0
  if (in.component_size() != in.component_robot_size() ||
      (sessions && in.component_size() != in.component_session_size()))
    return fail(ErrorCode::parse, "{} components for {} robots and {} sessions", in.component_size(),
                in.component_robot_size(), in.component_session_size());
  for (int i = 0; i < in.component_size(); ++i)
    graph.components.push_back(
        {{RobotId{in.component_robot(i)}, sessions ? in.component_session(i) : 0}, in.component(i)});
  return {};
}

/// A robot's name in `graph`; empty where that is not known.
std::string_view name_in(const ProxyGraph& graph, RobotId robot) {
  const auto seen = std::ranges::find(graph.last_seen, robot, [](const LastSeen& one) { return one.chain.robot; });
  return seen == graph.last_seen.end() ? std::string_view() : seen->name;
}

/// Names seldom change, so a delta repeats none. (A name that was known and is not any more stays known.)
void write_names(const ProxyGraph& graph, const ProxyGraph& base, v1::ProxyGraph& out) {
  for (const LastSeen& seen : graph.last_seen)
    out.add_last_seen_name(seen.name == name_in(base, seen.chain.robot) ? std::string() : seen.name);
  if (std::ranges::all_of(out.last_seen_name(), &std::string::empty)) out.clear_last_seen_name();
}

/// Needs the graph's body.
Status read_names(const v1::ProxyGraph& in, const ProxyGraph& base, ProxyGraph& graph) {
  const auto named = static_cast<std::size_t>(in.last_seen_name_size());
  if (named != 0 && named != graph.last_seen.size())
    return fail(ErrorCode::parse, "{} names of {} robots last seen", named, graph.last_seen.size());
  for (std::size_t i = 0; i < graph.last_seen.size(); ++i) {
    LastSeen& seen = graph.last_seen[i];
    if (named != 0) seen.name = in.last_seen_name(static_cast<int>(i));
    if (seen.name.empty()) seen.name = name_in(base, seen.chain.robot);
  }
  return {};
}

/// `base`: an empty graph for a message that needs none.
std::string encode(const ProxyGraphMessage& message, MessageKind kind, const ProxyGraph& base) {
  expect_valid(validate(message));
  const ProxyGraph& graph = message.graph;
  v1::ProxyGraph out;
  out.mutable_header()->set_robot(message.header.robot.value);
  out.mutable_header()->set_session(message.header.session);
  out.mutable_header()->set_sequence(message.header.sequence);
  out.set_epoch(graph.epoch);
  out.set_revision(graph.revision);
  out.set_incarnation(graph.incarnation);
  out.set_radius_m(graph.radius_m);
  out.set_sigma_m(graph.sigma_m);
  out.set_reduced(graph.reduced);
  const std::vector<Run> runs = runs_of(graph);
  for (const Run& run : runs) {
    v1::RobotRun& entry = *out.add_run();
    entry.set_robot(run.chain.robot.value);
    entry.set_session(run.chain.session);
    entry.set_nodes(static_cast<std::uint32_t>(run.nodes));
    entry.set_eliminated(static_cast<std::uint32_t>(run.eliminated));
    entry.set_stamp_offset_ns(static_cast<std::int64_t>(run.clock.offset_ns));
    entry.set_stamp_step_ns(run.clock.step_ns);
    entry.set_uncertainty(run.has_uncertainty);
  }
  if (kind == MessageKind::proxy_graph_delta) {
    out.set_base_epoch(base.epoch);
    out.set_base_revision(base.revision);
  }
  write_body(graph, base, runs, out);
  write_names(graph, base, out);
  const bool sessions = std::ranges::any_of(graph.components, [](const auto& c) { return c.chain.session != 0; });
  for (const ChainComponent& component : graph.components) {
    out.add_component_robot(component.chain.robot.value);
    if (sessions) out.add_component_session(component.chain.session);
    out.add_component(component.component);
  }
  return pack_frame(kind, out.SerializeAsString());
}

Result<ProxyGraphMessage> decode(const v1::ProxyGraph& in, const ProxyGraph& base) {
  ProxyGraphMessage message;
  message.header = {RobotId{in.header().robot()}, in.header().session(), in.header().sequence()};
  ProxyGraph& graph = message.graph;
  graph.epoch = in.epoch();
  graph.revision = in.revision();
  graph.incarnation = in.incarnation();
  graph.radius_m = in.radius_m();
  graph.sigma_m = in.sigma_m();
  graph.reduced = in.reduced();
  const std::string where = fmt::format("proxy graph {}", graph.revision);
  const auto runs = read_runs(in);
  if (!runs) return in_context(where, runs.error());
  if (auto ok = read_components(in, graph); !ok) return in_context(where, ok.error());
  if (auto ok = read_body(in, base, *runs, graph); !ok) return in_context(where, ok.error());
  if (auto ok = read_names(in, base, graph); !ok) return in_context(where, ok.error());
  if (auto ok = validate(message); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace

std::string encode(const ProxyGraphMessage& message) { return encode(message, MessageKind::proxy_graph, {}); }

std::string encode_delta(const ProxyGraphMessage& message, const ProxyGraph& base) {
  TUTTI_CHECK(message.graph.incarnation == base.incarnation, "a base of another start");
  return encode(message, MessageKind::proxy_graph_delta, base);
}

Result<ProxyGraphMessage> decode_proxy_graph(std::string_view bytes) {
  const auto parsed = parse_frame<v1::ProxyGraph>(MessageKind::proxy_graph, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  return decode(*parsed, {});
}

Result<std::optional<ProxyGraphMessage>> decode_delta(std::string_view bytes, const ProxyGraph& base) {
  const auto parsed = parse_frame<v1::ProxyGraph>(MessageKind::proxy_graph_delta, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const bool is_of_base = std::pair(parsed->base_epoch(), parsed->base_revision()) == base.age() &&
                          parsed->incarnation() == base.incarnation;
  if (!is_of_base) return std::nullopt;
  return decode(*parsed, base);
}

}  // namespace tutti::wire
