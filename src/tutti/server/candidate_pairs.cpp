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

bool CandidatePairs::comes_first(const Ranked& a, const Ranked& b) {
  return a.turn != b.turn ? a.turn < b.turn : is_more_alike(a.alike, b.alike);
}

/// What was dropped before needs no place here: whatever looks less alike than it and is the same robot's comes after
/// it.
void CandidatePairs::insert(SubmapId of, const Alike& other) {
  std::vector<Ranked>& list = most_alike_[of];
  Ranked added{other};
  for (const Ranked& known : list) {
    if (known.alike == other) return;
    if (known.alike.submap.chain.robot == other.submap.chain.robot && is_more_alike(known.alike, other)) ++added.turn;
  }
  if (list.size() >= most_ && (list.empty() || !comes_first(added, list.back()))) return;
  for (Ranked& known : list)
    if (known.alike.submap.chain.robot == other.submap.chain.robot && known.turn >= added.turn) ++known.turn;
  list.push_back(added);
  std::ranges::sort(list, comes_first);
  if (list.size() > most_) list.pop_back();
}

std::vector<Alike> CandidatePairs::add(SubmapId id, const std::vector<Alike>& others) {
  restore(id, others);
  std::vector<Alike> candidates;
  for (const Alike& other : others)
    if (!excludes(ordered(id, other.submap))) candidates.push_back(other);
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
  return std::ranges::any_of(most_alike_.at(of), [&](const Ranked& ranked) { return ranked.alike.submap == other; });
}

bool CandidatePairs::excludes(const SubmapPair& pair) const {
  return has(pair.first) && has(pair.second) && !prefers(pair.first, pair.second) && !prefers(pair.second, pair.first);
}

std::map<SubmapId, std::vector<SubmapId>> CandidatePairs::all() const {
  std::map<SubmapId, std::vector<SubmapId>> out;
  for (const auto& [id, list] : most_alike_) {
    std::vector<SubmapId>& own = out[id];
    for (const Ranked& other : list) {
      own.push_back(other.alike.submap);
      out[other.alike.submap].push_back(id);
    }
  }
  return out;
}

CandidatePairs of_compared(const PlaceSet& places, std::size_t most) {
  CandidatePairs out(most);
  const auto is_there = [&](SubmapId id) {
    const auto found = places.find(id);
    return found != places.end() && found->second.is_ranked;
  };
  for (const auto& [id, place] : places) {
    if (!place.is_ranked) continue;
    std::vector<Alike> there = place.candidates;
    std::erase_if(there, [&](const Alike& other) { return !is_there(other.submap); });
    out.restore(id, there);
  }
  return out;
}

CandidatePairs restored(const PlaceSet& places, std::size_t most) {
  const bool is_whole = std::ranges::all_of(places, [](const auto& entry) { return entry.second.is_ranked; });
  return most > 0 && is_whole ? of_compared(places, most) : CandidatePairs();
}

VerdictSet of_candidates(const VerdictSet& verdicts, const CandidatePairs& candidates, const WordSet& words) {
  VerdictSet out;
  for (const auto& [pair, verdict] : verdicts)
    if (words.contains(pair) || !candidates.excludes(pair)) out.emplace_hint(out.end(), pair, verdict);
  return out;
}

}  // namespace tutti::server
