// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/collect_mission.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/drive/replay.hpp"
#include "tutti/history/history_file.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/update_json.hpp"
#include "tutti/mission/make_record.hpp"
#include "tutti/mission/misfit_record.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/mission/troubles.hpp"
#include "tutti/mission/view_recorder.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/page/view.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::lab {
namespace {

using program::Json, program::kEnded;

namespace fs = std::filesystem;

/// A robot's store and what was made of it; the store lives as long.
struct Robot {
  mission::Troubles troubles;
  std::unique_ptr<storage::TableStore> store;
  std::unique_ptr<node::RobotNode> node;
  mission::FinishedRobot finished;
  std::vector<mission::UpdateRecord> scores;
  mission::PolicyTiming timing;
};

mission::TrafficRecord traffic_of(const Json& row, const std::string& robot) {
  const bool sent = row.at("sent").get<bool>();
  const auto bytes = row.at("bytes").get<std::uint64_t>();
  return {.from = sent ? robot : "server",
          .to = sent ? "server" : robot,
          .kind = row.at("kind").get<std::string>(),
          .messages = row.at("messages").get<std::uint64_t>(),
          .bytes = bytes,
          .transmitted_bytes = bytes,
          .largest_message = row.at("largest").get<std::uint64_t>()};
}

/// One event of a robot program.
Status take(const Json& event, const std::string& name, Robot& robot) try {
  const std::string what = event.value("event", "");
  if (what == "robot_updated" && event.at("synchronised").get<std::size_t>() > 0) {
    auto update = update_of(event);
    if (!update) return tl::unexpected(update.error());
    robot.finished.updates.push_back(std::move(*update));
  }
  if (what == kUpdateScored) {
    auto score = update_of(event);
    if (!score) return tl::unexpected(score.error());
    robot.scores.push_back(std::move(*score));
  }
  if (what == program::kUpdateTimed) {
    drive::UpdateTime time;
    if (const Status ok = read_json_fields(event, time); !ok) return ok;
    robot.timing.add(time);
  }
  if (what == kEnded) {
    robot.finished.traffic.clear();
    for (const Json& row : event.at("traffic")) robot.finished.traffic.push_back(traffic_of(row, name));
    if (event.contains("status"))
      if (const Status ok = read_json_fields(event.at("status"), robot.finished.status); !ok) return ok;
  }
  if (what == "misfit_found") {
    fit::Misfit misfit;
    misfit.kind = fit::misfit_kind(event.value("kind", "")).value_or(misfit.kind);
    if (event.value("by", "") == to_string(fit::Witness::images)) misfit.by = fit::Witness::images;
    if (const Status ok = read_json_fields(event, misfit); !ok) return ok;
    mission::note_misfit(misfit, robot.finished.misfits);
  }
  if (what == "sensor_missing" && event.value("keyframes", 0) == 0) return {};  // it is there again
  const std::string why = event.contains("why") ? event.value("why", "") : event.dump();
  robot.troubles.note(what, why, 1 + event.value("left_out", std::size_t{0}));
  return {};
} catch (const std::exception& error) {  // of the JSON library, or a place of less than three numbers
  return fail(ErrorCode::parse, "event {}: {}", event.dump(), error.what());
}

/// Beside what the robot reported of the same updates, which come later.
void add_scores(Robot& robot) {
  for (mission::UpdateRecord& update : robot.finished.updates) {
    const auto score = std::ranges::find(robot.scores, update.revision, &mission::UpdateRecord::revision);
    if (score == robot.scores.end()) continue;
    update.onboard_rmse_m = score->onboard_rmse_m;
    update.server_rmse_m = score->server_rmse_m;
    update.answers = score->answers;
  }
}

/// The robot's explanation of the last map, made once more: its own odometry against it, whatever it has corrected.
consistency::Explanation explain_again(const robot::RobotAgent& agent, const MissionConfig& config,
                                       const ProxyGraph& map) {
  robot::AgentState state = agent.state();
  state.epoch = state.revision = 0;                // as if it had not heard it,
  if (state.comparisons > 0) --state.comparisons;  // nor compared it
  robot::RobotAgent again(agent.robot(), config.agent, std::move(state));
  const ProxyGraphMessage own{{}, consistency::own_part(map, agent.robot())};
  const auto sent = wire::decode_proxy_graph(wire::encode(own));
  return again.receive(sent ? *sent : own).explanation;
}

/// For the report, of a log that has outgrown its files.
std::string cut_short(const std::string& whose, std::uint64_t files) {
  return fmt::format(
      "{}: the first {} files of its events are gone, because a log keeps two: what this report counts and draws of it "
      "begins after them",
      whose, files);
}

Result<Robot> read_robot(const MissionConfig& config, const mission::MissionRecording& recording,
                         const fs::path& folder) {
  const std::string& name = recording.recording.name;
  Robot robot;
  auto store = storage::open_sqlite_store(folder / program::kRobotFile, storage::robot_schema());
  if (!store) return tl::unexpected(store.error());
  robot.store = std::move(*store);
  auto node = node::RobotNode::open(recording.recording.robot, 0,
                                    {.agent = drive::with_sensors(config.agent, recording.recording), .name = name},
                                    *robot.store);
  if (!node) return in_context((folder / program::kRobotFile).string(), node.error());
  robot.node = std::move(*node);
  robot.timing = {.robot = name, .policy = config.agent.policy.name};
  Status taken;
  const auto read = program::read_events(folder, [&](const Json& event) {
    if (taken) taken = take(event, name, robot);
  });
  if (!read || !taken) return in_context(folder.string(), read ? taken.error() : read.error());
  add_scores(robot);
  robot.finished.troubles = robot.troubles.lines(name);
  if (*read > 0) robot.finished.troubles.push_back(cut_short(name, *read));
  robot.finished.outcome = {.recording = &recording,
                            .default_policy = config.agent.policy.name,
                            .agents = {{config.agent.policy.name, &robot.node->agent()}},
                            .replayed = drive::heard_samples(recording.recording, robot.node->agent())};
  return robot;
}

/// The server's course: what it reported. `gone`: files of it that are not there any more.
Result<mission::MissionEvents> read_course(const fs::path& folder, std::uint64_t& gone) {
  mission::MissionEvents course;
  std::set<std::string> failed;  // pairs that could not be verified are tried again and again
  const auto take = [&](const Json& event) {
    const std::string what = event.value("event", "");
    const Timestamp time = Timestamp{} + event.value("time_s", 0.0);
    if (what == "map_updated")
      course.take({time, node::MapUpdated{.revision = event.value("revision", std::uint64_t{0}),
                                          .submaps = event.value("submaps", std::size_t{0}),
                                          .accepted = event.value("accepted", std::size_t{0}),
                                          .cost = event.value("cost", 0.0),
                                          .degrees_of_freedom = event.value("degrees_of_freedom", std::size_t{0}),
                                          .from_measurements = event.value("from_measurements", false)}});
    if (what == "change_of_mind") {
      consistency::MapChange change;
      static_cast<void>(read_json_fields(event, change));
      course.take(mission::ChangeOfMindRecord{RobotId{event.value("robot", std::uint32_t{0})},
                                              event.value("time_s", 0.0), change, event.value("reason", "")});
    }
    const bool is_new_failure = what == "verification_failed" &&
                                failed.insert(event.value("first", "") + " " + event.value("second", "")).second;
    if (what == "message_refused" || is_new_failure)
      course.take({time, node::MessageRefused{{}, bus::MessageKind::verdicts, event.value("why", "")}});
  };
  const auto read = program::read_events(folder, take);
  if (!read) return tl::unexpected(read.error());
  gone = *read;
  return course;
}

/// The messages that the page of the mission was sent, in the order of time, if there was one: its maps until `end_s`,
/// when the last one is made, and what robots and operators said.
std::vector<page::Message> shown_by_page(const fs::path& server, double end_s) {
  const fs::path file = server / "page" / history::kHistoryFile;
  if (std::error_code none; !fs::exists(file, none)) return {};
  const auto opened = history::open_history(file);
  std::vector<page::Message> out = opened.history->past();
  for (page::Message& message : opened.history->last()) out.push_back(std::move(message));
  std::erase_if(out, [&](const page::Message& message) {
    const std::string_view kind = history::kind_of(message.key);
    const bool is_said = kind == "status" || kind == "alerts" || kind == "acknowledged" || kind == "radio";
    return kind == "mark" || (!is_said && message.time_s >= end_s);
  });
  return out;
}

}  // namespace

Result<mission::MissionRecord> collect_mission(const MissionConfig& config, const MissionSource& source,
                                               const fs::path& state, const std::string& version) {
  auto input = load_input(config, source.data, source.seed);
  if (!input) return tl::unexpected(input.error());
  std::vector<Robot> robots;
  std::set<RobotId> ids;
  for (const mission::MissionRecording& recording : input->robots) {
    auto robot = read_robot(config, recording, state / "robots" / recording.recording.name);
    if (!robot) return tl::unexpected(robot.error());
    robots.push_back(std::move(*robot));
    ids.insert(recording.recording.robot);
  }
  auto verifier = make_verifier(config, source);
  if (!verifier) return tl::unexpected(verifier.error());
  const fs::path map = state / "server" / program::kMapFile;
  const auto store = storage::open_sqlite_store(map, storage::map_schema());
  if (!store) return tl::unexpected(store.error());
  const auto server = node::ServerNode::open(ids, *verifier, {.server = config.server}, 1, **store);
  if (!server) return in_context(map.string(), server.error());
  static_cast<void>((*server)->resume(Timestamp{}));
  if (const auto due = (*server)->next_timer()) static_cast<void>((*server)->on_timer(*due));  // computes the map
  std::uint64_t gone = 0;
  const auto course = read_course(state / "server", gone);
  if (!course) return tl::unexpected(course.error());
  mission::FinishedMission finished{.config = config,
                                    .seed = source.seed,
                                    .version = version,
                                    .settings_yaml = to_yaml(config),
                                    .duration_s = mission::duration_of(config, input->robots),
                                    .survey = input->survey,
                                    .robots = {},
                                    .server = **server,
                                    .events = *course,
                                    .undelivered = {}};
  for (Robot& robot : robots) {
    if (config.agent.explain && !robot.finished.updates.empty())
      robot.finished.explanation = explain_again(robot.node->agent(), config, (*server)->broadcast());
    finished.robots.push_back(std::move(robot.finished));
  }
  mission::MissionRecord record = mission::make_record(finished);
  if (gone > 0) record.notes.push_back(cut_short("the server", gone));
  for (Robot& robot : robots) record.timing.policies.push_back(std::move(robot.timing));
  const Timestamp end = mission::kMissionStart + record.duration_s;
  auto view = mission::ViewRecorder(0.0).finish(mapfile::ShownMaps(**store).of(**server, end), std::nullopt,
                                                *node::SubmapFrames::of(**store));
  const auto marks = page::marks_with_photos(**store, 0.0);
  if (!marks) return in_context(map.string(), marks.error());
  view.messages.insert(view.messages.begin(), marks->begin(), marks->end());
  for (page::Message& message : shown_by_page(state / "server", record.duration_s))
    view.messages.push_back(std::move(message));
  std::ranges::stable_sort(view.messages, {}, &page::Message::time_s);
  record.view = std::make_shared<const mission::ViewRecord>(std::move(view));
  return record;
}

}  // namespace tutti::lab
