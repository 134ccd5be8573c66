// SPDX-License-Identifier: BSD-3-Clause
// Which pairs a MapServer has verified, by the appearance of their places.
#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {

namespace {

/// Calls take(submap) of those that are wanted and that the verifier would compare with this one, in the order of
/// their ids. It looks up only once what all pairs share: in a large fleet these are hundreds of millions.
template <class IsWanted, class Take>
void for_each_comparable(const MapServerState& state, const ClosureVerifier& verifier, SubmapId id,
                         const IsWanted& is_wanted, const Take& take) {
  const auto own = state.submaps.find(id);
  auto sized = state.payload_sizes.find(id);
  const PayloadSize own_size = sized == state.payload_sizes.end() ? PayloadSize() : sized->second;
  sized = state.payload_sizes.begin();
  for (auto other = state.submaps.begin(); other != state.submaps.end(); ++other) {
    if (other == own || !is_wanted(other->first)) continue;
    while (sized != state.payload_sizes.end() && sized->first < other->first) ++sized;
    const bool has_size = sized != state.payload_sizes.end() && sized->first == other->first;
    const PayloadSize other_size = has_size ? sized->second : PayloadSize();
    const bool is_first = id < other->first;
    const auto &first = is_first ? *own : *other, &second = is_first ? *other : *own;
    if (verifier.can_compare(is_first ? own_size : other_size, is_first ? other_size : own_size) &&
        verifier.is_candidate(*first.second, *second.second))
      take(*other);
  }
}

}  // namespace

void MapServer::compare_place(SubmapId id) {
  Place& place = state_.places.at(id);
  std::vector<SubmapId> others;
  std::vector<std::string_view> appearances;
  for_each_comparable(
      state_, *verifier_, id, [&](SubmapId other) { return candidates_.has(other) && !state_.retired.contains(other); },
      [&](const auto& other) {
        others.push_back(other.first);
        appearances.push_back(state_.places.at(other.first).looks);
      });
  std::vector<Alike> alike;
  for (const auto& [other, value, sensor] : verifier_->likeness(place.looks, appearances)) {
    TUTTI_CHECK(other < others.size() && sensor < ClosureVerifier::kMostSensors, "place {} of {} compared by sensor {}",
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
  const bool is_retired = state_.retired.contains(pair.first) || state_.retired.contains(pair.second);
  if (!is_retired && !is_answered(pair) && is_asked(pair))
    return jobs_.push_back({pair, state_.submaps.at(pair.first), state_.submaps.at(pair.second)});
  state_.answered.insert(pair);  // what an earlier verifier has found there stays
}

void MapServer::plan_open_verifications() {
  for (const auto& [id, submap] : state_.submaps)
    for (const SubmapPair& pair : state_.answered.open(id)) plan_verification(pair);
  std::ranges::sort(jobs_, {}, &VerificationJob::pair);
}

/// As plan_verification() of every pair of the newest submap.
void MapServer::plan_verifications(SubmapId id) {
  const bool any_answered = state_.answered.has_any(id);  // verdicts may have come before it
  const std::shared_ptr<const Submap>& own = state_.submaps.at(id);
  const auto is_open = [&](SubmapId other) {
    const SubmapPair pair = ordered(id, other);
    if (state_.retired.contains(other) || candidates_.excludes(pair)) return false;
    ++work_.pairs_looked_at;
    return !any_answered || !is_answered(pair);
  };
  std::vector<SubmapId> open;
  for_each_comparable(state_, *verifier_, id, is_open, [&](const auto& other) {
    const bool is_first = id < other.first;
    jobs_.push_back({ordered(id, other.first), is_first ? own : other.second, is_first ? other.second : own});
    open.push_back(other.first);
  });
  state_.answered.insert_all_but(id, open);
}

void MapServer::restore_candidates() {
  if (config_.candidates_per_submap == 0) return state_.places.clear();
  std::erase_if(state_.places, [&](const auto& entry) {
    const bool is_read = verifier_->can_rank(entry.second.looks);
    if (!is_read)
      new_places_.push_back(entry.first);  // who reads the map's file is not to believe its candidates either
    return !is_read || !state_.submaps.contains(entry.first);
  });
  candidates_ = CandidatePairs(static_cast<std::size_t>(config_.candidates_per_submap), state_.places);
  for (const auto& [id, place] : state_.places)
    if (!place.is_ranked) compare_place(id);
  std::vector<SubmapId> unknown;
  for (const auto& [id, submap] : state_.submaps)
    if (!candidates_.has(id) && !state_.retired.contains(id)) unknown.push_back(id);
  auto all = candidates_.all();
  for (auto& [id, open] : all) {
    open.insert(open.end(), unknown.begin(), unknown.end());
    state_.answered.insert_all_but(id, open);
  }
}

}  // namespace tutti::server
