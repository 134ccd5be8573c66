// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/kept_decision.hpp"

namespace tutti::server {
namespace {

bool has_keyframe(const Submap& submap, const KeyframeId& keyframe) {
  return submap.keyframes.front().index <= keyframe.index && keyframe.index <= submap.keyframes.back().index;
}

}  // namespace

bool has_closures(const VerdictSet& verdicts, const SubmapPair& pair) {
  const auto verdict = verdicts.find(pair);
  return verdict != verdicts.end() && !verdict->second.closures.empty();
}

Result<std::optional<ClosureDecision>> kept_decision(const SubmapPair& pair, const ClosureDecision& given,
                                                     const SubmapSet& submaps, const VerdictSet& verdicts,
                                                     const DecisionSet& decisions) {
  ClosureDecision decision = with_sessions(given, pair);
  const std::string& where = decision.closure;
  if (!(pair.first < pair.second))
    return fail(ErrorCode::invalid, "{}: submaps {} and {}, expected the first to be the smaller", where,
                to_string(pair.first), to_string(pair.second));
  for (const SubmapId& id : {pair.first, pair.second})
    if (!submaps.contains(id)) return fail(ErrorCode::invalid, "{}: submap {} is not in the map", where, to_string(id));
  const auto known = decisions.find(pair);
  if (known != decisions.end() && !holds_over(decision, known->second)) return std::optional<ClosureDecision>();
  if (decision.wish == Wish::accept && !has_closures(verdicts, pair) && decision.by_hand.empty())
    return fail(ErrorCode::invalid, "{}: no closure was found there that could be accepted", where);
  for (const LoopClosure& closure : decision.by_hand)
    if (!has_keyframe(*submaps.at(pair.first), closure.from) || !has_keyframe(*submaps.at(pair.second), closure.to))
      return fail(ErrorCode::invalid, "{}: its closure is between keyframes {} and {}, which these do not have", where,
                  closure.from.index, closure.to.index);
  return std::optional(std::move(decision));
}

}  // namespace tutti::server
