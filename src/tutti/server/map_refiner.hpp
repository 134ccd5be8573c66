// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/result.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

/// What knows more of the map than its pose graph does: bundle adjustment of what cameras saw. Injected, so the server
/// never knows the sensor.
class MapRefiner {
 public:
  virtual ~MapRefiner() = default;
  /// As a finder's (closure_finder.hpp); without a name: only who was given this one can do its jobs.
  [[nodiscard]] virtual MethodId id() const { return {}; }
  [[nodiscard]] virtual std::string settings() const { return {}; }
  /// Does a submap that carries so much have what refine() looks at? Else it takes no part.
  [[nodiscard]] virtual bool can_refine(const PayloadSize& size) const = 0;
  /// Expensive: runs in a worker. A pure function; may be called from any thread. `submaps`: those of the job, without
  /// their payloads, which it gets from the store. An error when one cannot be read: it may be tried another time.
  [[nodiscard]] virtual Result<Refinement> refine(const RefinementJob& job, const SubmapSet& submaps,
                                                  const PayloadStore& payloads) const = 0;
};

}  // namespace tutti::server
