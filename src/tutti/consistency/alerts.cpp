// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/alerts.hpp"

#include <algorithm>

namespace tutti::consistency {
namespace {

bool overlap(const SuspectedOrigin& a, const SuspectedOrigin& b) { return a.from <= b.until && b.from <= a.until; }

}  // namespace

std::vector<Alert> follow_alerts(std::span<const Suspicion> updates) {
  std::vector<Alert> known;
  for (const Suspicion& update : updates) {
    std::vector<Alert> now;
    for (const SuspectedOrigin& origin : update.origins) {
      if (!origin.alert) continue;
      Alert alert{.origin = origin, .known_since_s = update.time_s, .known_since_revision = update.revision};
      for (const Alert& earlier : known)
        if (overlap(earlier.origin, origin) && earlier.known_since_s < alert.known_since_s) {
          alert.known_since_s = earlier.known_since_s;
          alert.known_since_revision = earlier.known_since_revision;
        }
      now.push_back(alert);
    }
    const std::size_t standing = now.size();
    for (Alert& earlier : known) {
      if (std::any_of(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(standing),
                      [&](const Alert& alert) { return overlap(alert.origin, earlier.origin); }))
        continue;
      if (!earlier.withdrawn_s) earlier.withdrawn_s = update.time_s;
      now.push_back(earlier);
    }
    known = std::move(now);
  }
  std::stable_sort(known.begin(), known.end(),
                   [](const Alert& a, const Alert& b) { return a.origin.from < b.origin.from; });
  return known;
}

}  // namespace tutti::consistency
