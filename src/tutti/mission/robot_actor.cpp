// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_actor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/mission/load_meter.hpp"
#include "tutti/mission/misfit_record.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mission {

robot::AgentConfig with_sensors(robot::AgentConfig config, const Recording& recording) {
  config.submap.has_scans = recording.scans != nullptr;
  config.submap.has_images = recording.visual != nullptr;
  return config;
}

void UpdateStopwatch::stage_ended(robot::UpdateStage stage) {
  const double ms = stage_.lap_ms();
  if (stage == robot::UpdateStage::choose) timing_.comparison_ms.push_back(ms);
  if (stage == robot::UpdateStage::optimise) timing_.optimisation_ms.push_back(ms);
}

RobotActor::RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
                       const evaluation::AssociationConfig& association, std::unique_ptr<Companions> companions,
                       std::shared_ptr<const localise::Localiser::Setup> localise)
    : RobotActor(recording, association, config.policy.name) {
  companions_ = std::move(companions);
  nothing_ = std::make_unique<const storage::MemoryStore>(storage::robot_schema());
  node_ =
      node::RobotNode::open(
          recording.recording.robot, 0,
          {.agent = with_sensors(config, recording.recording), .keeps_state = false, .localise = std::move(localise)},
          *nothing_)
          .value();
}

Result<std::unique_ptr<RobotActor>> RobotActor::open(const MissionRecording& recording,
                                                     const node::RobotNodeConfig& config,
                                                     const evaluation::AssociationConfig& association,
                                                     std::uint64_t session, const storage::TableStore& store) {
  std::unique_ptr<RobotActor> actor(new RobotActor(recording, association, config.agent.policy.name));
  node::RobotNodeConfig own = config;
  own.agent = with_sensors(config.agent, recording.recording);
  auto node = node::RobotNode::open(recording.recording.robot, session, own, store);
  if (!node) return tl::unexpected(node.error());
  actor->node_ = std::move(*node);
  if (const auto newest = actor->node_->agent().newest_sample()) {
    const Trajectory& odometry = recording.recording.odometry;
    const auto next = std::ranges::upper_bound(odometry, *newest, {}, &StampedPose::stamp);
    actor->next_ = static_cast<std::size_t>(next - odometry.begin());
    const Timestamp settled = *actor->node_->agent().settled();
    const Recording& from = recording.recording;
    const auto skip = [&](const std::vector<Timestamp>& stamps, std::size_t& first) {
      for (auto stamp = stamp_at(from, stamps, first); stamp && *stamp < settled; stamp = stamp_at(from, stamps, first))
        ++first;
    };
    skip(from.scan_stamps, actor->next_scan_);
    skip(from.image_stamps, actor->next_images_);
    const auto first = std::ranges::lower_bound(from.measured, settled, {}, stamp_of);
    actor->next_measured_ = static_cast<std::size_t>(first - from.measured.begin());
  }
  return actor;
}

/// What sensors saw since all was settled, and the end of the recording, may not have been stored.
void RobotActor::resume(Timestamp now) {
  take(node_->resume(now));
  if (next_ == 0) return;
  feed_sensors(now);
  if (next_ == recording_.recording.odometry.size()) take(node_->finish(now));
}

double RobotActor::next_time() const {
  const Trajectory& odometry = recording_.recording.odometry;
  if (next_ >= odometry.size()) return std::numeric_limits<double>::infinity();
  return recording_.start_s + (odometry[next_].stamp - odometry.front().stamp);
}

void RobotActor::replay_next(Timestamp now) {
  const Recording& recording = recording_.recording;
  OdometrySample sample{recording.odometry[next_].stamp, recording.odometry[next_].pose};
  if (next_ > 0) sample.increment_covariance = recording.increment_covariance[next_ - 1];
  if (companions_) companions_->add(sample);
  {
    const CpuScope cpu(cpu_s_);
    take(node_->add(sample, now));
  }
  ++next_;
  feed_sensors(now);
  if (next_ == recording.odometry.size()) take(node_->finish(now));
}

void RobotActor::take(node::Step step) {
  for (const node::Event& event : step.events) note_event(event);
  step_.add(std::move(step));
}

void RobotActor::note_event(const node::Event& event) {
  if (const auto* sample = std::get_if<node::SampleRefused>(&event.what)) note(refused_samples_, sample->why);
  if (const auto* jumped = std::get_if<node::OdometryJumped>(&event.what)) note(jumps_, to_string(jumped->jump));
  if (const auto* found = std::get_if<node::MisfitFound>(&event.what)) note_misfit(found->misfit, misfits_);
  if (const auto* scan = std::get_if<node::ScanRefused>(&event.what)) note(refused_scans_, scan->why);
  if (const auto* images = std::get_if<node::ImagesRefused>(&event.what)) note(refused_images_, images->why);
  if (const auto* fix = std::get_if<node::FixRefused>(&event.what)) note(refused_fixes_, fix->why);
  if (const auto* missing = std::get_if<node::SensorMissing>(&event.what); missing != nullptr && missing->keyframes > 0)
    note(missing_sensors_, fmt::format("from {:.0f} s on {} keyframes had no {}", event.time - kMissionStart,
                                       missing->keyframes, missing->sensor));
  if (const auto* update = std::get_if<node::RobotUpdated>(&event.what)) note_update(*update, event.time);
}

void RobotActor::feed_sensors(Timestamp now) {
  const Recording& recording = recording_.recording;
  const Timestamp newest = recording.odometry[next_ - 1].stamp;
  for (; next_measured_ < recording.measured.size(); ++next_measured_) {
    const Input& sample = recording.measured[next_measured_];
    if (stamp_of(sample) > newest) break;
    if (stamp_of(sample) >= recording.odometry.front().stamp) take(node_->add(sample, now));
  }
  while (true) {
    const auto scan = recording.scans ? stamp_at(recording, recording.scan_stamps, next_scan_) : std::nullopt;
    const auto images = recording.visual ? stamp_at(recording, recording.image_stamps, next_images_) : std::nullopt;
    if (!scan && !images) return;
    const Timestamp stamp = scan && images ? std::min(*scan, *images) : scan ? *scan : *images;
    if (stamp > newest) return;
    const bool has_scan = scan == stamp, has_images = images == stamp;
    if (stamp >= recording.odometry.front().stamp) feed_at(stamp, has_scan, has_images, now);
    if (has_scan) ++next_scan_;
    if (has_images) ++next_images_;
  }
}

void RobotActor::feed_at(Timestamp stamp, bool has_scan, bool has_images, Timestamp now) {
  const robot::RobotAgent& agent = node_->agent();
  const bool wants_scan = has_scan && node_->wants_scan(stamp);
  const bool wants_images = has_images && agent.wants_images(stamp);
  if (wants_scan) feed_scan(now);
  if (has_images) feed_images(stamp, wants_images, now);
  if (agent.keyframes().empty() || agent.keyframes().back().stamp != stamp) return;
  if (companions_) companions_->add_keyframe_time(stamp);
}

void RobotActor::feed_scan(Timestamp now) {
  const auto scan = recording_.recording.scans->scan(next_scan_);
  if (!scan) return note(refused_scans_, scan.error().message);
  if (!*scan) return;
  const CpuScope cpu(cpu_s_);
  const std::size_t refused = refused_scans_.count;
  take(node_->add(**scan, now));
  if (refused == refused_scans_.count) ++taken_scans_;
}

/// Since the last keyframe before `stamp`.
std::vector<ImuSample> RobotActor::imu_since_keyframe(Timestamp stamp) const {
  const auto before = node_->agent().keyframe_before(stamp);
  return before ? imu_over(recording_.recording.imu, *before, stamp) : std::vector<ImuSample>();
}

/// Every image is tracked, those of keyframes are kept.
void RobotActor::feed_images(Timestamp stamp, bool keyframe, Timestamp now) {
  const Recording& recording = recording_.recording;
  TrackedImages images = recording.visual->images(next_images_, keyframe);
  refuse_images(recording.visual->take_errors(), now);
  if (!keyframe) return;
  if (const auto stopped = sight_.add(stamp, images.images)) report_refused(*stopped, now);
  if (images.images.empty()) return;
  const CpuScope cpu(cpu_s_);
  images.imu = imu_since_keyframe(images.stamp);
  images.imu_noise = recording.imu_noise;
  take(node_->add(std::move(images), now));
}

void RobotActor::report_refused(const std::string& why, Timestamp now) {
  node::Step step;
  step.emit(now, node::ImagesRefused{id(), why});
  take(std::move(step));
}

/// All are counted; of a row of samples with errors the first is reported.
void RobotActor::refuse_images(const std::vector<Error>& errors, Timestamp now) {
  for (const Error& error : errors)
    if (std::exchange(images_fail_, true))
      note(refused_images_, error.message);
    else
      report_refused(error.message, now);
  images_fail_ = !errors.empty();
}

void RobotActor::receive(const bus::Envelope& envelope, Timestamp now) {
  if (envelope.kind == bus::MessageKind::receipt) return take(node_->receive(envelope, now));
  const auto graph = node_->graph_in(envelope);
  if (!graph || !*graph) return take(node_->receive(envelope, now));  // which refuses it, or keeps it
  const ProxyGraphMessage& message = **graph;
  const std::size_t updates = updates_.size();
  update(envelope, now);
  if (companions_) companions_->receive(message, node_->agent());
  if (updates_.size() > updates) score(trajectory_of(message.graph, node_->agent().chain()), updates_.back());
}

void RobotActor::score(const Trajectory& map, UpdateRecord& update) const {
  Trajectory truth;
  if (recording_.score_against_reference)
    for (const auto& pair : evaluation::associate(map, recording_.recording.reference, association_))
      truth.push_back({pair.stamp, pair.reference});
  const auto rmse = [&](const Trajectory& estimate) -> std::optional<double> {
    const auto error = evaluation::agreement(estimate, truth);
    return error ? std::optional(error->rmse_m) : std::nullopt;
  };
  Trajectory odometry;
  for (const Keyframe& keyframe : node_->agent().keyframes())
    odometry.push_back({keyframe.stamp, keyframe.T_odom_body});
  update.onboard_rmse_m = rmse(odometry);
  update.server_rmse_m = rmse(map);
  for (const auto& [policy, agent] : agents())
    update.answers.push_back({policy, agent->ledger().size(), rmse(agent->corrected())});
}

void RobotActor::update(const bus::Envelope& envelope, Timestamp now) {
  const CpuScope cpu(cpu_s_);
  UpdateStopwatch stopwatch(timing_);
  const std::size_t before = updates_.size();
  node_->observe([&](robot::UpdateStage stage) { stopwatch.stage_ended(stage); });
  take(node_->receive(envelope, now));
  node_->observe({});
  if (updates_.size() > before) stopwatch.update_ended();
}

void RobotActor::note_update(const node::RobotUpdated& update, Timestamp time) {
  const robot::UpdateSummary& summary = update.summary;
  if (summary.synchronised == 0) return;
  if (!estimation::is_usable(summary.optimised))
    note(failed_updates_, fmt::format("the optimisation on board ended {}", to_string(summary.optimised)));
  else if (summary.taken_back)
    note(failed_updates_, "the chosen constraints led farther from the map than odometry is");
  updates_.push_back(
      {.time_s = time - kMissionStart, .revision = summary.revision, .origins = summary.explanation.origins});
  explanation_ = summary.explanation;
}

std::vector<std::pair<std::string, const robot::RobotAgent*>> RobotActor::agents() const {
  std::vector<std::pair<std::string, const robot::RobotAgent*>> out{{policy_, &node_->agent()}};
  if (!companions_) return out;
  for (auto& companion : companions_->agents()) out.push_back(std::move(companion));
  return out;
}

RobotOutcome RobotActor::outcome() const {
  return {.recording = &recording_, .default_policy = policy_, .agents = agents(), .replayed = next_};
}

std::vector<PolicyTiming> RobotActor::timing() const {
  std::vector<PolicyTiming> out{timing_};
  if (!companions_) return out;
  for (PolicyTiming& companion : companions_->timing()) out.push_back(std::move(companion));
  return out;
}

void RobotActor::note(Trouble& trouble, const std::string& message) {
  if (trouble.count++ == 0) trouble.first = message;
}

std::vector<std::string> RobotActor::troubles() const {
  std::vector<std::string> out;
  const auto add = [&](const Trouble& trouble, const char* what) {
    if (trouble.count > 0)
      out.push_back(fmt::format("{}: {} {}, the first because: {}", recording_.recording.name, trouble.count, what,
                                trouble.first));
  };
  add(refused_samples_, "samples refused");
  add(jumps_, "steps of odometry that no body makes");
  add(refused_scans_, "wanted scans that are not there or no good");
  add(refused_images_, "times images refused");
  add(refused_fixes_, "fixes refused");
  add(missing_sensors_, "times a sensor was missing");
  for (const std::string& line : sight_.notes()) out.push_back(fmt::format("{}: {}", recording_.recording.name, line));
  add(failed_updates_, "updates without a correction");
  return out;
}

Status RobotActor::check_scans() const {
  if (taken_scans_ > 0 || refused_scans_.count == 0) return {};
  return fail(ErrorCode::invalid, "robot {}: not one scan could be read: {} of {} failed, the first because: {}",
              recording_.recording.name, refused_scans_.count, refused_scans_.count, refused_scans_.first);
}

}  // namespace tutti::mission
