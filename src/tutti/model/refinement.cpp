// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/refinement.hpp"

namespace tutti {

Refinement answer_to(const RefinementJob& job) {
  Refinement out{.job = job.id, .revision = job.revision, .whole = job.whole, .closed = job.closed};
  for (const RefinementJob::Part& part : job.parts)
    if (part.is_free) out.submaps.push_back(part.submap);
  return out;
}

}  // namespace tutti
