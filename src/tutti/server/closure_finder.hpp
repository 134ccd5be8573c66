// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/model/loop_closure.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::server {

/// How loop closures are found: from scans, images, or a reference. Injected, so the server never knows the sensor (or
/// the simulator). Both calls depend on the two submaps alone, never on the map or on the order of calls, may be called
/// from several threads at once, and get the submaps in the order of their ids.
class ClosureFinder {
 public:
  virtual ~ClosureFinder() = default;
  /// Cheap: is the pair worth a verification?
  [[nodiscard]] virtual bool is_candidate(const Submap& first, const Submap& second) const = 0;
  /// Expensive: runs in a worker.
  [[nodiscard]] virtual ClosureVerdict verify(const Submap& first, const Submap& second) const = 0;
};

}  // namespace tutti::server
