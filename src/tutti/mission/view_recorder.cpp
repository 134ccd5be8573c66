// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/view_recorder.hpp"

#include <algorithm>
#include <utility>

#include "tutti/mapfile/placement.hpp"
#include "tutti/program/page/cloud_bytes.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::mission {

void ViewRecorder::take(const mapfile::ShownMap& map, const std::optional<MissionStatus>& status,
                        const std::map<SubmapId, double>& sigma_m) {
  const double time_s = map.time - Timestamp{};
  last_s_ = time_s;
  const std::uint64_t before = board_.sequence();
  const auto holding = page::closures_holding(map.content.submaps, map.map);
  page::MapMessages messages = page::map_messages(map, holding, sigma_m);
  board_.put_all("submap/", std::move(messages.submaps), time_s);
  board_.put(std::move(messages.poses));
  board_.put_all("closure/", std::move(messages.closures), time_s);
  std::vector<page::Alert> alerts = alerts_.of_map(map, holding);
  if (status) {
    board_.put(page::status_message(*status));
    alerts = page::joined(std::move(alerts), alerts_.of_status(*status));
  }
  board_.put(page::alerts_message(alerts, time_s));
  for (const auto& message : board_.after(before)) messages_.push_back(message->message());
}

ViewRecord ViewRecorder::finish(const mapfile::ShownMap& last, const std::optional<MissionStatus>& status,
                                const server::PayloadStore& payloads) && {
  take(last, status, page::compare_all(last).sigma_m);
  ViewRecord out{.messages = std::move(messages_), .clouds = {}, .T_odom_submap = {}, .T_upright_world = {}};
  for (std::uint32_t component = 0; component < last.map.components; ++component)
    out.T_upright_world[component] = mapfile::upright_frame(last.map, component);
  for (const auto& [id, submap] : last.content.submaps) out.T_odom_submap[id] = submap->keyframes.front().T_odom_body;
  std::size_t with_cloud = 0;
  for (const auto& [id, size] : last.content.payload_sizes) with_cloud += size.points > 0 ? 1 : 0;
  for (const auto& [id, size] : last.content.payload_sizes) {
    if (size.points == 0) continue;
    if (const auto cloud = payloads.cloud(id); cloud && *cloud != nullptr)
      out.clouds[to_string(id)] = page::cloud_bytes(**cloud, kMostPoints / with_cloud);
  }
  return out;
}

}  // namespace tutti::mission
