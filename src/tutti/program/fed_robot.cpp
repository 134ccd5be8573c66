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

bool FedRobot::take(const FeedInput& input) {
  const Timestamp now = clock_.now();
  Timestamp stamp;
  if (const auto* sample = std::get_if<node::OdometrySample>(&input)) {
    stamp = sample->stamp;
    robot_.add_odometry(*sample, now);
  } else if (const auto* scan = std::get_if<Scan>(&input)) {
    stamp = scan->stamp;
    // It was received before anybody knew whether it shows anything new.
    const robot::RobotAgent& agent = robot_.node().agent();
    if (agent.newest_sample() != stamp || agent.wants_scan()) robot_.add_scan(*scan, now);
  } else {
    robot_.finish(now);
  }
  front_.note_heard();
  node::Step step = robot_.take_step();
  note(step);
  if (const Status ok = taken(step); !ok) front_.refuse(stamp, ok.error().message);
  const bool is_said = !step.writes.empty() || !step.messages.empty() || !step.events.empty();
  if (is_said && !host_.carry_out(std::move(step))) return false;
  if (robot_.node().is_stored()) front_.note_stored();
  if (front_.is_drained() || clock_.wall_s() >= publish_s_) publish();
  return true;
}

}  // namespace tutti::program
