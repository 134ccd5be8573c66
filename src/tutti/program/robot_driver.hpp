// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::program {

/// The robot in a robot program: its node, and the recording that it replays, if any.
class RobotDriver {
 public:
  virtual ~RobotDriver() = default;
  [[nodiscard]] virtual const node::RobotNode& node() const = 0;
  // As RobotNode's functions with these names; the steps that they make wait for take_step().
  virtual void resume(Timestamp now) = 0;
  virtual void on_timer(Timestamp now) = 0;
  virtual void receive(const bus::Envelope& envelope, Timestamp now) = 0;
  virtual void finish(Timestamp now) = 0;
  virtual void store_all() = 0;
  virtual node::Step take_step() = 0;
  /// Mission time of the next recorded sample, s; infinity when there is none, or samples are fed.
  [[nodiscard]] virtual double next_time() const { return std::numeric_limits<double>::infinity(); }
  virtual void replay_next(Timestamp /*now*/) {}
  /// The events since the last call that are not in steps.
  virtual std::vector<Json> take_notes() { return {}; }
};

inline constexpr const char* kUpdateTimed = "update_timed";
/// The event with this name: how long an update of the map took.
inline Json update_timed(double update_ms, double comparison_ms, double optimisation_ms) {
  return {{"event", kUpdateTimed},
          {"update_ms", update_ms},
          {"comparison_ms", comparison_ms},
          {"optimisation_ms", optimisation_ms}};
}

/// Makes the driver of a robot that replays a recording, on its store. It is called again when the store could not be
/// written.
using ReplayMaker = std::function<Result<std::unique_ptr<RobotDriver>>(
    const node::RobotNodeConfig& config, std::uint64_t session, const storage::TableStore& store)>;

/// The driver of a robot whose samples are fed.
class LiveRobot final : public RobotDriver {
 public:
  explicit LiveRobot(std::unique_ptr<node::RobotNode> node) : node_(std::move(node)) {}
  [[nodiscard]] const node::RobotNode& node() const override { return *node_; }
  void resume(Timestamp now) override { take(node_->resume(now)); }
  void on_timer(Timestamp now) override { take(node_->on_timer(now)); }
  void receive(const bus::Envelope& envelope, Timestamp now) override;
  void finish(Timestamp now) override { take(node_->finish(now)); }
  void store_all() override { take(node_->store_all()); }
  node::Step take_step() override { return std::exchange(step_, {}); }
  std::vector<Json> take_notes() override { return std::exchange(notes_, {}); }
  void add(const Input& input, Timestamp now) { take(node_->add(input, now)); }
  void begin_session(const std::string& why, Timestamp now) { take(node_->begin_session(why, now)); }
  /// Reports what became of samples before they reached the node.
  void emit(Timestamp now, const node::ImagesRefused& what) { step_.emit(now, what); }
  void expect_sensors(bool scans, bool images) { node_->expect_sensors(scans, images); }

 private:
  void take(node::Step step) { step_.add(std::move(step)); }

  std::unique_ptr<node::RobotNode> node_;
  node::Step step_;
  std::vector<Json> notes_;
};

}  // namespace tutti::program
