// SPDX-License-Identifier: BSD-3-Clause
// When a robot's node begins another session: its odometry's clock began anew, or another program has its session, too.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/node/robot_node.hpp"
#include "tutti/node/robot_tables.hpp"

namespace tutti::node {

using namespace robot_tables;  // NOLINT

Step RobotNode::begin_session(const std::string& why, Timestamp now) {
  Step step = finish(now);
  change_session(why, now, step);
  begin_localising();
  return step;
}

void RobotNode::change_session(const std::string& why, Timestamp now, Step& step) {
  const std::uint64_t session = agent_.chain().session + 1 + config_.incarnation;  // not what a copy would take
  agent_ = robot::RobotAgent(agent_.robot(), config_.agent, robot::AgentState{{.session = session}});
  gate_ = OdometryGate(agent_.robot());
  places_ = {};
  obsolete_.assign(rows_.begin(), rows_.end());
  stored_ = {};
  finished_ = false;
  updated_.reset();
  jumps_.newest.reset();
  mapped_age_ = {};
  mapped_until_ = kFirstTimestamp;
  alerts_ = 0;
  tells_no_scan_ = tells_no_images_ = false;
  why_begun_ = why;
  save_checkpoint(step);
  if (config_.keeps_state) step.writes.push_back({kMeta, kSession, storage::key_of({session})});
  step.emit(now, SessionBegun{agent_.robot(), session, why});
}

Status RobotNode::set_aside(const wire::StateRows& checkpoint, std::uint64_t session) {
  const std::string prefix = kAside + std::to_string(session) + "/";
  for (const auto& [key, bytes] : checkpoint) {
    aside_.push_back({kCheckpoint, prefix + kCheckpoint + "/" + key, bytes});
    obsolete_.push_back(key);
  }
  return store_.scan(kJournal, {}, [&](std::string_view key, std::string_view bytes) {
    aside_.push_back({kCheckpoint, prefix + kJournal + "/" + std::string(key), std::string(bytes)});
    return true;
  });
}

void RobotNode::refuse(std::uint64_t session, const std::string& why, Timestamp now, Step& step) {
  disputed_ = agent_.newest_sample().value_or(Timestamp{});
  step.emit(now, RobotRefused{agent_.robot(), session, why});
}

void RobotNode::note_conflict(const Receipt& receipt, Timestamp now, Step& step) {
  owner_session_ = receipt.owner_session;
  const std::optional<std::string> before = std::exchange(conflict_, std::nullopt);
  const std::uint64_t session = agent_.chain().session;
  const auto& conflict = receipt.conflict;
  if (!conflict || conflict->session != session || conflict->start != start()) return;
  conflict_ = conflict->why;
  if (conflict_ != before) refuse(session, conflict->why, now, step);
  if (receipt.owner_session == session) leave(session, conflict->why, now, step);
}

void RobotNode::note_foreign(const std::set<std::uint64_t>& sessions, Timestamp now, Step& step) {
  for (const std::uint64_t session : sessions) {
    if (foreign_sessions_.contains(session)) continue;
    const std::string why = fmt::format(
        "under session {} the map has other submaps than this robot's: another program has sent them, with "
        "a copy of its state folder",
        session);
    refuse(session, why, now, step);
    leave(session, why, now, step);
  }
  const auto waiting = std::ranges::count_if(
      uplink_.submaps(), [&](const auto& one) { return foreign_sessions_.contains(one.first.chain.session); });
  foreign_.clear();
  if (waiting > 0)
    foreign_ = fmt::format(
        "{} submaps stay out of the map: another program, with a copy of this robot's state folder, "
        "has sent others under session {}",
        waiting, *foreign_sessions_.rbegin());
}

/// A chain in the map must be of one body. So who was not the first to have a session begins another, and the submap
/// that it was making is lost.
void RobotNode::leave(std::uint64_t session, const std::string& why, Timestamp now, Step& step) {
  foreign_sessions_.insert(session);
  if (config_.keeps_state)
    step.writes.push_back({kMeta, std::string(kForeign) + storage::key_of({session}), std::string()});
  hold_foreign();
  if (session != agent_.chain().session) return;
  change_session(why, now, step);
  begin_localising();
}

void RobotNode::hold_foreign() {
  for (const auto& [id, bytes] : uplink_.submaps())
    if (foreign_sessions_.contains(id.chain.session)) uplink_.hold(id);
}

}  // namespace tutti::node
