// SPDX-License-Identifier: BSD-3-Clause
// Which pairs a MapServer has verified, by what the places of submaps look like.
#include <algorithm>
#include <string_view>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {

void MapServer::compare_place(SubmapId id) {
  Place& place = state_.places.at(id);
  std::vector<SubmapId> others;
  std::vector<std::string_view> looks;
  for (const auto& [other, known] : state_.places)
    if (candidates_.has(other) && is_asked(ordered(id, other))) {
      others.push_back(other);
      looks.push_back(known.looks);
    }
  std::vector<Alike> alike;
  for (const auto& [other, value, sensor] : finder_->likeness(place.looks, looks)) {
    TUTTI_CHECK(other < others.size() && sensor < ClosureFinder::kMostSensors, "place {} of {} compared by sensor {}",
                other, others.size(), sensor);
    alike.push_back({others[other], value, sensor});
  }
  work_.places_compared += alike.size();
  place.candidates = candidates_.add(id, alike);
  place.is_ranked = true;
  new_places_.push_back(id);
}

void MapServer::plan_verification(const SubmapPair& pair) {
  ++work_.pairs_looked_at;
  if (!is_answered(pair) && is_asked(pair))
    return jobs_.push_back({pair, state_.submaps.at(pair.first), state_.submaps.at(pair.second)});
  state_.answered.insert(pair);  // what an earlier finder has found there stays
}

void MapServer::plan_open_verifications() {
  for (const auto& [id, submap] : state_.submaps)
    for (const SubmapPair& pair : state_.answered.open(id)) plan_verification(pair);
  std::ranges::sort(jobs_, {}, &VerificationJob::pair);
}

void MapServer::plan_verifications(SubmapId id) {
  std::vector<SubmapId> open;
  for (const auto& [other, there] : state_.submaps) {
    if (other == id || candidates_.excludes(ordered(id, other))) continue;
    plan_verification(ordered(id, other));
    open.push_back(other);
  }
  state_.answered.insert_all_but(id, open);
}

void MapServer::restore_candidates() {
  if (config_.candidates_per_submap == 0) return state_.places.clear();
  std::erase_if(state_.places, [&](const auto& entry) {
    const bool is_read = finder_->can_rank(entry.second.looks);
    if (!is_read)
      new_places_.push_back(entry.first);  // who reads the map's file is not to believe its candidates either
    return !is_read || !state_.submaps.contains(entry.first);
  });
  candidates_ = CandidatePairs(static_cast<std::size_t>(config_.candidates_per_submap), state_.places);
  for (const auto& [id, place] : state_.places)
    if (!place.is_ranked) compare_place(id);
  std::vector<SubmapId> unknown;
  for (const auto& [id, submap] : state_.submaps)
    if (!candidates_.has(id)) unknown.push_back(id);
  auto all = candidates_.all();
  for (auto& [id, open] : all) {
    open.insert(open.end(), unknown.begin(), unknown.end());
    state_.answered.insert_all_but(id, open);
  }
}

}  // namespace tutti::server
