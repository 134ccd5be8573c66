// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// The workers that a server has heard of, and what each says it can do.
class WorkerRoster {
 public:
  void hear(std::uint32_t number, const NodeStatus& status, Timestamp now);
  /// Is a worker there that has this finder or refiner?
  [[nodiscard]] bool any_can(const MethodId& id, Timestamp now) const;
  [[nodiscard]] const std::map<std::uint32_t, MissionStatus::Worker>& all() const { return workers_; }

 private:
  std::map<std::uint32_t, MissionStatus::Worker> workers_;  // the last heard
};

/// Has this worker the finder or refiner, or can it make it of its settings?
bool can(const NodeStatus& worker, const MethodId& id);

}  // namespace tutti::node
