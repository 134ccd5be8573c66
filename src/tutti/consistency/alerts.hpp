// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tutti/consistency/explanation.hpp"

namespace tutti::consistency {

/// The segments that one update of a robot suspects, of odometry that left the map.
struct Suspicion {
  double time_s = 0.0;  ///< Mission time.
  std::uint64_t revision = 0;
  std::vector<SuspectedOrigin> origins;
};

/// A suspected localisation failure, followed over a robot's updates.
struct Alert {
  SuspectedOrigin origin;      ///< As the latest update that raised it described it.
  double known_since_s = 0.0;  ///< Mission time of the first update that raised it.
  std::uint64_t known_since_revision = 0;
  /// Mission time of the first update that no longer raised it; nothing while it stands.
  std::optional<double> withdrawn_s;
};

/// Follows the alerts (origins with SuspectedOrigin::alert) through one robot's updates, which are in time order. Two
/// alerts of different updates are the same when their segments overlap; the alert is then known since the earlier
/// update. An alert that no origin of a later update overlaps is withdrawn. Sorted by the start of the segment.
std::vector<Alert> follow_alerts(std::span<const Suspicion> updates);

}  // namespace tutti::consistency
