// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/closures.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::mapfile {
namespace {

using Ends = std::pair<KeyframeId, KeyframeId>;

std::optional<ClosureFit::Misfit> misfit_of(const server::MapEstimate& map, const LoopClosure& closure) {
  const MapNode *from = find_node(map, closure.from), *to = find_node(map, closure.to);
  if (from == nullptr || to == nullptr || from->component != to->component) return std::nullopt;
  const Vector6d error = local(closure.measurement.T_a_b, from->T_world_body.inverse() * to->T_world_body);
  const Matrix6d covariance = invertible_covariance(bounded_covariance(closure.measurement.covariance));
  return ClosureFit::Misfit{error.head<3>().norm(), error.tail<3>().norm(), squared_distance(error, covariance)};
}

std::string reason_of(const ClosureInfo& info) {
  if (info.decision && info.decision->wish != Wish::withdraw && info.state != ClosureState::candidate)
    return fmt::format("{}ed by {}", to_string(info.decision->wish),
                       info.decision->by.empty() ? "an operator" : info.decision->by);
  if (info.state == ClosureState::candidate) return "not judged";
  if (info.state == ClosureState::accepted) return {};
  return info.closures.front().reason;
}

}  // namespace

const char* to_string(ClosureState state) {
  return state == ClosureState::accepted ? "accepted" : state == ClosureState::rejected ? "rejected" : "candidate";
}

std::vector<ClosureInfo> closures(const Content& content, const server::MapEstimate& map) {
  const server::ClosureNames names = content.closure_names();
  std::map<SubmapPair, ClosureInfo> infos;
  for (const auto& [pair, decision] : content.decisions) infos[pair].decision = decision;
  for (const auto& [pair, verdict] : content.verdicts)
    if (!verdict.closures.empty()) infos[pair].verdict = verdict;
  std::multimap<Ends, const server::JudgedClosure*> judged;
  for (const server::JudgedClosure& one : map.closures) judged.emplace(Ends{one.closure.from, one.closure.to}, &one);
  std::vector<ClosureInfo> out;
  for (auto& [pair, info] : infos) {
    info.pair = pair;
    info.name = names.of(pair);
    std::vector<LoopClosure> all = info.verdict ? info.verdict->closures : std::vector<LoopClosure>{};
    if (info.decision && info.decision->wish == Wish::accept)
      all.insert(all.end(), info.decision->by_hand.begin(), info.decision->by_hand.end());
    for (const LoopClosure& closure : all) {
      ClosureFit& fit = info.closures.emplace_back(ClosureFit{.closure = closure, .misfit = misfit_of(map, closure)});
      const auto [first, last] = judged.equal_range({closure.from, closure.to});
      const auto found = std::find_if(first, last, [&](const auto& entry) {  // neighbours share a keyframe
        return entry.second->closure.measurement.T_a_b == closure.measurement.T_a_b;
      });
      if (found == last) continue;
      fit.state = found->second->accepted ? ClosureState::accepted : ClosureState::rejected;
      fit.reason = judge::reason_of(found->second->objection, found->second->price);
    }
    const auto is = [&](ClosureState state) {
      return std::ranges::any_of(info.closures, [&](const ClosureFit& fit) { return fit.state == state; });
    };
    if (info.closures.empty() && info.decision->wish == Wish::withdraw) continue;
    info.state = is(ClosureState::accepted)                            ? ClosureState::accepted
                 : is(ClosureState::rejected) || info.closures.empty() ? ClosureState::rejected
                                                                       : ClosureState::candidate;
    info.reason = reason_of(info);
    out.push_back(std::move(info));
  }
  return out;
}

}  // namespace tutti::mapfile
