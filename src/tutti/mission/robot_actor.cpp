// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_actor.hpp"

#include <fmt/format.h>

#include "tutti/mission/misfit_record.hpp"

namespace tutti::mission {
namespace {

std::unique_ptr<node::RobotNode> open(const Recording& recording, const robot::AgentConfig& config,
                                      std::shared_ptr<const localise::Localiser::Setup> localise,
                                      const storage::TableStore& store) {
  return node::RobotNode::open(
             recording.robot, 0,
             {.agent = drive::with_sensors(config, recording), .keeps_state = false, .localise = std::move(localise)},
             store)
      .value();
}

}  // namespace

RobotActor::RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
                       const evaluation::AssociationConfig& association, std::unique_ptr<Companions> companions,
                       std::shared_ptr<const localise::Localiser::Setup> localise)
    : recording_(recording),
      association_(association),
      driver_(open(recording.recording, config, std::move(localise), nothing_)),
      replay_(recording.recording, recording.start_s, driver_),
      companions_(std::move(companions)),
      timing_{.robot = recording.recording.name, .policy = config.policy.name} {}

void RobotActor::replay_next(Timestamp now) {
  if (companions_) companions_->add(replay_.next_sample());
  replay_.feed_next(now);
  note_step();
  if (!companions_) return;
  for (const Timestamp keyframe : replay_.sensor_keyframes()) companions_->add_keyframe_time(keyframe);
}

void RobotActor::start_at(const StartPose& start, Timestamp now) {
  driver_.add(start, now);
  note_step();
}

void RobotActor::finish(Timestamp now) {
  driver_.finish(now);
  note_step();
}

void RobotActor::receive(const bus::Envelope& envelope, Timestamp now) {
  const auto before = node().newest_graph();
  const std::size_t updates = updates_.size();
  driver_.receive(envelope, now);
  note_step();
  const auto times = driver_.take_update_times();
  const auto& graph = node().newest_graph();
  if (graph == before) return;  // a receipt, or a graph that the node refuses or keeps
  if (companions_) companions_->receive(*graph, node().agent());
  if (updates_.size() == updates) return;
  for (const drive::UpdateTime& time : times) timing_.add(time);
  score_update(outcome(), trajectory_of(graph->graph, node().agent().chain()), association_, updates_.back());
}

void RobotActor::note_step() {
  node::Step step = driver_.take_step();
  for (const node::Event& event : step.events) {
    troubles_.note(event);
    if (const auto* found = std::get_if<node::MisfitFound>(&event.what)) note_misfit(found->misfit, misfits_);
    if (const auto* update = std::get_if<node::RobotUpdated>(&event.what)) note(*update, event.time);
  }
  step_.add(std::move(step));
}

void RobotActor::note(const node::RobotUpdated& update, Timestamp time) {
  const robot::UpdateSummary& summary = update.summary;
  if (summary.synchronised == 0) return;
  if (!estimation::is_usable(summary.optimised))
    troubles_.note("update_failed", fmt::format("the optimisation on board ended {}", to_string(summary.optimised)));
  else if (summary.taken_back)
    troubles_.note("update_failed", "the chosen constraints led farther from the map than odometry is");
  updates_.push_back(
      {.time_s = time - kMissionStart, .revision = summary.revision, .origins = summary.explanation.origins});
  explanation_ = summary.explanation;
}

RobotOutcome RobotActor::outcome() const {
  RobotOutcome out{.recording = &recording_,
                   .default_policy = timing_.policy,
                   .agents = {{timing_.policy, &node().agent()}},
                   .replayed = replay_.replayed()};
  if (!companions_) return out;
  for (auto& companion : companions_->agents()) out.agents.push_back(std::move(companion));
  return out;
}

std::vector<PolicyTiming> RobotActor::timing() const {
  std::vector<PolicyTiming> out{timing_};
  if (!companions_) return out;
  for (PolicyTiming& companion : companions_->timing()) out.push_back(std::move(companion));
  return out;
}

std::vector<std::string> RobotActor::troubles() const {
  const std::string& name = recording_.recording.name;
  Troubles all = troubles_;
  all.note("images_refused", "", driver_.more_image_errors());
  std::vector<std::string> out = all.lines(name);
  for (const std::string& line : driver_.sight().notes()) out.push_back(fmt::format("{}: {}", name, line));
  return out;
}

Status RobotActor::check_scans() const {
  const auto [refused, first] = troubles_.of("scan_refused");
  if (driver_.scans() > 0 || refused == 0) return {};
  return fail(ErrorCode::invalid, "robot {}: not one scan could be read: {} of {} failed, the first because: {}",
              recording_.recording.name, refused, refused, first);
}

}  // namespace tutti::mission
