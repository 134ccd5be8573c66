// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

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
  /// Names the finder; every verdict carries this id. The name is not empty, the version is at least 1 and is raised by
  /// hand in the commit that changes gates, methods or candidates, and `settings` is a hash of the finder's settings. A
  /// server that starts with another finder than before asks every pair again, and keeps the old closures until then.
  [[nodiscard]] virtual MethodId id() const = 0;
  /// All that a worker of the same program needs to make it (FinderMaker); empty: it cannot be made of this alone.
  [[nodiscard]] virtual std::string settings() const { return {}; }
  /// Do submaps that carry so much have what verify() looks at? Else they are no pair.
  [[nodiscard]] virtual bool can_compare(const PayloadSize& first, const PayloadSize& second) const = 0;
  /// Cheap: is the pair worth a verification?
  [[nodiscard]] virtual bool is_candidate(const Submap& first, const Submap& second) const = 0;
  /// Expensive: runs in a worker. What it needs of the payloads it gets from the store, when it needs it. An error,
  /// never a verdict, when one cannot be read: the pair may be verified another time.
  [[nodiscard]] virtual Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                      const PayloadStore& payloads) const = 0;
};

class MapRefiner;

/// Makes finders and refiners of what a job says of them, so that a worker needs no settings of its own.
class FinderMaker {
 public:
  virtual ~FinderMaker() = default;
  /// What it can make: without settings when it can with any.
  [[nodiscard]] virtual std::vector<MethodId> can() const = 0;
  /// One of exactly this id, or an error that says what is missing. Not null.
  [[nodiscard]] virtual Result<std::shared_ptr<const ClosureFinder>> finder(const MethodId& id,
                                                                            const std::string& settings) const = 0;
  [[nodiscard]] virtual Result<std::shared_ptr<const MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string& settings) const = 0;
};

}  // namespace tutti::server
