// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/columns.hpp"
#include "tutti/wire/internal/integer_coder.hpp"
#include "tutti/wire/internal/logarithm.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/quantise.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr double kLogWeightStep = 1.0 / 2048.0;

/// The stamps of one chain are multiples of a step after an offset: sensors are regular. Differences wrap around.
struct Clock {
  std::uint64_t offset_ns = 0;
  std::uint64_t step_ns = 1;
};

/// One chain's part of the graph.
struct Run {
  ChainId chain;
  Clock clock;
  std::size_t nodes = 0;
  std::size_t eliminated = 0;
  bool has_uncertainty = false;
};

// One routine serves both ways, so that they cannot differ: it hands each number to code(model, number), which writes
// and returns it, or ignores it and returns the one read.
struct Writer {
  RangeEncoder out;
  std::int64_t code(IntegerModel& model, std::int64_t value) {
    model.put(out, value);
    return value;
  }
};
struct Reader {
  RangeDecoder in;
  std::int64_t code(IntegerModel& model, std::int64_t) { return model.get(in); }
};

/// Stamps of one chain, each by its distance to the one before.
class StampColumn {
 public:
  void start_run() { previous_ = 0; }
  template <class Coder>
  Timestamp code(Coder& coder, const Clock& clock, Timestamp stamp) {
    const std::uint64_t tick = (static_cast<std::uint64_t>(stamp.ns) - clock.offset_ns) / clock.step_ns;
    previous_ += static_cast<std::uint64_t>(coder.code(model_, static_cast<std::int64_t>(tick - previous_)));
    return {static_cast<std::int64_t>(clock.offset_ns + previous_ * clock.step_ns)};
  }

 private:
  IntegerModel model_;
  std::uint64_t previous_ = 0;
};

/// Nodes of one chain along its way. A pose is coded as the motion since the node before *as the receiver knows it*, so
/// errors do not add up.
class NodeColumns {
 public:
  void start_run() {
    stamps_.start_run();
    T_world_previous_ = Pose3();
  }
  /// Nothing when a number is outside what encoding makes.
  template <class Coder>
  std::optional<ProxyNode> code(Coder& coder, const Run& run, const ProxyNode& node) {
    const Timestamp stamp = stamps_.code(coder, run.clock, node.stamp);
    PoseCode motion = quantise(T_world_previous_.inverse() * node.T_world_body, kProxyPoseSteps);
    for (std::size_t i = 0; i < motion.size(); ++i) motion[i] = coder.code(motion_[i], motion[i]);
    CovarianceCode covariance = quantise(node.covariance, kProxyCovarianceSteps);
    std::int64_t change = 0;  // variances grow and shrink together
    for (std::size_t i = 0; i < covariance.size(); ++i) {
      const std::int64_t expected = sum(previous_covariance_[i], i < 6 ? change : 0);
      covariance[i] = sum(expected, coder.code(covariance_[i], difference(covariance[i], expected)));
      change = difference(covariance[i], previous_covariance_[i]);
    }
    previous_covariance_ = covariance;

    const auto T_previous_body = dequantise(motion, kProxyPoseSteps);
    const auto matrix = dequantise(covariance, kProxyCovarianceSteps);
    if (!T_previous_body || !matrix) return std::nullopt;
    T_world_previous_ = T_world_previous_ * *T_previous_body;
    if (T_world_previous_.translation.cwiseAbs().maxCoeff() > kMaxCoordinate_m + 1.0) return std::nullopt;
    return ProxyNode{run.chain, stamp, T_world_previous_, *matrix};
  }

 private:
  StampColumn stamps_;
  std::array<IntegerModel, 6> motion_;
  std::array<IntegerModel, 21> covariance_;
  Pose3 T_world_previous_;
  CovarianceCode previous_covariance_{};
};

/// Edges, in few bits when sorted. The logarithm of the weight is rounded; 0 stays 0.
class EdgeColumns {
 public:
  /// Nothing when an end is not one of the `nodes`.
  template <class Coder>
  std::optional<ProxyEdge> code(Coder& coder, std::int64_t nodes, const ProxyEdge& edge) {
    const std::int64_t step = coder.code(a_, edge.a - a);
    a = sum(a, step);
    const std::int64_t from = step == 0 ? b : a;
    b = sum(from, coder.code(step == 0 ? next_b_ : first_b_, edge.b - from));
    if (a < 0 || a >= nodes || b < 0 || b >= nodes) return std::nullopt;
    ProxyEdge out{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), 0.0};
    if (coder.code(positive_, edge.weight > 0.0 ? 1 : 0) == 0) return out;
    log_weight = sum(log_weight, coder.code(log_weight_, difference(rounded_log(edge.weight), log_weight)));
    out.weight = std::exp(static_cast<double>(log_weight) * kLogWeightStep);
    return out;
  }
  std::int64_t a = 0, b = 0, log_weight = 0;  ///< Of the last edge.

 private:
  static std::int64_t rounded_log(double weight) {
    constexpr double kMax = 88.7;  // clear of the largest float
    return weight > 0.0 ? std::llround(std::min(std::log(weight), kMax) / kLogWeightStep) : 0;
  }
  IntegerModel a_, first_b_, next_b_, positive_, log_weight_;
};

/// Uncertainties: `whole`, then scale after scale, the sigmas each by their difference to the block before, then the
/// directions, then what is doubted.
class UncertaintyColumns {
 public:
  /// Nothing when a number is outside what encoding makes.
  template <class Coder>
  std::optional<ChainUncertainty> code(Coder& coder, const Run& run, const ChainUncertainty& in) {
    ChainUncertainty out{.chain = run.chain};
    SigmaCode previous{};
    if (!code(coder, whole_, in.whole, previous, out.whole)) return std::nullopt;
    const auto scales = coder.code(count_, static_cast<std::int64_t>(in.scales.size()));
    if (scales < 0 || scales > static_cast<std::int64_t>(ChainUncertainty::kMostScales)) return std::nullopt;
    for (std::size_t s = 0; s < static_cast<std::size_t>(scales); ++s) {
      const ScaleUncertainty scale = s < in.scales.size() ? in.scales[s] : ScaleUncertainty{};
      auto& made = out.scales.emplace_back();
      if (coder.code(has_sigma_, scale.sigma.empty() ? 0 : 1) == 0) continue;
      if (!code(coder, scale.position, made.position) || !code(coder, scale.rotation, made.rotation))
        return std::nullopt;
      for (std::size_t b = 0; b < ChainUncertainty::blocks(run.nodes); ++b) {
        const PoseSigma sigma = scale.sigma.empty() ? PoseSigma{} : scale.sigma[b];
        if (!code(coder, b == 0 ? first_ : next_, sigma, previous, made.sigma.emplace_back())) return std::nullopt;
      }
    }
    const auto directions = coder.code(count_, static_cast<std::int64_t>(in.directions.size()));
    if (directions < 0 || directions > static_cast<std::int64_t>(ChainUncertainty::kMostDirections))
      return std::nullopt;
    for (std::size_t d = 0; d < static_cast<std::size_t>(directions); ++d)
      if (!code(coder, run, d < in.directions.size() ? in.directions[d] : KnownDirection{},
                out.directions.emplace_back()))
        return std::nullopt;
    if (coder.code(doubted_, in.doubted ? 1 : 0) == 0) return out;
    if (!code(coder, run, in.doubted ? *in.doubted : KnownDirection{}, out.doubted.emplace())) return std::nullopt;
    return out;
  }

 private:
  static constexpr int kSigmaSteps = 8;
  static constexpr int kFineSteps = 1024;
  using SigmaCode = std::array<std::int64_t, 2>;
  using Models = std::array<IntegerModel, 2>;
  /// `previous` becomes this one's code.
  template <class Coder>
  static bool code(Coder& coder, Models& models, const PoseSigma& sigma, SigmaCode& previous, PoseSigma& out) {
    const SigmaCode wanted{quantise_log(sigma.position_m, kSigmaSteps), quantise_log(sigma.rotation_rad, kSigmaSteps)};
    for (std::size_t k = 0; k < 2; ++k)
      previous[k] = sum(previous[k], coder.code(models[k], difference(wanted[k], previous[k])));
    const auto position_m = dequantise_log(previous[0], kSigmaSteps);
    const auto rotation_rad = dequantise_log(previous[1], kSigmaSteps);
    if (position_m && rotation_rad) out = {*position_m, *rotation_rad};
    return position_m && rotation_rad;
  }
  template <class Coder>
  bool code_fine(Coder& coder, double value, double& out) {
    const auto made = dequantise_log(coder.code(fine_, quantise_log(value, kFineSteps)), kFineSteps);
    if (made) out = *made;
    return made.has_value();
  }
  template <class Coder>
  bool code(Coder& coder, const Energy& energy, Energy& out) {
    return code_fine(coder, energy.mean, out.mean) && code_fine(coder, energy.degrees, out.degrees);
  }
  template <class Coder>
  bool code(Coder& coder, const Run& run, const KnownDirection& in, KnownDirection& out) {
    if (!code_fine(coder, in.rotation_scale, out.rotation_scale) || !code_fine(coder, in.sigma, out.sigma))
      return false;
    const std::size_t spread = ChainUncertainty::spread(run.nodes).size();
    for (std::size_t i = 0; i + 3 < 3 * spread; ++i)
      for (const auto member : {&KnownDirection::position, &KnownDirection::rotation}) {
        const auto number = coder.code(number_, i < (in.*member).size() ? (in.*member)[i] : 0);
        if (number < -127 || number > 127) return false;
        (out.*member).push_back(static_cast<std::int8_t>(number));
      }
    return true;
  }
  Models whole_, first_, next_;
  IntegerModel count_, has_sigma_, doubted_, fine_, number_;
};

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
    add(LastSeen{entry.chain, {stamp_ns}, *T_world_body});
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

void write_body(const ProxyGraph& graph, const std::vector<Run>& runs, v1::ProxyGraph& out) {
  Writer writer;
  NodeColumns nodes;
  StampColumn eliminated;
  UncertaintyColumns uncertainties;
  auto node = graph.nodes.begin();
  auto gone = graph.eliminated.begin();
  auto uncertainty = graph.uncertainties.begin();
  for (const Run& run : runs) {
    nodes.start_run();
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
Status read_body(const v1::ProxyGraph& in, const std::vector<Run>& runs, ProxyGraph& graph) {
  if (in.edges() > kMaxProxyEdges)
    return fail(ErrorCode::invalid, "{} edges, at most {} are accepted", in.edges(), kMaxProxyEdges);
  Reader reader{RangeDecoder(in.body())};
  NodeColumns nodes;
  StampColumn eliminated;
  UncertaintyColumns uncertainties;
  for (const Run& run : runs) {
    nodes.start_run();
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

}  // namespace

std::string encode(const ProxyGraphMessage& message) {
  const Status valid = validate(message);
  TUTTI_CHECK(valid.has_value(), "{}", valid.error().message);
  const ProxyGraph& graph = message.graph;
  v1::ProxyGraph out;
  out.mutable_header()->set_robot(message.header.robot.value);
  out.mutable_header()->set_session(message.header.session);
  out.mutable_header()->set_sequence(message.header.sequence);
  out.set_epoch(graph.epoch);
  out.set_revision(graph.revision);
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
  write_body(graph, runs, out);
  const bool sessions = std::ranges::any_of(graph.components, [](const auto& c) { return c.chain.session != 0; });
  for (const ChainComponent& component : graph.components) {
    out.add_component_robot(component.chain.robot.value);
    if (sessions) out.add_component_session(component.chain.session);
    out.add_component(component.component);
  }
  return pack_frame(MessageKind::proxy_graph, out.SerializeAsString());
}

Result<ProxyGraphMessage> decode_proxy_graph(std::string_view bytes) {
  const auto parsed = parse_frame<v1::ProxyGraph>(MessageKind::proxy_graph, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::ProxyGraph& in = parsed->message;

  ProxyGraphMessage message;
  message.header = {RobotId{in.header().robot()}, in.header().session(), in.header().sequence()};
  ProxyGraph& graph = message.graph;
  graph.epoch = in.epoch();
  graph.revision = in.revision();
  graph.radius_m = in.radius_m();
  graph.sigma_m = in.sigma_m();
  graph.reduced = in.reduced();
  const std::string where = fmt::format("proxy graph {}", graph.revision);
  const auto runs = read_runs(in);
  if (!runs) return in_context(where, runs.error());
  if (auto ok = read_components(in, graph); !ok) return in_context(where, ok.error());
  if (auto ok = read_body(in, *runs, graph); !ok) return in_context(where, ok.error());
  if (auto ok = validate(message); !ok) return tl::unexpected(ok.error());
  return message;
}

}  // namespace tutti::wire
