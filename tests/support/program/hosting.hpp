// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tutti/program/fed_robot.hpp"

namespace tutti::program::test {

/// Keeps what is sent, if anybody wants it.
class SentPort final : public bus::Port {
 public:
  explicit SentPort(std::vector<bus::Envelope>* sent) : sent_(sent) {}
  Status send(bus::Envelope envelope) override {
    if (sent_ != nullptr) sent_->push_back(std::move(envelope));
    return {};
  }
  std::vector<bus::Received> receive() override { return {}; }
  void acknowledge(std::uint64_t) override {}
  void still_busy(std::uint64_t) override {}

 private:
  std::vector<bus::Envelope>* sent_;
};

/// The part of HostedRobot that is about being fed.
class Hosting final : public Hosted {
 public:
  Hosting(std::unique_ptr<drive::Driver> robot, FeedFront& front, Host& host, const Clock& clock,
          const visual::TrackerConfig& tracker = {})
      : robot_(std::move(robot)), fed_(front, *robot_, host, clock, RobotView("alpha"), tracker) {}
  Answer start(Timestamp now) override {
    robot_->resume(now);
    return take_answer();
  }
  Answer receive(const bus::Received&, Timestamp) override { return {}; }
  [[nodiscard]] std::optional<Timestamp> next_work() const override { return robot_->node().next_timer(); }
  Answer work(Timestamp now) override {
    robot_->on_timer(now);
    return take_answer();
  }
  void wait(double) override { fed_.wait(0.0); }
  Answer end() override {
    fed_.end();
    robot_->store_all();
    return take_answer();
  }
  [[nodiscard]] Json status(Timestamp) const override { return {}; }
  [[nodiscard]] const robot::RobotAgent& agent() const { return robot_->node().agent(); }

 private:
  Answer take_answer() {
    Answer out{robot_->take_step(), {}};
    fed_.note(out.step);
    return out;
  }
  std::unique_ptr<drive::Driver> robot_;
  FedRobot fed_;
};

}  // namespace tutti::program::test
