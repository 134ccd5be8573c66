// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/known_ground.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/refuted_closures.hpp"

namespace tutti::server {
namespace {

SubmapId neighbour(SubmapId id, int by) { return {id.chain, id.index + static_cast<std::uint32_t>(by)}; }

/// Where the map has the keyframes of a submap; nothing when it lacks one.
std::optional<std::vector<Eigen::Vector3d>> positions_of(const Submap& submap, const MapEstimate& map) {
  std::vector<Eigen::Vector3d> out;
  for (const Keyframe& keyframe : submap.keyframes) {
    const MapNode* const node = find_node(map, {submap.id.chain, keyframe.index});
    if (node == nullptr) return std::nullopt;
    out.push_back(node->T_world_body.translation);
  }
  return out;
}

/// Its robot has begun another session, so nothing follows any more.
bool has_ended(const ChainId& chain, const SubmapSet& submaps) {
  const auto after = submaps.upper_bound({chain, std::numeric_limits<std::uint32_t>::max()});
  return after != submaps.end() && after->first.chain.robot == chain.robot;
}

using Partners = std::map<SubmapId, std::vector<SubmapId>>;

Partners partners_of(const std::set<SubmapPair>& accepted) {
  Partners out;
  for (const auto& [first, second] : accepted) {
    out[first].push_back(second);
    out[second].push_back(first);
  }
  return out;
}

/// Chooses what is retired. Each submap is looked at once, in the order in which they ended.
class Choice {
 public:
  Choice(const MapEstimate& map, const SubmapSet& submaps, const std::set<SubmapPair>& accepted,
         const std::set<SubmapId>& retired, const KnownGroundConfig& config,
         const std::function<bool(SubmapId)>& is_verified)
      : map_(map),
        submaps_(submaps),
        before_(retired),
        config_(config),
        is_verified_(is_verified),
        partners_(partners_of(accepted)) {}

  std::vector<SubmapId> of_all() {
    std::vector<SubmapId> in_order, out;
    for (const auto& [id, submap] : submaps_)
      if (!before_.contains(id)) in_order.push_back(id);
    std::ranges::sort(in_order, {}, [&](const SubmapId& id) { return end_of(id); });
    for (const SubmapId& id : in_order) {
      const SubmapId previous = neighbour(id, -1), next = neighbour(id, 1);
      const bool begins = id.index == 0 || !submaps_.contains(previous);
      const bool ends = !submaps_.contains(next);
      if ((ends && !has_ended(id.chain, submaps_)) || !is_known(id)) continue;
      if (!(ends || is_known(next)) || !(begins || is_known(previous))) continue;
      chosen_.insert(id);
      out.push_back(id);
    }
    return out;
  }

 private:
  [[nodiscard]] std::pair<Timestamp, SubmapId> end_of(SubmapId id) const {
    return {submaps_.at(id)->keyframes.back().stamp, id};
  }

  /// Its ground is known, whether it is retired or not.
  bool is_known(SubmapId id) {
    if (before_.contains(id)) return true;
    const auto [found, is_new] = known_.try_emplace(id, false);
    if (is_new) found->second = is_verified_(id) && is_shown_by_others(id);
    return found->second;
  }

  /// The partner stays in the map for certain: it ended before, and whoever is still to end after it is not waited for.
  [[nodiscard]] bool counts(SubmapId partner, SubmapId id) const {
    const bool is_adjacent =
        partner.chain == id.chain && partner.index + 1 >= id.index && partner.index <= id.index + 1;
    return !is_adjacent && !before_.contains(partner) && !chosen_.contains(partner) && submaps_.contains(partner) &&
           (has_ended(partner.chain, submaps_) || submaps_.contains(neighbour(partner, 1))) &&
           end_of(partner) < end_of(id);
  }

  using Positions = std::optional<std::vector<Eigen::Vector3d>>;
  /// A submap is asked for as often as it has closures.
  const Positions& positions(SubmapId id) {
    const auto [found, is_new] = positions_.try_emplace(id);
    if (is_new) found->second = positions_of(*submaps_.at(id), map_);
    return found->second;
  }

  bool is_shown_by_others(SubmapId id) {
    const auto partners = partners_.find(id);
    if (partners == partners_.end()) return false;
    const Positions& own = positions(id);
    if (!own) return false;
    std::vector<int> visits(own->size(), 0);
    for (const SubmapId& partner : partners->second) {
      if (!counts(partner, id)) continue;
      const Positions& others = positions(partner);
      if (!others) continue;
      for (std::size_t k = 0; k < own->size(); ++k)
        visits[k] += std::ranges::any_of(
            *others, [&](const Eigen::Vector3d& p) { return (p - (*own)[k]).norm() <= config_.reach_m; });
    }
    return std::ranges::all_of(visits, [&](int n) { return n >= config_.visits; });
  }

  const MapEstimate& map_;
  const SubmapSet& submaps_;
  const std::set<SubmapId>& before_;
  const KnownGroundConfig& config_;
  const std::function<bool(SubmapId)>& is_verified_;
  Partners partners_;
  std::map<SubmapId, Positions> positions_;
  std::map<SubmapId, bool> known_;
  std::set<SubmapId> chosen_;
};

}  // namespace

std::set<SubmapPair> accepted_pairs(const MapEstimate& map, const VerdictSet& verdicts) {
  const auto ends = [](const LoopClosure& closure) { return std::pair(closure.from, closure.to); };
  const auto is_accepted = [&](const LoopClosure& closure) {
    const auto found = std::ranges::equal_range(map.closures, ends(closure), {},
                                                [&](const JudgedClosure& judged) { return ends(judged.closure); });
    return std::ranges::any_of(found, &JudgedClosure::accepted);
  };
  std::set<SubmapPair> out;
  for (const auto& [pair, verdict] : verdicts)
    if (std::ranges::any_of(verdict.closures, is_accepted)) out.insert(out.end(), pair);
  return out;
}

std::vector<SubmapId> known_submaps(const MapEstimate& map, const SubmapSet& submaps,
                                    const std::set<SubmapPair>& accepted, const std::set<SubmapId>& retired,
                                    const KnownGroundConfig& config, const std::function<bool(SubmapId)>& is_verified) {
  if (config.visits == 0 || !map.converged) return {};
  return Choice(map, submaps, accepted, retired, config, is_verified).of_all();
}

std::set<SubmapId> hidden_of(const SubmapSet& submaps, const std::set<SubmapId>& retired) {
  std::set<SubmapId> out;
  std::optional<ChainId> chain;
  std::vector<SubmapId> first;  // what the chain begins with is retired
  bool begins = false;
  for (const auto& [id, submap] : submaps) {
    if (id.chain != chain) {
      chain = id.chain;
      begins = true;
      first.clear();
    }
    const bool is_retired = retired.contains(id);
    if (begins && !is_retired)  // it stays, and hangs on these
      for (std::size_t k = first.size() > kAnchors ? first.size() - kAnchors : 0; k < first.size(); ++k)
        out.erase(first[k]);
    begins = begins && is_retired;
    if (!is_retired || !has_ended(id.chain, submaps)) continue;
    out.insert(out.end(), id);
    if (begins) first.push_back(id);
  }
  return out;
}

std::set<SubmapPair> superfluous(const VerdictSet& verdicts, const std::set<SubmapPair>& accepted,
                                 const SubmapSet& submaps, const std::set<SubmapId>& retired,
                                 std::span<const SubmapId> chosen) {
  const std::set<SubmapId> hidden = hidden_of(submaps, retired), fresh(chosen.begin(), chosen.end());
  std::set<SubmapPair> out;
  std::map<SubmapId, std::vector<std::pair<std::uint64_t, SubmapPair>>> ties;  // with their place in line
  for (const auto& [pair, verdict] : verdicts) {
    const bool is_first = retired.contains(pair.first), is_second = retired.contains(pair.second);
    if (!is_first && !is_second) continue;
    const SubmapId id = is_first ? pair.first : pair.second;
    if ((is_first && is_second) || hidden.contains(id) || (fresh.contains(id) && !accepted.contains(pair)))
      out.insert(pair);
    else
      ties[id].emplace_back(
          mixed(packed(pair.first.chain, pair.first.index) + mixed(packed(pair.second.chain, pair.second.index))),
          pair);
  }
  for (auto& [id, in_line] : ties) {
    std::ranges::sort(in_line);
    for (std::size_t k = kTies; k < in_line.size(); ++k) out.insert(in_line[k].second);
  }
  return out;
}

namespace {

/// One step of odometry over submaps that follow each other.
std::shared_ptr<const Submap> one_step(const std::vector<std::shared_ptr<const Submap>>& run) {
  Submap out{.id = run.front()->id, .keyframes = {run.front()->keyframes.front(), run.back()->keyframes.back()}};
  RelativePose step{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  for (const auto& submap : run)
    for (const RelativePose& next : submap->odometry)
      step = {step.T_a_b * next.T_a_b,
              compound_covariance(next.T_a_b, step.covariance, bounded_covariance(next.covariance))};
  out.odometry = {step};
  return std::make_shared<const Submap>(std::move(out));
}

bool follows(const Submap& submap, const Submap& previous) {
  return submap.id.chain == previous.id.chain && submap.keyframes.front() == previous.keyframes.back();
}

}  // namespace

SubmapSet without_hidden(const SubmapSet& submaps, const std::set<SubmapId>& hidden) {
  SubmapSet out;
  std::vector<std::shared_ptr<const Submap>> run;  // what is hidden since the last submap of `out`, without a gap
  for (const auto& [id, submap] : submaps) {
    if (hidden.contains(id)) {
      const bool goes_on =
          run.empty() ? !out.empty() && follows(*submap, *out.rbegin()->second) : follows(*submap, *run.back());
      if (!goes_on) run.clear();
      if (goes_on) run.push_back(submap);
      continue;
    }
    if (!run.empty() && follows(*submap, *run.back())) out.emplace_hint(out.end(), run.front()->id, one_step(run));
    run.clear();
    out.emplace_hint(out.end(), id, submap);
  }
  return out;
}

MapEstimate estimate_known_map(const SubmapSet& submaps, const std::set<SubmapId>& retired, const VerdictSet& verdicts,
                               const MapConfig& config, const DecisionSet& decisions) {
  if (retired.empty()) return estimate_map_with_fixes(submaps, verdicts, config, decisions);
  const std::set<SubmapId> hidden = hidden_of(submaps, retired);
  VerdictSet shown;
  for (const auto& entry : verdicts) {
    const auto& [first, second] = entry.first;
    const bool is_hidden = hidden.contains(first) || hidden.contains(second);
    if (!is_hidden && !(retired.contains(first) && retired.contains(second))) shown.insert(shown.end(), entry);
  }
  return estimate_map_with_fixes(without_hidden(submaps, hidden), shown, config, decisions);
}

}  // namespace tutti::server
