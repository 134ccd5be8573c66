// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

/// Refines a map with more than its pose graph, such as bundle adjustment of what cameras saw. It is injected, so that
/// the server knows no sensors.
class MapRefiner {
 public:
  virtual ~MapRefiner() = default;
  /// Identifies the refiner, as ClosureVerifier::id() does a verifier. Without a name, only a worker that was given
  /// this very refiner can do its jobs.
  [[nodiscard]] virtual MethodId id() const { return {}; }
  [[nodiscard]] virtual std::string settings() const { return {}; }
  /// True if a submap with a payload of this size has what refine() needs; other submaps take no part.
  [[nodiscard]] virtual bool can_refine(const PayloadSize& size) const = 0;
  /// Answers a job; expensive, so it runs in a worker. A pure function that any thread may call. `submaps` are those of
  /// the job, without payloads; these are loaded from `payloads`. An error means that one could not be read, and the
  /// job may be done another time.
  [[nodiscard]] virtual Result<Refinement> refine(const RefinementJob& job, const SubmapSet& submaps,
                                                  const PayloadStore& payloads) const = 0;
};

}  // namespace tutti::server
