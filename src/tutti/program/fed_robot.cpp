// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/fed_robot.hpp"

#include <algorithm>

namespace tutti::program {

/// How long an update took is noted.
void LiveRobot::receive(const bus::Envelope& envelope, Timestamp now) {
  const double begin_s = Clock::steady_s();
  double stage_s = begin_s, compare_s = 0.0, optimise_s = 0.0;
  bool is_update = false;
  node_->observe([&](robot::UpdateStage ended) {
    const double lap_s = Clock::steady_s() - std::exchange(stage_s, Clock::steady_s());
    is_update = true;
    if (ended == robot::UpdateStage::choose) compare_s = lap_s;
    if (ended == robot::UpdateStage::optimise) optimise_s = lap_s;
  });
  take(node_->receive(envelope, now));
  node_->observe({});
  if (!is_update) return;
  notes_.push_back(update_timed(1e3 * (Clock::steady_s() - begin_s), 1e3 * compare_s, 1e3 * optimise_s));
}

void FedRobot::note(const node::Step& step) {
  for (const node::Event& event : step.events) view_.note(event, robot_.node());
}

void FedRobot::publish() {
  front_.publish(view_.state(robot_.node()));
  publish_s_ = clock_.wall_s() + kPublish_s;
}

void FedRobot::wait(double wall_s) {
  if (robot_.node().is_stored()) front_.note_stored();  // by what was carried out since the last input
  publish();
  const double begin_s = clock_.wall_s(), until_s = begin_s + std::max(wall_s, kLongest_s);
  do {
    const auto input = front_.take(std::max(0.0, begin_s + wall_s - clock_.wall_s()));
    if (!input || !take(*input)) return;
  } while (clock_.wall_s() < until_s);
}

void FedRobot::end() {
  front_.close();
  while (const auto input = front_.take(0.0))
    if (!take(*input)) return;
}

void FedRobot::hear(const Input& input, Timestamp now) {
  if (const auto* images = std::get_if<EncodedImages>(&input)) return see(*images, now);
  if (const auto* range = std::get_if<RobotRange>(&input); range != nullptr && !range->name.empty()) {
    RobotRange numbered = *range;
    numbered.to = view_.number_of(range->name);
    numbered.name.clear();
    return robot_.add(std::move(numbered), now);
  }
  const robot::RobotAgent& agent = robot_.node().agent();
  const auto* scan = std::get_if<Scan>(&input);  // received before anybody knew whether it shows anything new
  const localise::Localiser* localiser = robot_.node().localiser();
  if (scan == nullptr || agent.newest_sample() != scan->stamp || agent.wants_scan() ||
      (localiser != nullptr && localiser->wants_scan(scan->stamp)))
    robot_.add(input, now);
}

/// Every image is tracked, those of keyframes are kept.
void FedRobot::see(const EncodedImages& images, Timestamp now) {
  const robot::RobotAgent& agent = robot_.node().agent();
  const bool is_keyframe = agent.wants_images(images.stamp);
  TrackedImages seen = camera_.see(images, is_keyframe);
  emit_image_errors(images.stamp, now);
  if (!is_keyframe || seen.images.empty()) return;
  if (images.sensors->imu)
    if (const auto before = agent.keyframe_before(images.stamp)) seen.imu = front_.imu(*before, images.stamp);
  robot_.add(std::move(seen), now);
}

/// To the client all; of a row of images with errors the first is an event.
void FedRobot::emit_image_errors(Timestamp stamp, Timestamp now) {
  const std::vector<Error> errors = camera_.take_errors();
  for (const Error& error : errors) {
    front_.refuse(stamp, error.message);
    if (!std::exchange(images_fail_, true))
      robot_.emit(now, node::ImagesRefused{robot_.node().agent().robot(), error.message, true});
  }
  images_fail_ = !errors.empty();
}

bool FedRobot::take(const FeedInput& input) {
  const Timestamp now = clock_.now();
  std::visit([&](const auto& what) { hear(what, now); }, input);
  front_.note_heard();
  node::Step step = robot_.take_step();
  note(step);
  if (const Status ok = taken(step); !ok) front_.refuse(stamp_of(input), ok.error().message);
  const bool is_said = !step.writes.empty() || !step.messages.empty() || !step.events.empty();
  if (is_said && !host_.carry_out(std::move(step))) return false;
  if (robot_.node().is_stored()) front_.note_stored();
  if (front_.is_drained() || clock_.wall_s() >= publish_s_) publish();
  return true;
}

}  // namespace tutti::program
