// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_node.hpp"

#include <utility>

#include "tutti/node/submap_frames.hpp"
#include "tutti/wire/agent_state.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

constexpr const char* kCheckpoint = "checkpoint";
constexpr const char* kAgent = "agent";  // its one row
constexpr const char* kJournal = "journal";
constexpr const char* kOutbox = "outbox";
constexpr const char* kMeta = "meta";
constexpr const char* kRobot = "robot";  // whose store it is

}  // namespace

Result<std::unique_ptr<RobotNode>> RobotNode::open(RobotId robot, std::uint64_t session, const RobotNodeConfig& config,
                                                   Rng rng, const storage::TableStore& store) {
  const auto whose = store.read(kMeta, kRobot);
  if (!whose) return tl::unexpected(whose.error());
  if (*whose && **whose != storage::key_of({robot.value}))
    return fail(ErrorCode::invalid, "what is stored is another robot's than {}", robot.value);
  robot::AgentState state{.session = session};
  const auto checkpoint = store.read(kCheckpoint, kAgent);
  if (!checkpoint) return tl::unexpected(checkpoint.error());
  if (*checkpoint) {
    auto decoded = wire::decode_agent_state(**checkpoint);
    if (!decoded) return in_context(fmt::format("robot {}: checkpoint", robot.value), decoded.error());
    state = std::move(*decoded);
  }
  std::unique_ptr<RobotNode> node(new RobotNode(robot, config, std::move(rng), std::move(state)));
  node->is_new_ = !*checkpoint;
  Status ok = node->read_outbox(store);
  const auto hear = [&](std::string_view, std::string_view bytes) {
    const auto entry = decode_entry(bytes);
    ok = entry ? node->hear_again(*entry) : Status(tl::unexpected(entry.error()));
    return ok.has_value();
  };
  if (ok)
    if (auto scanned = store.scan(kJournal, {}, hear); !scanned) ok = scanned;
  if (!ok) return in_context(fmt::format("robot {}: what is stored", robot.value), ok.error());
  return node;
}

Status RobotNode::read_outbox(const storage::TableStore& store) {
  Status ok;
  const auto read = [&](std::string_view key, std::string_view frame) {
    const auto numbers = storage::numbers_of(key, 3);
    if (!numbers || (*numbers)[0] != agent_.robot().value) {
      ok = fail(ErrorCode::invalid, "a submap of somebody else in the outbox");
      return false;
    }
    const SubmapId id{{agent_.robot(), (*numbers)[1]}, static_cast<std::uint32_t>((*numbers)[2])};
    outbox_.insert(id);
    unsent_.emplace(id, frame);
    return true;
  };
  if (auto scanned = store.scan(kOutbox, {}, read); !scanned) return scanned;
  return ok;
}

/// No submap ends here: when one does, the journal goes in the same transaction.
Status RobotNode::hear_again(const JournalEntry& entry) {
  ++journal_;
  if (const auto* sample = std::get_if<OdometrySample>(&entry))
    return agent_.add_odometry(sample->stamp, sample->T_odom_body, sample->increment_covariance);
  if (const auto* scan = std::get_if<Scan>(&entry)) {
    last_scan_ = scan->stamp;
    return agent_.add_scan(*scan);
  }
  const auto& heard = std::get<HeardGraph>(entry);
  const auto message = wire::decode_proxy_graph(heard.frame);
  if (!message) return tl::unexpected(message.error());
  agent_.receive(*message, heard.budget);
  return {};
}

Step RobotNode::resume(Timestamp /*now*/) {
  Step step;
  if (std::exchange(is_new_, false) && config_.keeps_state) {
    step.writes.push_back({kMeta, kRobot, storage::key_of({agent_.robot().value})});
    save_checkpoint(step);
  }
  for (auto& [id, frame] : std::exchange(unsent_, {}))
    step.messages.push_back(submap_envelope(id, std::make_shared<const std::string>(std::move(frame))));
  return step;
}

Step RobotNode::add_odometry(const OdometrySample& sample, Timestamp now) {
  Step step;
  if (auto ok = agent_.add_odometry(sample.stamp, sample.T_odom_body, sample.increment_covariance); !ok) {
    step.tell(now, SampleRefused{agent_.robot(), ok.error().message});
    return step;
  }
  remember(sample, step);
  take_outgoing(now, step);
  return step;
}

Step RobotNode::add_scan(const Scan& scan, Timestamp now) {
  Step step;
  if (scan.stamp == last_scan_) return step;  // again
  if (auto ok = agent_.add_scan(scan); !ok) {
    step.tell(now, ScanRefused{agent_.robot(), ok.error().message});
    return step;
  }
  last_scan_ = scan.stamp;
  remember(scan, step);
  return step;
}

Step RobotNode::finish(Timestamp now) {
  Step step;
  agent_.finish();
  take_outgoing(now, step);
  return step;
}

void RobotNode::remember(const JournalEntry& entry, Step& step) {
  if (config_.keeps_state) step.writes.push_back({kJournal, storage::key_of({journal_++}), encode(entry)});
}

void RobotNode::save_checkpoint(Step& step) {
  if (!config_.keeps_state) return;
  step.writes.push_back({kCheckpoint, kAgent, wire::encode(agent_.state())});
  for (; journal_ > 0; --journal_) step.writes.push_back({kJournal, storage::key_of({journal_ - 1}), std::nullopt});
}

void RobotNode::take_outgoing(Timestamp now, Step& step) {
  const auto submaps = agent_.take_outgoing();
  for (const SubmapMessage& message : submaps) {
    if (const Status ok = wire::validate(message); !ok) {
      step.tell(now, MessageRefused{bus::Endpoint::of(agent_.robot()), bus::MessageKind::submap, ok.error().message});
      continue;
    }
    auto frame = std::make_shared<const std::string>(wire::encode(message, {.voxel_m = config_.agent.submap.voxel_m}));
    const SubmapId id = message.submap.id;
    if (config_.keeps_state) {
      outbox_.insert(id);
      step.writes.push_back({kOutbox, key_of(id), *frame});
    }
    step.messages.push_back(submap_envelope(id, std::move(frame)));
  }
  if (!submaps.empty()) save_checkpoint(step);
}

bus::Envelope RobotNode::submap_envelope(SubmapId id, std::shared_ptr<const std::string> frame) const {
  return {bus::Endpoint::of(agent_.robot()), bus::Endpoint::server(), bus::MessageKind::submap,
          fmt::format("{}/{}/{}", id.chain.robot.value, id.chain.session, id.index), std::move(frame)};
}

Step RobotNode::receive(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget) {
  Step step;
  if (envelope.kind == bus::MessageKind::proxy_graph)
    receive_graph(envelope, now, budget, step);
  else if (envelope.kind == bus::MessageKind::receipt)
    receive_receipt(envelope, now, step);
  else
    step.tell(now, MessageRefused{envelope.from, envelope.kind, "not for a robot"});
  return step;
}

void RobotNode::receive_graph(const bus::Envelope& envelope, Timestamp now, std::optional<std::size_t> budget,
                              Step& step) {
  const auto message = wire::decode_proxy_graph(*envelope.bytes);
  if (!message) {
    step.tell(now, MessageRefused{envelope.from, envelope.kind, message.error().message});
    return;
  }
  if (!agent_.is_news(message->graph)) return;
  remember(HeardGraph{*envelope.bytes, budget}, step);
  step.tell(now, RobotUpdated{agent_.robot(), agent_.receive(*message, budget, observer_)});
}

void RobotNode::receive_receipt(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto receipt = wire::decode_receipt(*envelope.bytes);
  if (!receipt || receipt->robot != agent_.robot()) {
    const std::string why = receipt ? "a receipt for another robot" : receipt.error().message;
    step.tell(now, MessageRefused{envelope.from, envelope.kind, why});
    return;
  }
  std::erase_if(outbox_, [&](SubmapId id) {
    if (!receipt->contains(id)) return false;
    step.writes.push_back({kOutbox, key_of(id), std::nullopt});
    return true;
  });
}

}  // namespace tutti::node
