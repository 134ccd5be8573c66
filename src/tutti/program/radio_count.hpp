// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>

#include "tutti/bus/envelope.hpp"

namespace tutti::program {

/// What the server has exchanged with robots since it was started, by kind: bytes of messages as the bus is given them
/// and gives them, without what the bus adds. A message that comes or goes again counts again.
class RadioCount {
 public:
  static constexpr std::size_t kMostRobots = 1'000;  ///< A stranger may call himself anything.
  struct Key {
    RobotId robot;
    bool is_down = false;  ///< To the robot.
    bus::MessageKind kind{};
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  struct Sum {
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
    friend bool operator==(const Sum&, const Sum&) = default;
  };
  using Sums = std::map<Key, Sum>;

  void count(const bus::Envelope& message) {
    const auto to = message.to.robot(), from = message.from.robot();
    if (!to && !from) return;
    const Key key{to ? *to : *from, to.has_value(), message.kind};
    if (robots_.size() >= kMostRobots && !robots_.contains(key.robot)) return;
    robots_.insert(key.robot);
    Sum& sum = sums_[key];
    ++sum.messages;
    sum.bytes += message.bytes->size();
  }
  [[nodiscard]] const Sums& sums() const { return sums_; }

 private:
  std::set<RobotId> robots_;
  Sums sums_;
};

}  // namespace tutti::program
