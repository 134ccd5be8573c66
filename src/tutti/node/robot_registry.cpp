// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_registry.hpp"

#include <fmt/format.h>

#include <charconv>

#include "tutti/node/map_meta.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

/// When there are too many, the oldest are forgotten.
void remember(std::set<std::uint64_t>& sessions, std::uint64_t session) {
  sessions.insert(session);
  if (sessions.size() > RobotRow::kMostSessions) sessions.erase(sessions.begin());
}

/// It has begun a new session, for example because its clock was set back. Only a start with a random part
/// distinguishes this. While two programs seem to have the owner's session, it is the first of them.
bool is_one_program(const RobotRegistry::Robot& robot, const NodeStatus& now, Timestamp when) {
  constexpr std::uint64_t kCounts = std::uint64_t{1} << 32U;
  if (now.start < kCounts || now.session <= robot.status.session) return false;
  const bool are_two = robot.heard_again && when - *robot.heard_again < RobotRegistry::kHeardAgain_s;
  return now.start == robot.start_before || (now.start == robot.status.start && !are_two);
}

}  // namespace

std::optional<ChainId> RobotRegistry::owner(RobotId robot) const {
  const auto found = robots_.find(robot);
  if (found == robots_.end() || !found->second.is_claimed) return std::nullopt;
  return ChainId(robot, found->second.status.session);
}

/// To a session that was refused before, an owner that has not had the time to be heard yet is there; to a new one,
/// which starts with yesterday's map, it is not.
bool RobotRegistry::is_there(const Robot& robot, std::uint64_t rival, Timestamp now) const {
  if (!robot.is_claimed) return false;
  if (robot.last_seen) return now - *robot.last_seen < kOwnerIsThere_s;
  return robot.rivals.contains(rival) && now - started_ < kOwnerIsThere_s;
}

bool RobotRegistry::note_session(const ChainId& chain) {
  const bool is_first = !mapped_.contains(chain.robot);
  mapped_[chain.robot].insert(chain.session);
  return is_first && owner(chain.robot).has_value();
}

bool RobotRegistry::is_mapped(RobotId robot, std::uint64_t session) const {
  const auto found = mapped_.find(robot);
  return found != mapped_.end() && found->second.contains(session);
}

void RobotRegistry::make_room() {
  std::size_t strangers = 0;
  auto oldest = robots_.end();
  for (auto at = robots_.begin(); at != robots_.end(); ++at) {
    if (is_mapped(at->first)) continue;
    ++strangers;
    if (oldest == robots_.end() || at->second.last_seen < oldest->second.last_seen) oldest = at;
  }
  if (strangers >= kMostStrangers) robots_.erase(oldest);
}

std::string RobotRegistry::objection(RobotId id, const NodeStatus& status, Timestamp now) const {
  const bool has_submaps = is_mapped(id, status.session);
  for (const auto& [other, robot] : robots_)
    if (other != id && robot.status.name == status.name && is_there(robot, status.session, now) &&
        (is_mapped(other) || !has_submaps))
      return fmt::format("the name '{}' is in use by robot number {}, session {}; this one has number {}", status.name,
                         other.value, robot.status.session, id.value);
  const auto found = robots_.find(id);
  if (found == robots_.end() || !found->second.is_claimed) return {};
  const NodeStatus& owner = found->second.status;
  if (has_submaps && !is_mapped(id, owner.session)) return {};
  if (!is_mapped(id) && owner.name != status.name && !is_there(found->second, status.session, now)) return {};
  if (owner.name != status.name)
    return fmt::format("number {} belongs to robot '{}' in this map, not to '{}'", id.value, owner.name, status.name);
  if (owner.session == status.session) {
    if (!found->second.copies.contains(status.start) || !is_there(found->second, status.session, now)) return {};
    return fmt::format(
        "another program lives that goes on with session {} of robot '{}': the state folder of this one "
        "was copied",
        owner.session, owner.name);
  }
  if (is_one_program(found->second, status, now)) return {};
  if (found->second.former.contains(status.session))
    return fmt::format("session {} of robot '{}' has been replaced by session {}", status.session, owner.name,
                       owner.session);
  if (is_there(found->second, status.session, now))
    return fmt::format("another robot '{}' is there, session {}; this one is session {}", owner.name, owner.session,
                       status.session);
  return {};
}

void RobotRegistry::take_over(RobotId id, Robot& robot, const NodeStatus& status) const {
  if (robot.is_claimed)
    remember(robot.former, robot.status.session);
  else if (const auto mapped = mapped_.find(id); mapped != mapped_.end())
    for (const std::uint64_t session : mapped->second) remember(robot.former, session);
  robot.former.erase(status.session);
  robot.rivals.erase(status.session);
  robot.is_claimed = true;
}

bool RobotRegistry::note_start(Robot& robot, const NodeStatus& status, Timestamp now) {
  const std::uint64_t known = robot.status.start;
  if (status.start == known || known == 0 || status.start == 0) return true;
  if (status.start != robot.start_before) {  // it has started again, as far as can be known
    robot.start_before = known;
    robot.heard_again.reset();
    return true;
  }
  if (!robot.heard_again) robot.heard_again = now;
  if (now - *robot.heard_again < kHeardAgain_s) return false;
  remember(robot.copies, known);
  robot.start_before = 0;
  robot.heard_again.reset();
  return true;
}

RobotRegistry::Heard RobotRegistry::hear(RobotId id, const NodeStatus& status, Timestamp now) {
  Heard heard{.accepted = false, .must_be_stored = false, .why = objection(id, status, now)};
  if (!robots_.contains(id)) make_room();
  Robot& robot = robots_[id];
  if (!heard.why.empty()) {
    robot.conflict = heard.why;
    robot.last_conflict = now;
    if (robot.is_claimed) {
      const std::size_t before = robot.rivals.size();
      if (!robot.former.contains(status.session) && robot.status.session != status.session)
        remember(robot.rivals, status.session);
      heard.must_be_stored = is_mapped(id) && robot.rivals.size() > before;
    } else {
      robot.status = status;
      robot.last_seen = now;
    }
    return heard;
  }
  heard.accepted = true;
  const bool is_owner = robot.is_claimed && robot.status.session == status.session;
  if (is_owner && !note_start(robot, status, now)) return heard;
  robot.copies.erase(status.start);
  if (!is_owner) {
    take_over(id, robot, status);
    robot.start_before = 0;
    robot.heard_again.reset();
    robot.copies.clear();
    heard.must_be_stored = is_mapped(id);
  }
  robot.status = status;
  robot.last_seen = now;
  if (status.update_age_s) robot.last_update = now - *status.update_age_s;
  return heard;
}

std::string RobotRegistry::key(RobotId robot) { return fmt::format("{}{}", kRobotPrefix, robot.value); }

std::optional<RobotId> RobotRegistry::robot_of(std::string_view key) {
  RobotId robot;
  if (!key.starts_with(kRobotPrefix)) return std::nullopt;
  const char* const end = key.data() + key.size();
  const auto [stop, error] = std::from_chars(key.data() + kRobotPrefix.size(), end, robot.value);
  return error == std::errc() && stop == end ? std::optional(robot) : std::nullopt;
}

std::string RobotRegistry::row(RobotId id) const {
  const Robot& robot = robots_.at(id);
  return encode(RobotRow{robot.status.name, robot.status.session, robot.former, robot.rivals});
}

bool RobotRegistry::restore(RobotId id, std::string_view row) {
  auto known = decode_robot(row);
  if (!known) return false;
  Robot robot{.is_claimed = true, .status = {.name = std::move(known->name), .session = known->session}};
  robot.former = std::move(known->former);
  robot.rivals = std::move(known->rivals);
  if (!wire::validate(robot.status)) return false;
  robots_.insert_or_assign(id, std::move(robot));
  return true;
}

}  // namespace tutti::node
