// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// The alerts (SuspectedOrigin::alert) of one robot's updates, in time order, put together: an alert is the same as one
/// of an earlier update when their stretches overlap, and is then known since that one; an earlier one that nothing
/// overlaps any more is withdrawn. Sorted by the start of the stretch.
std::vector<AlertRecord> follow_alerts(std::span<const UpdateRecord> updates);

}  // namespace tutti::mission
