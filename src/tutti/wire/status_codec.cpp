// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "tutti/base/plain_text.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/method_message.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/pose_numbers.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

bool is_letter_of_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

Status check_text(const std::string& text, const char* what) {
  if (text == plain_text(text)) return {};
  return fail(ErrorCode::invalid, "{} of {} bytes, expected at most {}, all of printable ASCII", what, text.size(),
              kMaxReasonBytes);
}

Status check_name(const std::string& name) {
  if (!name.empty() && name.size() <= kMaxNameBytes && std::ranges::all_of(name, is_letter_of_name)) return {};
  return fail(ErrorCode::invalid, "a name of {} letters, expected 1 to {} letters, digits, '_' and '-'", name.size(),
              kMaxNameBytes);
}

void write(const NodeStatus& status, v1::Status& out) {
  out.set_name(status.name);
  out.set_session(status.session);
  out.set_start(status.start);
  out.set_version(status.version);
  out.set_backlog_submaps(status.backlog_submaps);
  out.set_backlog_bytes(status.backlog_bytes);
  out.set_heard_epoch(status.heard_epoch);
  out.set_heard_revision(status.heard_revision);
  if (status.update_age_s) out.set_update_age_s(*status.update_age_s);
  out.set_keyframes(status.keyframes);
  if (status.submaps) out.set_submaps(*status.submaps);
  if (!(status.T_odom_body == Pose3{})) wire::write(status.T_odom_body, *out.mutable_pose());
  out.set_alerts(status.alerts);
  out.set_finished(status.finished);
  out.set_jobs_done(status.jobs_done);
  out.set_trouble(status.trouble);
  for (const MethodId& id : status.can) wire::write(id, *out.add_can());
}

Result<NodeStatus> read(const v1::Status& in) {
  NodeStatus status{.name = in.name(),
                    .session = in.session(),
                    .start = in.start(),
                    .version = in.version(),
                    .backlog_submaps = in.backlog_submaps(),
                    .backlog_bytes = in.backlog_bytes(),
                    .heard_epoch = in.heard_epoch(),
                    .heard_revision = in.heard_revision(),
                    .update_age_s = {},
                    .keyframes = in.keyframes(),
                    .submaps = {},
                    .T_odom_body = {},
                    .alerts = in.alerts(),
                    .finished = in.finished(),
                    .jobs_done = in.jobs_done(),
                    .trouble = in.trouble(),
                    .can = {}};
  for (const v1::Method& id : in.can()) status.can.push_back(wire::read(id));
  if (in.has_submaps()) status.submaps = in.submaps();
  if (in.has_update_age_s()) status.update_age_s = in.update_age_s();
  if (in.pose_size() == kPoseNumbers)
    status.T_odom_body = read_pose(in.pose(), 0);
  else if (in.pose_size() != 0)
    return fail(ErrorCode::parse, "a pose of {} numbers, expected {}", in.pose_size(), kPoseNumbers);
  return status;
}

std::optional<Timestamp> stamp(bool is_there, std::int64_t ns) {
  return is_there ? std::optional(Timestamp{ns}) : std::nullopt;
}

Status check(const MissionStatus::Robot& robot) {
  if (auto ok = check_text(robot.conflict, "a conflict"); !ok) return ok;
  return validate(robot.status);
}

Status check(const MissionStatus::Refusals& refusals) {
  for (const std::string* text : {&refusals.from, &refusals.kind, &refusals.last_why})
    if (auto ok = check_text(*text, "a text about refusals"); !ok) return ok;
  return {};
}

Result<MissionStatus::Robot> read(const v1::RobotInMission& in) {
  auto status = read(in.status());
  if (!status) return tl::unexpected(status.error());
  return MissionStatus::Robot{.robot = RobotId{in.robot()},
                              .last_seen = stamp(in.has_last_seen_ns(), in.last_seen_ns()),
                              .last_update = stamp(in.has_last_update_ns(), in.last_update_ns()),
                              .submaps = in.submaps(),
                              .refused = in.refused(),
                              .conflict = in.conflict(),
                              .status = std::move(*status),
                              .unread = in.unread()};
}

Result<MissionStatus::Worker> read(const v1::WorkerInMission& in) {
  auto status = read(in.status());
  if (!status) return tl::unexpected(status.error());
  return MissionStatus::Worker{in.number(), {in.last_seen_ns()}, std::move(*status)};
}

}  // namespace

Status validate(const NodeStatus& status) {
  const auto wrong = [](const Error& error) { return in_context("status", error); };
  if (auto ok = check_name(status.name); !ok) return wrong(ok.error());
  if (auto ok = check_text(status.version, "a version"); !ok) return wrong(ok.error());
  if (auto ok = check_text(status.trouble, "trouble"); !ok) return wrong(ok.error());
  if (status.can.size() > kMaxMethods)
    return fail(ErrorCode::invalid, "status: can do {} things, at most {} are accepted", status.can.size(),
                kMaxMethods);
  for (const MethodId& id : status.can)
    if (auto ok = check_method(id); !ok) return wrong(ok.error());
  if (status.update_age_s && !(std::isfinite(*status.update_age_s) && *status.update_age_s >= 0.0))
    return fail(ErrorCode::invalid, "status: an update {} s ago, expected 0 or more", *status.update_age_s);
  if (!is_valid(status.T_odom_body) || status.T_odom_body.translation.cwiseAbs().maxCoeff() > kMaxCoordinate_m)
    return fail(ErrorCode::invalid, "status: no valid pose");
  return {};
}

Status validate(const MissionStatus& status) {
  const auto wrong = [](const Error& error) { return in_context("mission status", error); };
  if (auto ok = check_text(status.version, "a version"); !ok) return wrong(ok.error());
  if (auto ok = check_text(status.trouble, "trouble"); !ok) return wrong(ok.error());
  if (auto ok = check_text(status.finder, "a finder"); !ok) return wrong(ok.error());
  if (auto ok = check_text(status.why_waiting, "a reason to wait"); !ok) return wrong(ok.error());
  if (status.robots.size() > kMaxRobots || status.workers.size() > kMaxRobots ||
      status.refusals.size() > kMaxRefusalKinds)
    return fail(
        ErrorCode::invalid, "mission status: {} robots, {} workers, {} refusals, at most {}, {}, {} are accepted",
        status.robots.size(), status.workers.size(), status.refusals.size(), kMaxRobots, kMaxRobots, kMaxRefusalKinds);
  if (status.words.size() > kMaxAnsweredWords)
    return fail(ErrorCode::invalid, "mission status: {} words, at most {} are accepted", status.words.size(),
                kMaxAnsweredWords);
  for (const MissionStatus::Word& word : status.words)
    if (auto ok = check_text(word.why, "what is said of a word"); !ok) return wrong(ok.error());
  const auto not_after = [](const auto& a, const auto& b) { return a >= b; };
  if (std::ranges::adjacent_find(status.robots, not_after, &MissionStatus::Robot::robot) != status.robots.end() ||
      std::ranges::adjacent_find(status.workers, not_after, &MissionStatus::Worker::number) != status.workers.end())
    return fail(ErrorCode::invalid, "mission status: robots or workers are not in the order of their numbers");
  for (const MissionStatus::Robot& robot : status.robots)
    if (auto ok = check(robot); !ok) return wrong(ok.error());
  for (const MissionStatus::Worker& worker : status.workers)
    if (auto ok = validate(worker.status); !ok) return wrong(ok.error());
  for (const MissionStatus::Refusals& refusals : status.refusals)
    if (auto ok = check(refusals); !ok) return wrong(ok.error());
  return {};
}

std::string encode(const NodeStatus& status) {
  expect_valid(validate(status));
  v1::Status out;
  write(status, out);
  return pack_frame(MessageKind::status, out.SerializeAsString());
}

Result<NodeStatus> decode_status(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Status>(MessageKind::status, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  auto status = read(parsed->message);
  if (!status) return in_context("status", status.error());
  if (auto ok = validate(*status); !ok) return tl::unexpected(ok.error());
  return status;
}

std::string encode(const MissionStatus& status) {
  expect_valid(validate(status));
  v1::MissionStatus out;
  out.set_time_ns(status.time.ns);
  out.set_wall_ns(status.wall_ns);
  out.set_version(status.version);
  out.set_epoch(status.epoch);
  out.set_incarnation(status.incarnation);
  out.set_revision(status.revision);
  out.set_submaps(status.submaps);
  out.set_closures(status.closures);
  out.set_components(status.components);
  out.set_pending_jobs(status.pending_jobs);
  out.set_has_news(status.has_news);
  for (const MissionStatus::Robot& robot : status.robots) {
    v1::RobotInMission& entry = *out.add_robot();
    entry.set_robot(robot.robot.value);
    if (robot.last_seen) entry.set_last_seen_ns(robot.last_seen->ns);
    if (robot.last_update) entry.set_last_update_ns(robot.last_update->ns);
    entry.set_submaps(robot.submaps);
    entry.set_refused(robot.refused);
    entry.set_unread(robot.unread);
    entry.set_conflict(robot.conflict);
    write(robot.status, *entry.mutable_status());
  }
  for (const MissionStatus::Worker& worker : status.workers) {
    v1::WorkerInMission& entry = *out.add_worker();
    entry.set_number(worker.number);
    entry.set_last_seen_ns(worker.last_seen.ns);
    write(worker.status, *entry.mutable_status());
  }
  for (const MissionStatus::Refusals& refusals : status.refusals) {
    v1::RefusedMessages& entry = *out.add_refusals();
    entry.set_from(refusals.from);
    entry.set_kind(refusals.kind);
    entry.set_count(refusals.count);
    entry.set_last_why(refusals.last_why);
  }
  out.set_trouble(status.trouble);
  out.set_finder(status.finder);
  out.set_former_pairs(status.former_pairs);
  out.set_waiting(status.waiting);
  out.set_why_waiting(status.why_waiting);
  for (const MissionStatus::Word& word : status.words) {
    v1::AnsweredWord& entry = *out.add_words();
    entry.set_content(word.content);
    entry.set_why(word.why);
  }
  return pack_frame(MessageKind::mission_status, out.SerializeAsString());
}

Result<MissionStatus> decode_mission_status(std::string_view bytes) {
  const auto parsed = parse_frame<v1::MissionStatus>(MessageKind::mission_status, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::MissionStatus& in = parsed->message;
  MissionStatus status{.time = {in.time_ns()},
                       .wall_ns = in.wall_ns(),
                       .version = in.version(),
                       .epoch = in.epoch(),
                       .incarnation = in.incarnation(),
                       .revision = in.revision(),
                       .submaps = in.submaps(),
                       .closures = in.closures(),
                       .components = in.components(),
                       .pending_jobs = in.pending_jobs(),
                       .has_news = in.has_news(),
                       .robots = {},
                       .workers = {},
                       .refusals = {},
                       .trouble = in.trouble(),
                       .finder = in.finder(),
                       .former_pairs = in.former_pairs(),
                       .waiting = in.waiting(),
                       .why_waiting = in.why_waiting(),
                       .words = {}};
  for (const v1::RobotInMission& entry : in.robot()) {
    auto robot = read(entry);
    if (!robot) return in_context("mission status", robot.error());
    status.robots.push_back(std::move(*robot));
  }
  for (const v1::WorkerInMission& entry : in.worker()) {
    auto worker = read(entry);
    if (!worker) return in_context("mission status", worker.error());
    status.workers.push_back(std::move(*worker));
  }
  for (const v1::RefusedMessages& entry : in.refusals())
    status.refusals.push_back({entry.from(), entry.kind(), entry.count(), entry.last_why()});
  for (const v1::AnsweredWord& entry : in.words()) status.words.push_back({entry.content(), entry.why()});
  if (auto ok = validate(status); !ok) return tl::unexpected(ok.error());
  return status;
}

}  // namespace tutti::wire
