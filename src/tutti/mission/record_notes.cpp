// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/record_notes.hpp"

#include <fmt/format.h>

#include "tutti/wire/codec.hpp"

namespace tutti::mission {

void note_undelivered(const std::map<bus::InProcessBus::Topic, std::size_t>& undelivered, MissionRecord& record) {
  const auto name = [&](const bus::Endpoint& end) {
    return end.robot ? record.robots[end.robot->value].name : "server";
  };
  for (const auto& [topic, messages] : undelivered) {
    const auto& [from, to, kind] = topic;
    record.notes.push_back(fmt::format("{} to {}: {} x {} never delivered; the link would have taken more than a day",
                                       name(from), name(to), messages, wire::name(kind)));
  }
}

void note_what_the_map_lacks(const server::MapEstimate& map, MissionRecord& record) {
  if (!map.left_out.empty()) {
    const SubmapId first = map.left_out.front();
    record.notes.push_back(fmt::format(
        "{} submaps are not in the map, because they contradict earlier ones of their robot or keep the map from being "
        "solved; the first is {} of {}",
        map.left_out.size(), first.index, record.robots[first.robot.value].name));
  }
  if (map.spare_pairs > 0)
    record.notes.push_back(
        fmt::format("{} pairs of submaps have closures that the map does not need and that were not judged "
                    "(server.map.most_closed_pairs)",
                    map.spare_pairs));
}

}  // namespace tutti::mission
