// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/fed_robot.hpp"

#include <algorithm>

namespace tutti::program {

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
  robot_.add(input, now);
}

void FedRobot::see(const EncodedImages& images, Timestamp now) {
  const auto track = [&](bool keyframe) {
    drive::Driver::Seen seen = camera_.see(images, keyframe);
    for (const Error& error : seen.errors) front_.refuse(images.stamp, error.message);
    return seen;
  };
  const auto imu = [&](Timestamp keyframe) {
    return images.sensors->imu ? front_.imu(keyframe, images.stamp) : std::vector<ImuSample>();
  };
  robot_.see(images.stamp, track, imu, now);
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
