// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/make_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "tutti/base/config_io.hpp"
#include "tutti/mission/misfit_record.hpp"
#include "tutti/mission/perfect_judge.hpp"
#include "tutti/mission/record_notes.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::mission {
namespace {

void record_traffic(const std::vector<TrafficRecord>& traffic, RobotRecord& robot) {
  for (TrafficRecord row : traffic) {
    const bool up = row.from == robot.name;
    (up ? robot.bytes_up : robot.bytes_down) += row.bytes;
    (up ? robot.messages_up : robot.messages_down) += row.messages;
    row.bytes_per_s = robot.duration_s > 0.0 ? static_cast<double>(row.bytes) / robot.duration_s : 0.0;
    robot.traffic.push_back(std::move(row));
  }
}

}  // namespace

std::vector<TrafficRecord> traffic_of(const bus::SimulatedRadio& radio, RobotId robot, const std::string& name) {
  std::vector<TrafficRecord> traffic;
  for (const auto& [topic, statistics] : radio.statistics()) {
    const auto& [from, to, kind] = topic;
    const bool up = from.robot() == robot;
    if (!up && to.robot() != robot) continue;
    traffic.push_back({.from = up ? name : "server",
                       .to = up ? "server" : name,
                       .kind = wire::name(kind),
                       .messages = statistics.published,
                       .bytes = statistics.published_bytes,
                       .transmitted_bytes = statistics.transmitted_bytes,
                       .largest_message = statistics.largest_message});
  }
  return traffic;
}

MissionRecord make_record(const FinishedMission& mission) {
  const MissionConfig& config = mission.config;
  MissionRecord record{
      .mission = config.mission,
      .description = config.description,
      .input = config.input,
      .notes = config.notes,
      .seed = mission.seed,
      .default_policy = config.agent.policy.name,
      .duration_s = mission.duration_s,
      .association = config.association,
      .rpe_interval = fmt::format("{:g} s", kRpeInterval_s),
      .version = mission.version,
      .effective_config_yaml = mission.settings_yaml.empty() ? to_yaml(dump_config(config)) : mission.settings_yaml,
      .survey = mission.survey};
  std::vector<RobotOutcome> outcomes;
  for (const FinishedRobot& robot : mission.robots) {
    outcomes.push_back(robot.outcome);
    const auto note = [&](const std::vector<std::string>& notes) {
      record.notes.insert(record.notes.end(), notes.begin(), notes.end());
    };
    note(robot.outcome.recording->notes);
    note(robot.troubles);
  }
  mission.events.note_refusals(record);
  const server::MapServer& server = mission.server.map_server();
  const ProxyGraph& broadcast = mission.server.broadcast();
  record.robots.resize(mission.robots.size());
  std::vector<const MissionRecording*> recordings;
  for (const RobotOutcome& robot : outcomes) recordings.push_back(robot.recording);
  const auto perfect = judge_perfectly(server, config.server.map, recordings, config.association, config.closure_check);
  evaluate_robots(outcomes, server.map(), perfect ? &*perfect : nullptr, config.association, record);
  note_undelivered(mission.undelivered, record);
  note_what_the_map_lacks(server.map(), record);
  note_remarks(server.state().refinements, record);
  evaluate_server(outcomes, server, config.association, config.closure_check, record);
  evaluate_images(server, record);
  evaluate_fixes(server.map(), config.server.map.georeference.mode, record);
  record.server.proxy = broadcast;
  record.server.updates = mission.events.updates();
  record.server.changes_of_mind = mission.events.changes_of_mind();
  note_changes_of_mind(record);
  for (std::size_t i = 0; i < record.robots.size(); ++i) {
    RobotRecord& robot = record.robots[i];
    const FinishedRobot& finished = mission.robots[i];
    record_traffic(finished.traffic, robot);
    robot.status = finished.status;
    robot.status.name = robot.name;
    robot.updates = finished.updates;
    for (const fit::Misfit& misfit : finished.misfits)
      robot.misfits.push_back(record_of(misfit, *finished.outcome.recording));
    for (UpdateRecord& update : robot.updates)
      update.perfect_rmse_m = mission.perfect.rmse_m(update.revision, robot.id);
    robot.alerts = alerts_of(robot.updates);
    robot.explanation = finished.explanation;
    robot.proxy_nodes = static_cast<std::size_t>(
        std::ranges::count_if(broadcast.nodes, [&](const ProxyNode& node) { return node.chain.robot == robot.id; }));
    if (finished.outcome.recording->recording.visual != nullptr && !robot.images)
      robot.unused_images =
          finished.refused_images.empty() ? "the notes below say what is known" : finished.refused_images;
    for (const auto& [id, submap] : server.state().submaps) robot.submaps += id.chain.robot == robot.id ? 1 : 0;
  }
  for (const RobotOutcome& robot : outcomes)
    record.warnings.insert(record.warnings.end(), robot.recording->warnings.begin(), robot.recording->warnings.end());
  std::ranges::move(warnings_of(record), std::back_inserter(record.warnings));
  return record;
}

}  // namespace tutti::mission
