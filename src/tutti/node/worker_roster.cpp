// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/worker_roster.hpp"

#include <algorithm>

namespace tutti::node {
namespace {

constexpr double kIsThere_s = 10.0;  // five of its statuses
constexpr double kIsGone_s = 300.0;
constexpr std::size_t kMostWorkers = 1000;

}  // namespace

void WorkerRoster::hear(std::uint32_t number, const NodeStatus& status, Timestamp now) {
  std::erase_if(workers_, [&](const auto& entry) { return now - entry.second.last_seen > kIsGone_s; });
  if (workers_.size() >= kMostWorkers && !workers_.contains(number))
    workers_.erase(std::ranges::min_element(workers_, {}, [](const auto& entry) { return entry.second.last_seen; }));
  workers_.insert_or_assign(number, MissionStatus::Worker{number, now, status});
}

bool WorkerRoster::any_can(const MethodId& id, Timestamp now) const {
  return std::ranges::any_of(workers_, [&](const auto& entry) {
    return now - entry.second.last_seen <= kIsThere_s && can(entry.second.status, id);
  });
}

bool can(const NodeStatus& worker, const MethodId& id) {
  return std::ranges::any_of(worker.can, [&](const MethodId& can) {
    return can.name == id.name && can.version == id.version && (can.settings == 0 || can.settings == id.settings);
  });
}

}  // namespace tutti::node
