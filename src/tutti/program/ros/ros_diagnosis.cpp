// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_diagnosis.hpp"

#include <fmt/format.h>

namespace tutti::ros {

bags::RosDiagnostic diagnosis(const RosSituation& situation) {
  constexpr std::uint8_t kFine = 0, kWarning = 1, kError = 2;
  bags::RosDiagnostic out{.level = kFine, .name = situation.name, .message = {}, .hardware_id = {}, .values = {}};
  const auto add = [&](const std::string& key, const auto& value) {
    out.values.emplace_back(key, fmt::format("{}", value));
  };
  add("connection", situation.is_connected ? "feeding" : "away");
  add("odometry", situation.counts.odometry);
  add("odometry_missed", situation.counts.missed);
  add("scans", situation.counts.scans);
  add("scans_missed", situation.counts.missed_scans);
  add("fixes", situation.counts.fixes);
  add("refused", situation.counts.refused);
  add("in_map", situation.in_map);
  for (const auto& [name, text] : situation.status) add(name, text);
  for (std::size_t i = 0; i < situation.alerts.size(); ++i) add(fmt::format("alert {}", i), situation.alerts[i]);
  for (std::size_t i = 0; i < situation.troubles.size(); ++i) add(fmt::format("trouble {}", i), situation.troubles[i]);
  const auto say = [&](std::uint8_t level, const std::string& message) {
    out.level = level;
    out.message = message;
  };
  say(kFine, situation.in_map ? "fed, and on the map" : "fed, not in a map yet");
  if (situation.counts.odometry == 0) say(kWarning, "no odometry yet");
  if (!situation.troubles.empty()) say(kWarning, situation.troubles.back());
  if (!situation.alerts.empty()) say(kWarning, situation.alerts.back());
  if (!situation.is_connected) say(kError, "no robot program");
  return out;
}

}  // namespace tutti::ros
