// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "tutti/bus/envelope.hpp"
#include "tutti/model/status.hpp"

namespace tutti::program {

/// Counts what the server exchanges with robots (MissionStatus::radio).
class RadioCount {
 public:
  static constexpr std::size_t kMostRobots = 1'000;  ///< A stranger may call himself anything.

  void count(const bus::Envelope& message) {
    const auto to = message.to.robot(), from = message.from.robot();
    if (!to && !from) return;
    const RobotId robot = to ? *to : *from;
    if (robots_.size() >= kMostRobots && !robots_.contains(robot)) return;
    robots_.insert(robot);
    Sum& sum = sums_[{robot, to.has_value(), message.kind}];
    ++sum.messages;
    sum.bytes += message.bytes->size();
  }
  [[nodiscard]] std::vector<MissionStatus::Radio> sums() const {
    std::vector<MissionStatus::Radio> out;
    for (const auto& [key, sum] : sums_) {
      const auto& [robot, is_down, kind] = key;
      out.push_back({robot, is_down, wire::name(kind), sum.messages, sum.bytes});
    }
    return out;
  }

 private:
  struct Sum {
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
  };
  std::set<RobotId> robots_;
  std::map<std::tuple<RobotId, bool, bus::MessageKind>, Sum> sums_;
};

}  // namespace tutti::program
