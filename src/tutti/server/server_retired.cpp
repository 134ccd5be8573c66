// SPDX-License-Identifier: BSD-3-Clause
// Which submaps a MapServer sets aside.
#include <set>
#include <vector>

#include "tutti/server/known_ground.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {

void MapServer::retire(const MapEstimate& map, const MapJob& job) {
  if (job.map.known_ground.visits == 0) return;
  std::set<SubmapId> open;
  for (const auto& [id, submap] : state_.submaps)
    for (const SubmapPair& pair : state_.answered.open(id)) open.insert({pair.first, pair.second});
  const auto is_held = [&](SubmapId id) {
    return job.held != nullptr && job.held->contains({id.chain, job.submaps.at(id)->keyframes.front().index});
  };
  const auto is_verified = [&](SubmapId id) { return !open.contains(id) && !is_held(id); };
  const std::set<SubmapPair> accepted = accepted_pairs(map, job.verdicts);
  const std::vector<SubmapId> chosen =
      known_submaps(map, job.submaps, accepted, state_.retired, job.map.known_ground, is_verified);
  if (chosen.empty()) return;
  for (const SubmapId& id : chosen) {
    state_.retired.insert(id);
    state_.payload_sizes.erase(id);
    state_.places.erase(id);
    candidates_.remove(id);
  }
  for (const SubmapPair& pair : superfluous(state_.verdicts, accepted, state_.submaps, state_.retired, chosen)) {
    if (state_.decisions.contains(pair)) continue;
    const auto verdict = state_.verdicts.find(pair);
    if (verdict->second.verifier != state_.verifier) --former_pairs_;
    state_.verdicts.erase(verdict);
    new_retired_.dropped.push_back(pair);
  }
  note_news();  // the map was made with what is dropped
  new_retired_.submaps.insert(new_retired_.submaps.end(), chosen.begin(), chosen.end());
}

}  // namespace tutti::server
