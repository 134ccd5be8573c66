// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

/// How loop closures are found: from scans, images, or a reference. Injected, so the server never knows the sensor (or
/// the simulator). Both calls depend on the two submaps alone, never on the map or on the order of calls, may be called
/// from several threads at once, and get the submaps in the order of their ids and without their payloads.
class ClosureFinder {
 public:
  virtual ~ClosureFinder() = default;
  /// The number of what this finder makes of two submaps; every verdict carries it, and one of a larger number replaces
  /// one of a smaller. Raised by hand in the commit that changes gates, methods or which pairs are candidates, and by
  /// whoever changes a deployed finder's settings so that old answers no longer hold: a server restored from a state
  /// with smaller numbers asks every pair again, and keeps the old closures until they are answered. Nothing notices a
  /// change that leaves it as it was. A finder that takes another's place has a larger number than it had. At least 1.
  [[nodiscard]] virtual std::uint32_t version() const = 0;
  /// Do submaps that carry so much have what verify() looks at? Else they are no pair.
  [[nodiscard]] virtual bool can_compare(const PayloadSize& first, const PayloadSize& second) const = 0;
  /// Cheap: is the pair worth a verification?
  [[nodiscard]] virtual bool is_candidate(const Submap& first, const Submap& second) const = 0;
  /// Expensive: runs in a worker. What it needs of the payloads it gets from the store, when it needs it. An error,
  /// never a verdict, when one cannot be read: the pair may be verified another time.
  [[nodiscard]] virtual Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                      const PayloadStore& payloads) const = 0;
};

}  // namespace tutti::server
