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

/// As plan_verification() of every pair of the newest submap, without looking up in each of them what all share: in a
/// large fleet these are hundreds of millions.
void MapServer::plan_verifications(SubmapId id) {
  const auto own = state_.submaps.find(id);
  const PayloadSize own_size = size_of(id);
  const bool any_answered = state_.answered.has_any(id);  // verdicts may have come before it
  std::vector<SubmapId> open;
  auto sized = state_.payload_sizes.begin();
  for (auto other = state_.submaps.begin(); other != state_.submaps.end(); ++other) {
    const SubmapPair pair = ordered(id, other->first);
    if (other == own || candidates_.excludes(pair)) continue;
    ++work_.pairs_looked_at;
    while (sized != state_.payload_sizes.end() && sized->first < other->first) ++sized;
    const bool has_size = sized != state_.payload_sizes.end() && sized->first == other->first;
    const PayloadSize other_size = has_size ? sized->second : PayloadSize();
    if (any_answered && is_answered(pair)) continue;
    const bool is_first = pair.first == id;
    const auto &first = is_first ? *own : *other, &second = is_first ? *other : *own;
    if (!finder_->can_compare(is_first ? own_size : other_size, is_first ? other_size : own_size) ||
        !finder_->is_candidate(*first.second, *second.second))
      continue;
    jobs_.push_back({pair, first.second, second.second});
    open.push_back(other->first);
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
