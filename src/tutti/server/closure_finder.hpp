// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/server/cloud_store.hpp"

namespace tutti::server {

/// How loop closures are found: from scans, images, or a reference. Injected, so the server never knows the sensor (or
/// the simulator). Both calls depend on the two submaps alone, never on the map or on the order of calls, may be called
/// from several threads at once, and get the submaps in the order of their ids and without their clouds.
class ClosureFinder {
 public:
  virtual ~ClosureFinder() = default;
  /// Does verify() look at clouds? Then submaps that have none are in no pair.
  [[nodiscard]] virtual bool needs_clouds() const = 0;
  /// Cheap: is the pair worth a verification?
  [[nodiscard]] virtual bool is_candidate(const Submap& first, const Submap& second) const = 0;
  /// Expensive: runs in a worker. What it needs of the clouds it gets from the store, when it needs it. An error, never
  /// a verdict, when a cloud cannot be read: the pair may be verified another time.
  [[nodiscard]] virtual Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                      const CloudStore& clouds) const = 0;
};

}  // namespace tutti::server
