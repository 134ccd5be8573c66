// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/candidate_pairs.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace tutti::server {
namespace {

/// In an order without ties, so that it does not matter who came first.
bool is_more_alike(const Alike& a, const Alike& b) {
  return std::tuple(-a.likeness, a.submap) < std::tuple(-b.likeness, b.submap);
}

}  // namespace

bool CandidatePairs::insert(SubmapId of, const Alike& other) {
  std::vector<Alike>& list = most_alike_[of];
  const auto at = std::ranges::lower_bound(list, other, is_more_alike);
  if (at != list.end() && *at == other) return true;
  if (at == list.end() && list.size() >= most_) return false;
  list.insert(at, other);
  if (list.size() > most_) list.pop_back();
  return true;
}

std::vector<Alike> CandidatePairs::add(SubmapId id, const std::vector<Alike>& others) {
  std::vector<Alike>& own = most_alike_[id];
  own = others;
  const auto kept = own.begin() + static_cast<std::ptrdiff_t>(std::min(most_, own.size()));
  std::ranges::partial_sort(own, kept, is_more_alike);
  own.erase(kept, own.end());
  std::vector<Alike> candidates = own;
  for (const Alike& other : others)
    if (insert(other.submap, {id, other.likeness}) && !prefers(id, other.submap)) candidates.push_back(other);
  std::ranges::sort(candidates, {}, &Alike::submap);
  return candidates;
}

void CandidatePairs::restore(SubmapId id, const std::vector<Alike>& candidates) {
  most_alike_.try_emplace(id);
  for (const Alike& other : candidates) {
    insert(id, other);
    insert(other.submap, {id, other.likeness});
  }
}

bool CandidatePairs::prefers(SubmapId of, SubmapId other) const {
  return std::ranges::find(most_alike_.at(of), other, &Alike::submap) != most_alike_.at(of).end();
}

bool CandidatePairs::excludes(const SubmapPair& pair) const {
  return has(pair.first) && has(pair.second) && !prefers(pair.first, pair.second) && !prefers(pair.second, pair.first);
}

std::map<SubmapId, std::vector<SubmapId>> CandidatePairs::all() const {
  std::map<SubmapId, std::vector<SubmapId>> out;
  for (const auto& [id, list] : most_alike_) {
    std::vector<SubmapId>& own = out[id];
    for (const Alike& other : list) {
      own.push_back(other.submap);
      out[other.submap].push_back(id);
    }
  }
  return out;
}

CandidatePairs restored(const PlaceSet& places, std::size_t most) {
  CandidatePairs out(most);
  if (most == 0) return out;
  for (const auto& [id, place] : places)
    if (!place.is_ranked) return CandidatePairs(most);
  for (const auto& [id, place] : places) {
    std::vector<Alike> there = place.candidates;
    std::erase_if(there, [&](const Alike& other) { return !places.contains(other.submap); });
    out.restore(id, there);
  }
  return out;
}

VerdictSet of_candidates(const VerdictSet& verdicts, const CandidatePairs& candidates, const WordSet& words) {
  VerdictSet out;
  for (const auto& [pair, verdict] : verdicts)
    if (words.contains(pair) || !candidates.excludes(pair)) out.emplace_hint(out.end(), pair, verdict);
  return out;
}

}  // namespace tutti::server
