// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_node.hpp"

#include <algorithm>
#include <ranges>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/internal/stored_robot.hpp"
#include "tutti/node/robot_tables.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::node {

using namespace robot_tables;  // NOLINT

namespace {

/// The event of an input that the agent refuses.
struct Refuse {
  using What = decltype(Event::what);
  RobotId robot;
  std::string why;
  What operator()(const Scan& /*scan*/) const { return ScanRefused{robot, why}; }
  What operator()(const TrackedImages& /*images*/) const { return ImagesRefused{robot, why}; }
  What operator()(const PositionFix& /*fix*/) const { return FixRefused{robot, why}; }
  What operator()(const RobotRange& /*range*/) const { return SampleRefused{robot, why}; }
  What operator()(const OdometrySample& /*sample*/) const { return SampleRefused{robot, why}; }
  What operator()(const FedOnly auto& /*sample*/) const { return SampleRefused{robot, why}; }
};

}  // namespace

Result<std::unique_ptr<RobotNode>> RobotNode::open(RobotId robot, std::uint64_t session, const RobotNodeConfig& config,
                                                   const storage::TableStore& store) {
  const auto stored = internal::read_stored(robot, store);
  if (!stored) return tl::unexpected(stored.error());
  const wire::StateRows& rows = stored->checkpoint;
  const std::uint64_t next = stored->newest_session == 0 ? session : std::max(session, stored->newest_session + 1);
  const auto make = [&](robot::AgentState state) {
    return std::unique_ptr<RobotNode>(new RobotNode(robot, config, std::move(state), store));
  };
  std::unique_ptr<RobotNode> node;
  Status readable = stored->lost ? Status(fail(ErrorCode::parse, "{}", *stored->lost)) : Status();
  if (rows.empty()) {
    node = make({{.session = next}});
  } else if (auto state = wire::decode_state_rows(rows)) {
    wire::StoredState written = wire::stored_state(*state);
    node = make(std::move(*state));
    node->stored_ = std::move(written);
  } else {
    readable = in_context("checkpoint", state.error());
  }
  std::uint64_t entries = 0;
  const auto hear = [&](std::string_view, std::string_view bytes) {
    ++entries;
    if (!readable) return true;
    const auto entry = decode_entry(bytes);
    readable = entry ? node->hear_again(*entry) : Status(tl::unexpected(entry.error()));
    if (!readable) readable = in_context("journal", readable.error());
    return true;
  };
  if (auto scanned = store.scan(kJournal, {}, hear); !scanned) return tl::unexpected(scanned.error());
  if (!readable) {
    node = make({{.session = std::max(session + 1, next)}});
    if (Status aside = node->set_aside(rows, stored->newest_session); !aside) return tl::unexpected(aside.error());
    node->why_lost_ = readable.error().message;
  }
  for (const auto& [key, bytes] : rows) node->rows_.insert(key);
  node->gate_ = OdometryGate(robot, node->agent_.newest_sample());
  node->journal_ = entries;
  node->is_new_ = rows.empty() || !readable;
  node->starts_ = stored->starts + 1;
  if (Status ok = node->read_outbox(); !ok)
    return in_context(fmt::format("robot {}: what is stored", robot.value), ok.error());
  return node;
}

/// A row whose key is no submap's is another version's, and stays as it is.
Status RobotNode::read_outbox() {
  Status ok;
  std::map<SubmapId, std::size_t> kept;
  const auto id_of = [&](std::string_view key) {
    const auto id = submap_of_key(key);
    if (id && id->chain.robot != agent_.robot())
      ok = fail(ErrorCode::invalid, "a submap of somebody else in the outbox");
    return id;
  };
  const auto keep = [&](std::string_view key, std::size_t size) {
    if (const auto id = id_of(key)) kept.emplace(*id, size);
  };
  const auto mark = [&](std::string_view key, std::size_t size) {
    const auto id = id_of(key);
    if (auto known = id ? kept.extract(*id) : decltype(kept)::node_type()) {
      if (size > 0) refused_.insert(*id);
      archive_bytes_ += known.mapped();
      archive_.insert(std::move(known));
    }
  };
  if (auto read = store_.sizes(kOutbox, keep); !read || !ok) return read ? ok : read;
  if (auto read = store_.sizes(kArchive, mark); !read || !ok) return read ? ok : read;
  for (const auto& [id, size] : kept) uplink_.add(id, size);
  const auto take_foreign = [&](std::string_view key, std::size_t) {
    if (const auto session = storage::numbers_of(key.substr(std::min(key.size(), kForeign.size())), 1);
        session && key.starts_with(kForeign))
      foreign_sessions_.insert(session->front());
  };
  if (auto read = store_.sizes(kMeta, take_foreign); !read) return read;
  if (auto read = begin_at_stored_place(); !read) return read;
  hold_foreign();
  const auto heard = store_.read(kMeta, kIncarnations);
  if (!heard) return tl::unexpected(heard.error());
  if (const auto numbers = storage::numbers_of(heard->value_or(""), 2)) {
    graph_incarnation_ = static_cast<std::uint32_t>((*numbers)[0]);
    receipt_incarnation_ = static_cast<std::uint32_t>((*numbers)[1]);
  }
  return {};
}

/// No submap ends here: when one does, the journal goes in the same transaction.
Status RobotNode::hear_again(const JournalEntry& entry) {
  if (const auto* input = std::get_if<Input>(&entry)) {
    Status ok = agent_.add(*input);
    agent_.take_odometry_jumps();  // reported when they came
    return ok;
  }
  const auto& heard = std::get<HeardGraph>(entry);
  const auto message = wire::decode_proxy_graph(heard.frame);
  if (!message) return tl::unexpected(message.error());
  agent_.forget_map_age();  // it was news when it was heard
  note(agent_.receive(*message));
  return {};
}

Step RobotNode::resume(Timestamp now) {
  Step step;
  if (std::exchange(is_new_, false) && config_.keeps_state) {
    step.writes.push_back({kMeta, kRobot, storage::key_of({agent_.robot().value})});
    save_checkpoint(step);
  }
  if (config_.keeps_state) {
    step.writes.push_back({kMeta, kStarts, storage::key_of({starts_})});
    step.writes.push_back({kMeta, kSession, storage::key_of({agent_.chain().session})});
  }
  if (const auto why = std::exchange(why_lost_, {})) {
    if (config_.keeps_state) step.writes.push_back({kMeta, kLost, std::nullopt});
    step.emit(now, StateLost{agent_.robot(), agent_.chain().session, *why});
    why_begun_ = "what was stored could not be read: " + *why;
  }
  send_submaps(now, {}, step);
  return step;
}

Step RobotNode::add(const Input& input, Timestamp now) {
  Step step;
  if (const auto* start = std::get_if<StartPose>(&input)) {
    hear(*start, now, step);
    return step;
  }
  if (const auto* scan = std::get_if<Scan>(&input); scan != nullptr && !agent_.wants_scan(scan->stamp)) {
    locate(input, now, step);
    return step;  // again, or nothing new for the map that it makes
  }
  if (const auto* images = std::get_if<TrackedImages>(&input);
      images != nullptr && images->stamp == agent_.heard_images())
    return step;  // again
  if (const auto* sample = std::get_if<OdometrySample>(&input)) {
    const auto passed = gate_.take(*sample);
    if (!passed) {
      step.emit(now, SampleRefused{agent_.robot(), passed.error().message});
      return step;
    }
    if (!passed->why_anew.empty()) step = begin_session(passed->why_anew, now);
    if (passed->waited) hear(*passed->waited, now, step);
  }
  hear(input, now, step);
  return step;
}

void RobotNode::hear(const Input& input, Timestamp now, Step& step) {
  if (auto ok = agent_.add(input); !ok) {
    const auto refuse = Refuse{agent_.robot(), ok.error().message};
    return step.emit(now, std::visit(refuse, input));
  }
  if (std::holds_alternative<OdometrySample>(input)) finished_ = false;
  remember(input, now, step);
  locate(input, now, step);
  settle(now, step);
}

void RobotNode::expect_sensors(bool scans, bool images) {
  config_.agent.submap.has_scans = scans;
  config_.agent.submap.has_images = images;
  agent_.expect_sensors(scans, images);
}

void RobotNode::settle(Timestamp now, Step& step) {
  for (const robot::OdometryJump& jump : agent_.take_odometry_jumps()) {
    step.emit(now, OdometryJumped{agent_.robot(), jump});
    ++jumps_.count;
    jumps_.newest = jump;
    if (localiser_) localiser_->search_anew("odometry has jumped");
  }
  for (Error& error : agent_.take_scan_errors())
    step.emit(now, ScanRefused{agent_.robot(), std::move(error.message), true});
  const auto watch = [&](const char* sensor, std::optional<std::uint64_t> keyframes, bool& reported) {
    const bool is_missing = keyframes && *keyframes >= config_.most_keyframes_without;
    if (is_missing != reported && keyframes)
      step.emit(now, SensorMissing{agent_.robot(), sensor, is_missing ? *keyframes : 0});
    reported = is_missing;
  };
  watch("scan", agent_.keyframes_without_scan(), tells_no_scan_);
  watch("images", agent_.keyframes_without_images(), tells_no_images_);
  take_outgoing(now, step);
}

Step RobotNode::finish(Timestamp now) {
  Step step;
  finished_ = true;
  agent_.finish();
  settle(now, step);
  write_journal(step);
  return step;
}

Step RobotNode::store_all() {
  Step step;
  write_journal(step);
  return step;
}

/// Scans and images wait as odometry does: they come in its order, and one that is lost is fed again with its sample.
void RobotNode::remember(const JournalEntry& entry, Timestamp now, Step& step) {
  if (!config_.keeps_state) return;
  if (unwritten_.empty()) unwritten_since_ = now;
  unwritten_.push_back(encode(entry));
  if (now >= unwritten_since_ + config_.journal_period_s) write_journal(step);
}

void RobotNode::write_journal(Step& step) {
  for (std::string& entry : unwritten_)
    step.writes.push_back({kJournal, storage::key_of({journal_++}), std::move(entry)});
  unwritten_.clear();
  if (const auto place = places_.take_unstored(); place && config_.keeps_state)
    step.writes.push_back({kMeta, kPlace, wire::field_bytes(*place)});
}

std::optional<Timestamp> RobotNode::next_timer() const {
  std::optional<Timestamp> next = uplink_.next();
  if (unwritten_.empty()) return next;
  const Timestamp due = unwritten_since_ + config_.journal_period_s;
  return next ? std::min(*next, due) : due;
}

Step RobotNode::on_timer(Timestamp now) {
  Step step;
  if (!unwritten_.empty() && now >= unwritten_since_ + config_.journal_period_s) write_journal(step);
  send_submaps(now, {}, step);
  return step;
}

void RobotNode::save_checkpoint(Step& step) {
  if (!config_.keeps_state) return;
  for (storage::Write& write : std::exchange(aside_, {})) step.writes.push_back(std::move(write));
  wire::StateChange change = wire::changed_rows(agent_, stored_);
  for (auto* keys : {&obsolete_, &change.removed})
    for (std::string& key : std::exchange(*keys, {})) {
      rows_.erase(key);
      step.writes.push_back({kCheckpoint, std::move(key), std::nullopt});
    }
  for (auto& [key, bytes] : change.put) {
    rows_.insert(key);
    step.writes.push_back({kCheckpoint, key, std::move(bytes)});
  }
  unwritten_.clear();
  for (; journal_ > 0; --journal_) step.writes.push_back({kJournal, storage::key_of({journal_ - 1}), std::nullopt});
}

void RobotNode::take_outgoing(Timestamp now, Step& step) {
  Frames fresh;
  const auto submaps = agent_.take_outgoing();
  for (Error& error : agent_.take_image_errors())
    step.emit(now, ImagesRefused{agent_.robot(), std::move(error.message), true});
  for (fit::Misfit& misfit : agent_.take_misfits()) step.emit(now, MisfitFound{agent_.robot(), misfit});
  for (const SubmapMessage& message : submaps) {
    if (const Status ok = wire::validate(message); !ok) {
      step.emit(now, MessageRefused{bus::Endpoint::of(agent_.robot()), bus::MessageKind::submap, ok.error().message});
      continue;
    }
    auto frame = std::make_shared<const std::string>(wire::encode(message, {.voxel_m = config_.agent.submap.voxel_m}));
    const SubmapId id = message.submap.id;
    if (config_.keeps_state) {
      uplink_.add(id, frame->size());
      step.writes.push_back({kOutbox, key_of(id), *frame});
      fresh.emplace(id, std::move(frame));
    } else {
      step.messages.push_back(submap_envelope(id, std::move(frame)));
    }
  }
  if (submaps.empty()) return;
  save_checkpoint(step);
  send_submaps(now, fresh, step);
}

void RobotNode::send_submaps(Timestamp now, const Frames& fresh, Step& step) {
  for (const SubmapId id : uplink_.take(now)) {
    if (const auto found = fresh.find(id); found != fresh.end()) {
      step.messages.push_back(submap_envelope(id, found->second));
      continue;
    }
    auto row = store_.read(kOutbox, key_of(id));
    if (row && *row)
      step.messages.push_back(submap_envelope(id, std::make_shared<const std::string>(std::move(**row))));
    else
      step.emit(now, MessageRefused{
                         bus::Endpoint::of(agent_.robot()), bus::MessageKind::submap,
                         row ? fmt::format("submap {} is not in the outbox", to_string(id)) : row.error().message});
  }
}

bus::Envelope RobotNode::submap_envelope(SubmapId id, std::shared_ptr<const std::string> frame) const {
  return {bus::Endpoint::of(agent_.robot()), bus::Endpoint::server(), bus::MessageKind::submap,
          message_id(id, receipt_incarnation_), std::move(frame)};
}

std::vector<RobotAlert> RobotNode::alerts() const {
  std::vector<RobotAlert> out;
  for (const fit::Misfit& misfit : std::views::reverse(agent_.fit().misfits()))
    out.push_back({fmt::format("{}: {}", to_string(misfit), way_on(misfit)), misfit.to, misfit.from, misfit.to});
  const Timestamp newest = agent_.newest_sample().value_or(Timestamp{});
  if (const auto& jump = jumps_.newest; jump && newest - jump->to < config_.alert_s)
    out.push_back({fmt::format("{} ({} so far): no body moves so, and only the map tells where the robot is",
                               to_string(*jump), jumps_.count),
                   jump->to, jump->from, jump->to});
  const Timestamp begun = agent_.keyframes().empty() ? newest : agent_.keyframes().front().stamp;
  if (!why_begun_.empty() && newest - begun < config_.alert_s)
    out.push_back({fmt::format("session {} has begun, a map of its own until places are seen again: {}",
                               agent_.chain().session, why_begun_),
                   begun, begun, begun});
  if (const std::string text = dispute(); !text.empty()) out.push_back({text, disputed_, disputed_, disputed_});
  return out;
}

NodeStatus RobotNode::status(Timestamp now) const {
  NodeStatus status{.name = config_.name.empty() ? default_name(bus::Endpoint::of(agent_.robot())) : config_.name,
                    .session = agent_.chain().session,
                    .start = start(),
                    .version = {},
                    .backlog_submaps = uplink_.submaps().size(),
                    .backlog_bytes = uplink_.bytes(),
                    .heard_epoch = agent_.map_age().first,
                    .heard_revision = agent_.map_age().second,
                    .update_age_s = {},
                    .keyframes = agent_.keyframes().size(),
                    .submaps = agent_.submap_of().empty() ? 0 : agent_.submap_of().back() + std::uint64_t{1},
                    .T_odom_body = agent_.T_odom_body(),
                    .alerts = alerts_,
                    .finished = finished_,
                    .jobs_done = 0,
                    .trouble = {}};
  status.in_map = in_map();
  if (updated_) status.update_age_s = now - *updated_;
  const std::vector<RobotAlert> known = alerts();
  const std::string refused = dispute().empty() ? gate_.trouble() : "";
  status.trouble = plain_text(refused.empty() && !known.empty() ? known.back().text : refused);
  for (const auto& [kind, unread] : unread_)
    status.trouble =
        plain_text(fmt::format("cannot read what the server sends ({} so far), one of the two is to be upgraded: {}",
                               unread.count, unread.why));
  return status;
}

}  // namespace tutti::node
