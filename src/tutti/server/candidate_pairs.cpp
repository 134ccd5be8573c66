// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/candidate_pairs.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace tutti::server {
namespace {

constexpr std::size_t kCutFrom = 4;  // times as many as stay

/// In an order without ties, so that it does not matter who came first.
bool is_more_alike(const Alike& a, const Alike& b) {
  return std::tuple(-a.likeness, a.submap) < std::tuple(-b.likeness, b.submap);
}

}  // namespace

bool CandidatePairs::comes_first(const Ranked& a, const Ranked& b) {
  return a.turn != b.turn ? a.turn < b.turn : is_more_alike(a.alike, b.alike);
}

CandidatePairs::List& CandidatePairs::by_sensor(std::vector<List>& lists, std::uint32_t sensor) {
  if (lists.size() <= sensor) lists.resize(sensor + std::size_t{1});
  return lists[sensor];
}

/// A submap that was dropped before needs no place here: whatever is less similar and the same robot's comes after it.
/// Those of this robot that are less similar are one turn later now, and stay in their order; so do all others.
void CandidatePairs::insert(SubmapId of, const Alike& other) {
  List& list = by_sensor(most_alike_[of], other.sensor);
  const RobotId robot = other.submap.chain.robot;
  Ranked added{other};
  for (const Ranked& known : list) {
    if (known.alike == other) return;
    if (known.alike.submap.chain.robot == robot && is_more_alike(known.alike, other)) ++added.turn;
  }
  if (list.size() >= most_ && (list.empty() || !comes_first(added, list.back()))) return;
  List stay, later{added};
  stay.reserve(list.size());
  for (Ranked& known : list) {
    const bool is_later = known.alike.submap.chain.robot == robot && known.turn >= added.turn;
    if (is_later) ++known.turn;
    (is_later ? later : stay).push_back(known);
  }
  list.resize(list.size() + 1);
  std::ranges::merge(stay, later, list.begin(), comes_first);
  if (list.size() > most_) list.pop_back();
}

std::vector<Alike> CandidatePairs::add(SubmapId id, const std::vector<Alike>& others) {
  most_alike_.try_emplace(id);
  for (const Alike& other : others) {
    insert(id, other);
    insert(other.submap, {id, other.likeness, other.sensor});
  }
  std::vector<Alike> candidates;
  for (const Alike& other : others)
    if (!excludes(ordered(id, other.submap))) candidates.push_back(other);
  std::ranges::stable_sort(candidates, {}, &Alike::submap);
  return candidates;
}

/// Those of the same robot that are less similar are one turn earlier now; all others stay in their order.
void CandidatePairs::remove(SubmapId id) {
  most_alike_.erase(id);
  for (auto& [other, lists] : most_alike_)
    for (List& list : lists) {
      const auto found = std::ranges::find(list, id, [](const Ranked& ranked) { return ranked.alike.submap; });
      if (found == list.end()) continue;
      const std::size_t turn = found->turn;
      list.erase(found);
      for (Ranked& ranked : list)
        if (ranked.alike.submap.chain.robot == id.chain.robot && ranked.turn > turn) --ranked.turn;
      std::ranges::sort(list, comes_first);
    }
}

CandidatePairs::CandidatePairs(std::size_t most, const PlaceSet& places) : most_(most) {
  most_alike_.reserve(places.size());
  for (const auto& [id, place] : places)
    if (place.is_ranked) most_alike_.try_emplace(id);
  for (const auto& [id, place] : places) {
    if (!place.is_ranked) continue;
    std::vector<List>& own = most_alike_.at(id);
    for (const Alike& other : place.candidates) {
      const auto others = most_alike_.find(other.submap);
      if (others == most_alike_.end()) continue;
      append(by_sensor(own, other.sensor), other);
      append(by_sensor(others->second, other.sensor), {id, other.likeness, other.sensor});
    }
  }
  for (auto& [id, lists] : most_alike_)
    for (List& list : lists) {
      cut(list);
      list.shrink_to_fit();
    }
}

/// A submap was a candidate of many that later ones displaced: it is cut whenever it has several times as many as stay.
void CandidatePairs::append(List& list, const Alike& other) const {
  if (list.size() >= kCutFrom * most_) cut(list);
  list.push_back({other});
}

void CandidatePairs::cut(List& list) const {
  const auto by_robot = [](const Ranked& a, const Ranked& b) {
    const RobotId of_a = a.alike.submap.chain.robot, of_b = b.alike.submap.chain.robot;
    return of_a != of_b ? of_a < of_b : is_more_alike(a.alike, b.alike);
  };
  std::ranges::sort(list, by_robot);
  const auto twice = std::ranges::unique(list, {}, &Ranked::alike);  // of two that were compared again
  list.erase(twice.begin(), twice.end());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const bool is_first = i == 0 || list[i].alike.submap.chain.robot != list[i - 1].alike.submap.chain.robot;
    list[i].turn = is_first ? 0 : list[i - 1].turn + 1;
  }
  const std::size_t kept = std::min(list.size(), most_);
  std::ranges::partial_sort(list, list.begin() + static_cast<std::ptrdiff_t>(kept), comes_first);
  list.resize(kept);
}

bool CandidatePairs::prefers(SubmapId of, SubmapId other) const {
  return std::ranges::any_of(most_alike_.at(of), [&](const List& list) {
    return std::ranges::any_of(list, [&](const Ranked& ranked) { return ranked.alike.submap == other; });
  });
}

bool CandidatePairs::excludes(const SubmapPair& pair) const {
  return has(pair.first) && has(pair.second) && !prefers(pair.first, pair.second) && !prefers(pair.second, pair.first);
}

std::map<SubmapId, std::vector<SubmapId>> CandidatePairs::all() const {
  std::map<SubmapId, std::vector<SubmapId>> out;
  for (const auto& [id, lists] : most_alike_) {
    std::vector<SubmapId>& own = out[id];
    for (const List& list : lists)
      for (const Ranked& other : list) {
        own.push_back(other.alike.submap);
        out[other.alike.submap].push_back(id);
      }
  }
  return out;
}

CandidatePairs restored(const PlaceSet& places, std::size_t most) {
  const bool is_whole = std::ranges::all_of(places, [](const auto& entry) { return entry.second.is_ranked; });
  return most > 0 && is_whole ? CandidatePairs(most, places) : CandidatePairs();
}

VerdictSet of_candidates(const VerdictSet& verdicts, const CandidatePairs& candidates, const DecisionSet& decisions) {
  VerdictSet out;
  for (const auto& [pair, verdict] : verdicts)
    if (decisions.contains(pair) || !candidates.excludes(pair)) out.emplace_hint(out.end(), pair, verdict);
  return out;
}

}  // namespace tutti::server
