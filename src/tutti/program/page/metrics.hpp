// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "tutti/model/status.hpp"
#include "tutti/program/page/board.hpp"

namespace tutti::page {

/// The last status as Prometheus reads it: every number of the mission's, its robots' and its workers' statuses is a
/// gauge called tutti_mission_.., tutti_robot_.. or tutti_worker_.. after its field, robots and workers with the label
/// `name`; times as seconds before it. Counters by kind tell what robots have sent and were sent:
/// tutti_radio_bytes_total and tutti_radio_messages_total. May be called from several threads.
class Metrics {
 public:
  void update(const MissionStatus& status);
  /// The text format of Prometheus, version 0.0.4.
  [[nodiscard]] std::string text() const;
  /// The server's trouble; empty: it is well; nothing: nothing is known yet.
  [[nodiscard]] std::optional<std::string> trouble() const;

 private:
  mutable std::mutex mutex_;
  std::optional<MissionStatus> last_;
};

/// "radio": the bytes that robots have sent ("up") and were sent ("down"), by robot and kind.
Message radio_message(const MissionStatus& status);

}  // namespace tutti::page
