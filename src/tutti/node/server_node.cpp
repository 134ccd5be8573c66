// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/server_node.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

constexpr const char* kMeta = "meta";
constexpr const char* kMap = "map";  // the one row of `meta` that is the node's own

std::string key_of(const SubmapPair& pair) { return node::key_of(pair.first) + node::key_of(pair.second); }

bus::Envelope to_robot(RobotId robot, bus::MessageKind kind, std::shared_ptr<const std::string> bytes) {
  return {bus::Endpoint::server(), bus::Endpoint::of(robot), kind, {}, std::move(bytes)};
}

/// The first multiple of the period that is not before `now`.
Timestamp next_update(Timestamp now, double period_s) {
  return Timestamp{} + std::ceil((now - Timestamp{}) / period_s - 1e-9) * period_s;
}

/// Rows of a table, decoded; the first error ends it.
template <class Decode, class Take>
Status read_rows(const storage::TableStore& store, const char* table, Decode&& decode, Take&& take) {
  Status ok;
  const auto visit = [&](std::string_view, std::string_view bytes) {
    auto decoded = decode(bytes);
    if (!decoded)
      ok = in_context(fmt::format("the map's table '{}'", table), decoded.error());
    else
      take(std::move(*decoded));
    return ok.has_value();
  };
  if (auto scanned = store.scan(table, {}, visit); !scanned) return scanned;
  return ok;
}

}  // namespace

struct ServerNode::Opened {
  server::MapServerState state;
  std::map<RobotId, Receipt> receipts;
  std::uint64_t epoch = 0;
  std::uint64_t start = 0;
  bool news = false;

  static Result<Opened> from(const storage::TableStore& store, std::uint32_t finder_version);

 private:
  void add(SubmapMessage message);
  void add(ClosureVerdict verdict);
};

void ServerNode::Opened::add(SubmapMessage message) {
  const SubmapId id = message.submap.id;
  if (message.submap.cloud != nullptr && !message.submap.cloud->points.empty())
    state.cloud_sizes[id] = message.submap.cloud->points.size();
  message.submap.cloud.reset();
  state.submaps[id] = std::make_shared<const Submap>(std::move(message.submap));
  state.answered.add_submap(id);
  Receipt& receipt = receipts[id.chain.robot];
  receipt.robot = id.chain.robot;
  receipt.stored[id.chain.session].insert(id.index);
}

/// As MapServer::take() leaves it: the answers of older finders hold until the pair is asked again, but their refusals
/// need not be known.
void ServerNode::Opened::add(ClosureVerdict verdict) {
  const SubmapPair pair = verdict.pair;
  const bool counts = verdict.refusal && verdict.finder_version == state.finder_version;
  if (verdict.finder_version < state.finder_version) {
    if (!verdict.refusal) state.verdicts.insert_or_assign(pair, std::move(verdict));
    return;
  }
  if (state.answered.contains(pair) && verdict.refusal) return;
  state.answered.insert(pair);
  if (counts)
    count_refusal(*verdict.refusal, pair.first.chain.robot, pair.second.chain.robot, state.refused);
  else
    state.verdicts.insert_or_assign(pair, std::move(verdict));
}

Result<ServerNode::Opened> ServerNode::Opened::from(const storage::TableStore& store, std::uint32_t finder_version) {
  Opened opened;
  opened.state.finder_version = finder_version;
  const auto meta = store.read(kMeta, kMap);
  if (!meta) return tl::unexpected(meta.error());
  if (!*meta) return opened;
  const auto numbers = storage::numbers_of(**meta, 4);
  if (!numbers) return fail(ErrorCode::parse, "the map's own row has {} bytes, expected 32", (*meta)->size());
  opened.epoch = (*numbers)[0];
  opened.state.revision = (*numbers)[1];
  opened.news = (*numbers)[2] != 0;
  opened.start = (*numbers)[3];
  const auto add = [&](auto decoded) { opened.add(std::move(decoded)); };
  const auto add_refusals = [&](Verdicts answer) {
    for (ClosureVerdict& verdict : answer.verdicts) opened.add(std::move(verdict));
  };
  if (auto ok = read_rows(store, "submaps", wire::decode_submap, add); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_rows(store, "verdicts", wire::decode_verdict, add); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_rows(store, "answers", wire::decode_verdicts, add_refusals); !ok)
    return tl::unexpected(ok.error());
  return opened;
}

Result<std::unique_ptr<ServerNode>> ServerNode::open(std::set<RobotId> robots,
                                                     std::shared_ptr<const server::ClosureFinder> finder,
                                                     const ServerNodeConfig& config, std::uint64_t epoch,
                                                     const storage::TableStore& store) {
  TUTTI_CHECK(finder != nullptr && epoch > 0, "no finder or no epoch");
  TUTTI_CHECK(config.pairs_per_job > 0, "jobs of no pairs");
  auto opened = Opened::from(store, finder->version());
  if (!opened) return tl::unexpected(opened.error());
  if (opened->epoch > 0) epoch = opened->epoch;
  return std::unique_ptr<ServerNode>(
      new ServerNode(std::move(robots), std::move(finder), config, epoch, SubmapFrames::of(store), std::move(*opened)));
}

ServerNode::ServerNode(std::set<RobotId> robots, std::shared_ptr<const server::ClosureFinder> finder,
                       const ServerNodeConfig& config, std::uint64_t epoch, std::shared_ptr<SubmapFrames> clouds,
                       Opened opened)
    : robots_(robots),
      config_(config),
      server_(std::move(robots), std::move(finder), std::move(clouds), config.server, epoch, std::move(opened.state)),
      receipts_(std::move(opened.receipts)),
      start_(opened.start + 1),
      had_news_(opened.news) {}

storage::Write ServerNode::meta() const {
  const server::MapServerState& state = server_.state();
  return {kMeta, kMap, storage::key_of({state.epoch, state.revision, server_.has_news() ? 1U : 0U, start_})};
}

Step ServerNode::resume(Timestamp now) {
  Step step;
  const bool is_whole = server_.state().revision > 0 && !had_news_;
  if (is_whole) send_graph(server_.rebuild(), step);
  if (server_.has_news()) timer_ = next_update(now, config_.server.update_period_s);
  step.writes.push_back(meta());
  for (const auto& [robot, receipt] : receipts_) send_receipt(robot, step);
  send_jobs(std::nullopt, step);
  return step;
}

Step ServerNode::receive(const bus::Envelope& envelope, Timestamp now) {
  Step step;
  const bool before = server_.has_news();
  if (envelope.kind == bus::MessageKind::submap)
    receive_submap(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::verdicts)
    receive_verdicts(envelope, now, step);
  else
    step.tell(now, MessageRefused{envelope.from, envelope.kind, "not for a server"});
  for (const Error& error : server_.take_late_errors())
    step.tell(now, MessageRefused{envelope.from, bus::MessageKind::verdicts, error.message});
  note_news(now, before, step);
  return step;
}

void ServerNode::note_news(Timestamp now, bool before, Step& step) {
  if (before == server_.has_news()) return;
  timer_ = next_update(now, config_.server.update_period_s);
  step.writes.push_back(meta());
}

void ServerNode::receive_submap(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto refuse = [&](const Error& error) {
    step.tell(now, MessageRefused{envelope.from, envelope.kind, error.message});
  };
  const auto message = wire::decode_submap(*envelope.bytes);
  if (!message) return refuse(message.error());
  const SubmapId id = message->submap.id;
  if (envelope.from.robot() != id.chain.robot)
    return refuse({ErrorCode::unknown_robot, fmt::format("submap {} from somebody else", to_string(id))});
  const bool is_new = !server_.state().submaps.contains(id);
  if (const Status taken = server_.receive(*message); !taken) return refuse(taken.error());
  Receipt& receipt = receipts_[id.chain.robot];
  receipt.robot = id.chain.robot;
  receipt.stored[id.chain.session].insert(id.index);
  if (is_new) {
    step.writes.push_back({"submaps", key_of(id), *envelope.bytes});
    step.tell(now, SubmapStored{id});
  }
  send_receipt(id.chain.robot, step);
  send_jobs(id, step);
}

void ServerNode::receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto answer = wire::decode_verdicts(*envelope.bytes);
  if (!answer) {
    step.tell(now, MessageRefused{envelope.from, envelope.kind, answer.error().message});
    return;
  }
  Verdicts refused{.job = answer->job, .verdicts = {}, .failed = {}, .why = {}};
  for (const ClosureVerdict& verdict : answer->verdicts)
    if (const Status taken = take(verdict, refused, step); !taken)
      step.tell(now, MessageRefused{envelope.from, envelope.kind, taken.error().message});
  if (!refused.verdicts.empty()) step.writes.push_back({"answers", answer->job, wire::encode(refused)});
  const server::SubmapSet& submaps = server_.state().submaps;
  for (const SubmapPair& pair : answer->failed) {
    const auto first = submaps.find(pair.first), second = submaps.find(pair.second);
    if (first == submaps.end() || second == submaps.end()) continue;
    step.tell(now, VerificationFailed{pair, answer->why});
    server_.give_back({pair, first->second, second->second});
  }
  step.tell(now, VerdictsTaken{answer->job, answer->verdicts.size()});
}

Status ServerNode::take(const ClosureVerdict& verdict, Verdicts& refused, Step& step) {
  const server::VerdictSet& kept = server_.state().verdicts;
  const auto find = [&]() -> std::optional<ClosureVerdict> {
    const auto found = kept.find(verdict.pair);
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  };
  const auto before = find();
  const bool was_answered = server_.state().answered.contains(verdict.pair);
  if (auto ok = server_.receive(verdict); !ok) return ok;
  const auto after = find();
  const bool is_answered = server_.state().answered.contains(verdict.pair);
  if (before != after) {
    std::optional<std::string> row;
    if (after) row = wire::encode(*after);
    step.writes.push_back({"verdicts", key_of(verdict.pair), std::move(row)});
  }
  if (verdict.refusal && !after && (before || was_answered != is_answered)) refused.verdicts.push_back(verdict);
  return {};
}

/// A job is one submap against others: `newest`, if it is in the pair.
void ServerNode::send_jobs(std::optional<SubmapId> newest, Step& step) {
  std::map<SubmapId, std::vector<SubmapPair>> pairs;
  for (const server::VerificationJob& job : server_.take_jobs())
    pairs[job.pair.first == newest ? job.pair.first : job.pair.second].push_back(job.pair);
  for (const auto& [submap, of_it] : pairs)
    for (std::size_t first = 0; first < of_it.size(); first += config_.pairs_per_job) {
      const std::size_t last = std::min(of_it.size(), first + config_.pairs_per_job);
      const auto at = [&](std::size_t i) { return of_it.begin() + static_cast<std::ptrdiff_t>(i); };
      const Job job{.id = fmt::format("{}/{}", start_, jobs_++), .pairs = {at(first), at(last)}};
      step.messages.push_back({bus::Endpoint::server(), bus::Endpoint::any_worker(), bus::MessageKind::job, job.id,
                               std::make_shared<const std::string>(wire::encode(job))});
    }
}

void ServerNode::send_receipt(RobotId robot, Step& step) const {
  step.messages.push_back(to_robot(robot, bus::MessageKind::receipt,
                                   std::make_shared<const std::string>(wire::encode(receipts_.at(robot)))));
}

void ServerNode::send_graph(const ProxyGraphMessage& message, Step& step) {
  broadcast_ = message.graph;
  const auto encoded = [](const ProxyGraphMessage& part) {
    return std::make_shared<const std::string>(wire::encode(part));
  };
  const bool is_own = config_.server.broadcast == "own";
  const auto whole = is_own ? nullptr : encoded(message);
  for (const RobotId robot : robots_)
    step.messages.push_back(
        to_robot(robot, bus::MessageKind::proxy_graph,
                 is_own ? encoded({message.header, consistency::own_part(message.graph, robot)}) : whole));
}

Step ServerNode::on_timer(Timestamp now) {
  Step step;
  if (!timer_ || now < *timer_) return step;
  timer_.reset();
  send_graph(server_.optimise(), step);
  step.writes.push_back(meta());
  const auto accepted = std::ranges::count_if(server_.map().closures, &server::JudgedClosure::accepted);
  step.tell(now,
            MapUpdated{server_.state().revision, server_.state().submaps.size(), static_cast<std::size_t>(accepted)});
  return step;
}

}  // namespace tutti::node
