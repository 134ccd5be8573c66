// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

struct BagPlayOptions {
  std::vector<std::string> bags;    ///< Bags of one clock, played together by the times at which messages were logged.
  std::string name_space;           ///< Prefix of every topic but /tf, /tf_static and /clock; empty: none.
  std::vector<std::string> topics;  ///< Topics to play, by their names in the bags; empty: all.
  /// Topics, by their published names, that must each have a subscriber before playing starts.
  std::vector<std::string> wait_for;
  double delay_s = 1.0;  ///< Wall time before the first message, in which subscribers discover the topics.
  double rate = 1.0;     ///< Speed, as a multiple of real time.
  bool clock = false;    ///< Also publish /clock, 40 times per second of wall time.
  std::function<void(const std::string&)> say;  ///< Gets what is left out, and what the player waits for.
};

struct BagPlayed {
  std::uint64_t messages = 0, topics = 0;
  double bag_s = 0.0, wall_s = 0.0;
  double latest_s = 0.0;  ///< The largest delay of any message, in wall time.
};

/// Publishes the messages of bags, byte by byte as recorded, like ROS 2's own player. Publishers are reliable, which
/// matches subscribers of any kind: a reliable subscriber that keeps all messages slows the player down and loses
/// nothing, a best-effort one may lose messages. Returns when reliable subscribers have everything (or 10 s after the
/// last message), or at `stop`. Fails when a bag cannot be read or a topic not be published.
Result<BagPlayed> play(const BagPlayOptions& options, const std::shared_ptr<Participant>& participant,
                       const std::atomic<bool>& stop);

}  // namespace tutti::ros
