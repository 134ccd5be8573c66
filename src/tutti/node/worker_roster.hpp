// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// The workers that a server has heard, and the methods that each one has.
class WorkerRoster {
 public:
  void hear(std::uint32_t number, const NodeStatus& status, Timestamp now);
  /// True if a worker that was heard recently has this verifier or refiner.
  [[nodiscard]] bool any_can(const MethodId& id, Timestamp now) const;
  [[nodiscard]] const std::map<std::uint32_t, MissionStatus::Worker>& all() const { return workers_; }

 private:
  std::map<std::uint32_t, MissionStatus::Worker> workers_;  // the latest status of each
};

/// True if this worker has the verifier or refiner, or can make it from its settings.
bool can(const NodeStatus& worker, const MethodId& id);

}  // namespace tutti::node
