// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/mission_events.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

namespace tutti::mission {

void MissionEvents::take(const node::Event& event) {
  if (const auto* refused = std::get_if<node::MessageRefused>(&event.what)) refusals_.push_back(refused->why);
  if (const auto* failed = std::get_if<node::VerificationFailed>(&event.what);
      failed != nullptr && failed_.insert(failed->pair).second)
    refusals_.push_back(failed->why);
  if (const auto* failed = std::get_if<node::RefinementFailed>(&event.what)) refusals_.push_back(failed->why);
  if (const auto* update = std::get_if<node::MapUpdated>(&event.what))
    updates_.push_back({.time_s = static_cast<double>(event.time.ns) / 1e9,
                        .closures = update->accepted,
                        .cost = update->cost,
                        .degrees_of_freedom = update->degrees_of_freedom,
                        .from_measurements = update->from_measurements});
  if (const auto* changed = std::get_if<node::ChangeOfMind>(&event.what))
    take(ChangeOfMindRecord{changed->robot, static_cast<double>(event.time.ns) / 1e9, changed->change,
                            server::to_string(changed->reason)});
}

void MissionEvents::note_refusals(MissionRecord& record) const {
  if (!refusals_.empty())
    record.notes.push_back(
        fmt::format("{} messages were refused, the first because: {}", refusals_.size(), refusals_.front()));
}

}  // namespace tutti::mission
