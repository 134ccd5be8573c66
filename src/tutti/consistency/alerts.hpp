// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tutti/consistency/explanation.hpp"

namespace tutti::consistency {

/// Where the raw odometry was thought to part from the map at one update.
struct Suspicion {
  double time_s = 0.0;  ///< Mission time.
  std::uint64_t revision = 0;
  std::vector<SuspectedOrigin> origins;
};

/// A suspected localisation failure, followed over the updates: what two updates suspect is one when they overlap.
struct Alert {
  SuspectedOrigin origin;      ///< As last seen.
  double known_since_s = 0.0;  ///< Mission time of the first update that raised it.
  std::uint64_t known_since_revision = 0;
  /// Mission time of the first update that no longer raised it; none = it stands.
  std::optional<double> withdrawn_s;
};

/// The alerts (SuspectedOrigin::alert) of one robot's updates, in time order, put together: an alert is the same as one
/// of an earlier update when their stretches overlap, and is then known since that one; an earlier one that nothing
/// overlaps any more is withdrawn. Sorted by the start of the stretch.
std::vector<Alert> follow_alerts(std::span<const Suspicion> updates);

}  // namespace tutti::consistency
