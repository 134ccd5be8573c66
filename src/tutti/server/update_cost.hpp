// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/server/map_job.hpp"

namespace tutti::server {

/// The cost of an update in seconds of CPU, counted instead of measured: by it a mission in virtual time paces its
/// updates, and so has the same maps on any machine. docs/math.md, "When an update begins", says how.
double counted_cost_s(const MadeMap& made);

}  // namespace tutti::server
