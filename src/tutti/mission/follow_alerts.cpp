// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/follow_alerts.hpp"

#include <algorithm>

namespace tutti::mission {
namespace {

bool overlap(const consistency::SuspectedOrigin& a, const consistency::SuspectedOrigin& b) {
  return a.from <= b.until && b.from <= a.until;
}

}  // namespace

std::vector<AlertRecord> follow_alerts(std::span<const UpdateRecord> updates) {
  std::vector<AlertRecord> known;
  for (const UpdateRecord& update : updates) {
    std::vector<AlertRecord> now;
    for (const consistency::SuspectedOrigin& origin : update.origins) {
      if (!origin.alert) continue;
      AlertRecord alert{.origin = origin, .known_since_s = update.time_s, .known_since_revision = update.revision};
      for (const AlertRecord& earlier : known)
        if (overlap(earlier.origin, origin) && earlier.known_since_s < alert.known_since_s) {
          alert.known_since_s = earlier.known_since_s;
          alert.known_since_revision = earlier.known_since_revision;
        }
      now.push_back(alert);
    }
    const std::size_t standing = now.size();
    for (AlertRecord& earlier : known) {
      if (std::any_of(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(standing),
                      [&](const AlertRecord& alert) { return overlap(alert.origin, earlier.origin); }))
        continue;
      if (!earlier.withdrawn_s) earlier.withdrawn_s = update.time_s;
      now.push_back(earlier);
    }
    known = std::move(now);
  }
  std::stable_sort(known.begin(), known.end(),
                   [](const AlertRecord& a, const AlertRecord& b) { return a.origin.from < b.origin.from; });
  return known;
}

}  // namespace tutti::mission
