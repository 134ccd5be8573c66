// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/estimate_file.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_bytes.hpp"
#include "tutti/wire/frame.hpp"

namespace tutti::mapfile {
namespace {

constexpr std::size_t kMost = 10'000'000;  // rows of one kind

struct KeyframeRow {
  KeyframeId id;
  template <class V>
  void describe(V& v) {
    v.field(1, "robot", id.chain.robot);
    v.field(2, "session", id.chain.session);
    v.field(3, "index", id.index);
  }
};

struct NodeRow {
  KeyframeRow at;
  std::uint32_t component = 0;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    at.describe(v);
    v.field(4, "component", component);
  }
};

struct ClosureRow {
  KeyframeId from, to;
  bool accepted = false, by_operator = false;
  std::uint32_t objection = 0;
  double paid = 0.0, most = 0.0;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "from_robot", from.chain.robot);
    v.field(2, "from_session", from.chain.session);
    v.field(3, "from_index", from.index);
    v.field(4, "to_robot", to.chain.robot);
    v.field(5, "to_session", to.chain.session);
    v.field(6, "to_index", to.index);
    v.field(7, "accepted", accepted);
    v.field(8, "by_operator", by_operator);
    v.field(9, "objection", objection);
    v.field(10, "paid", paid);
    v.field(11, "most", most);
  }
};

struct FailedRow {
  KeyframeRow from;
  std::uint32_t to = 0;
  double jump_m = 0.0, jump_rad = 0.0;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    from.describe(v);
    v.field(4, "to", to);
    v.field(5, "jump_m", jump_m);
    v.field(6, "jump_rad", jump_rad);
  }
};

struct Rows {
  std::uint64_t epoch = 0, revision = 0;
  Timestamp time;
  std::uint32_t components = 0;
  std::vector<NodeRow> nodes;
  std::vector<double> poses;  // seven of each node
  std::vector<ClosureRow> closures;
  std::vector<double> measurements;  // 28 of each closure: its pose, the upper triangle of its covariance
  std::vector<FailedRow> failed;
  std::string broadcast;  // a frame; empty: there was none
  template <class V>
  void describe(V& v) {
    v.field(1, "epoch", epoch);
    v.field(2, "revision", revision);
    v.field(3, "time", time);
    v.field(4, "components", components);
    v.field(5, "nodes", nodes, {.at_most = kMost});
    v.field(6, "poses", poses, {.at_most = 7 * kMost});
    v.field(7, "closures", closures, {.at_most = kMost});
    v.field(8, "measurements", measurements, {.at_most = 28 * kMost});
    v.field(9, "failed", failed, {.at_most = kMost});
    v.field(10, "broadcast", broadcast);
  }
};

constexpr std::size_t kPose = wire::kNumbers<Pose3>, kCovariance = wire::kNumbers<Matrix6d>;

template <class T>
void append(const T& value, std::vector<double>& numbers) {
  wire::each_number(value, [&](double x) { numbers.push_back(x); });
}

template <class T>
void take(T& value, const double*& next) {
  wire::each_number(value, [&](double& x) { x = *next++; });
}

Status check(const Rows& rows) {
  if (rows.poses.size() != kPose * rows.nodes.size() ||
      rows.measurements.size() != (kPose + kCovariance) * rows.closures.size())
    return fail(ErrorCode::parse, "estimate: {} nodes with {} numbers, {} closures with {}", rows.nodes.size(),
                rows.poses.size(), rows.closures.size(), rows.measurements.size());
  const auto is_finite = [](double x) { return std::isfinite(x); };
  if (!std::ranges::all_of(rows.poses, is_finite) || !std::ranges::all_of(rows.measurements, is_finite))
    return fail(ErrorCode::parse, "estimate: a pose that is not finite");
  if (!std::ranges::is_sorted(rows.nodes, {}, [](const NodeRow& row) { return row.at.id; }))
    return fail(ErrorCode::parse, "estimate: nodes that are not sorted");
  return {};
}

server::MapEstimate map_of(const Rows& rows) {
  server::MapEstimate out;
  const double* next = rows.poses.data();
  for (const NodeRow& row : rows.nodes) {
    MapNode& node = out.nodes.emplace_back(MapNode{.id = row.at.id, .component = row.component});
    take(node.T_world_body, next);
  }
  next = rows.measurements.data();
  for (const ClosureRow& row : rows.closures) {
    server::JudgedClosure& judged = out.closures.emplace_back(
        server::JudgedClosure{.closure = {.from = row.from, .to = row.to, .measurement = {}},
                              .accepted = row.accepted,
                              .by_operator = row.by_operator,
                              .objection = static_cast<judge::Objection>(
                                  std::min(row.objection, static_cast<std::uint32_t>(judge::Objection::no_map))),
                              .price = {row.paid, row.most}});
    take(judged.closure.measurement.T_a_b, next);
    take(judged.closure.measurement.covariance, next);
  }
  for (const FailedRow& row : rows.failed)
    out.failed_odometry.push_back({row.from.id.chain, row.from.id.index, row.to, row.jump_m, row.jump_rad});
  out.components = rows.components;
  return out;
}

}  // namespace

std::string encode_estimate(const ComputedMap& computed) {
  Rows rows{.epoch = computed.epoch,
            .revision = computed.revision,
            .time = computed.time,
            .components = computed.map.components};
  for (const MapNode& node : computed.map.nodes) {
    rows.nodes.push_back({{node.id}, node.component});
    append(node.T_world_body, rows.poses);
  }
  for (const server::JudgedClosure& judged : computed.map.closures) {
    rows.closures.push_back({judged.closure.from, judged.closure.to, judged.accepted, judged.by_operator,
                             static_cast<std::uint32_t>(judged.objection), judged.price.paid, judged.price.most});
    append(judged.closure.measurement.T_a_b, rows.measurements);
    append(judged.closure.measurement.covariance, rows.measurements);
  }
  for (const server::FailedOdometry& failed : computed.map.failed_odometry)
    rows.failed.push_back({{{failed.chain, failed.from}}, failed.to, failed.jump_m, failed.jump_rad});
  if (!computed.broadcast.nodes.empty())
    rows.broadcast = wire::encode(ProxyGraphMessage{.header = {}, .graph = computed.broadcast});
  return wire::pack_frame(wire::MessageKind::estimate, wire::field_bytes(rows));
}

Result<ComputedMap> decode_estimate(std::string_view bytes) {
  const auto frame = wire::unpack_frame(wire::MessageKind::estimate, bytes);
  if (!frame) return tl::unexpected(frame.error());
  const auto rows = wire::read_fields<Rows>(*frame);
  if (!rows) return in_context("estimate", rows.error());
  if (Status ok = check(*rows); !ok) return tl::unexpected(ok.error());
  ComputedMap out{
      .epoch = rows->epoch, .revision = rows->revision, .time = rows->time, .map = map_of(*rows), .broadcast = {}};
  if (rows->broadcast.empty()) return out;
  auto graph = wire::decode_proxy_graph(rows->broadcast);
  if (!graph) return in_context("estimate", graph.error());
  out.broadcast = std::move(graph->graph);
  return out;
}

}  // namespace tutti::mapfile
