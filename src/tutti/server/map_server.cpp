// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_server.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/kept_decision.hpp"

namespace tutti::server {
namespace {

/// Between neighbouring keyframes. Odometry that diverged beyond this would leave the joint map without a solution.
constexpr double kLongestStep_m = 1e4;
/// By which odometry may differ from the poses it made: what rounding leaves, however far away they are.
constexpr double kRounding_m = 0.01;
constexpr double kRounding_rad = 1e-3;

/// Odometry is what leads from one keyframe's pose to the next.
Status check_step(const Keyframe& from, const Keyframe& to, const RelativePose& step) {
  if (!is_valid(step.T_a_b) || step.T_a_b.translation.norm() > kLongestStep_m)
    return fail(ErrorCode::invalid, "odometry of {} m to keyframe {}, expected at most {} m",
                step.T_a_b.translation.norm(), to.index, kLongestStep_m);
  const Vector6d apart = local(from.T_odom_body.inverse() * to.T_odom_body, step.T_a_b);
  const double apart_m = apart.head<3>().norm(), apart_rad = apart.tail<3>().norm();
  if (apart_m > kRounding_m || apart_rad > kRounding_rad)
    return fail(ErrorCode::invalid, "odometry to keyframe {} is {:.3f} m and {:.3f} rad from its poses, expected 0",
                to.index, apart_m, apart_rad);
  if (auto ok = check_covariance(step.covariance); !ok)
    return in_context(fmt::format("odometry to keyframe {}", to.index), ok.error());
  return {};
}

/// Checks what the map relies on, also for callers who do not come by wire.
Status check_submap(const Submap& submap) {
  const std::string where = "submap " + to_string(submap.id);
  if (submap.keyframes.empty() || submap.odometry.size() + 1 != submap.keyframes.size())
    return fail(ErrorCode::invalid, "{}: {} keyframes and {} odometry factors, expected n and n - 1, n >= 1", where,
                submap.keyframes.size(), submap.odometry.size());
  for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
    const Keyframe& keyframe = submap.keyframes[k];
    if (!is_valid(keyframe.T_odom_body))
      return fail(ErrorCode::invalid, "{}: keyframe {} has no valid pose", where, keyframe.index);
    if (k == 0) continue;
    const Keyframe& previous = submap.keyframes[k - 1];
    if (keyframe.index != previous.index + 1 || keyframe.stamp <= previous.stamp)
      return fail(ErrorCode::invalid, "{}: keyframe {} at {} ns does not follow keyframe {} at {} ns", where,
                  keyframe.index, keyframe.stamp.ns, previous.index, previous.stamp.ns);
    if (auto ok = check_step(previous, keyframe, submap.odometry[k - 1]); !ok) return in_context(where, ok.error());
  }
  return {};
}

std::string name_of(const ClosureVerdict& verdict) {
  const auto& [first, second] = verdict.pair;
  return fmt::format("verdict on submaps {} and {}", to_string(first), to_string(second));
}

/// Checks a verdict as far as it can be without its submaps.
Status check_alone(const ClosureVerdict& verdict, const std::set<RobotId>& robots) {
  const auto& [first, second] = verdict.pair;
  const std::string where = name_of(verdict);
  if (!(first < second)) return fail(ErrorCode::invalid, "{}: expected the first to be the smaller", where);
  for (const SubmapId id : {first, second})
    if (!robots.contains(id.chain.robot))
      return fail(ErrorCode::unknown_robot, "{}: robot {} is none of the mission's {}", where, id.chain.robot.value,
                  robots.size());
  if (verdict.closures.empty() != verdict.refusal.has_value())
    return fail(ErrorCode::invalid, "{}: {} closures {} a refusal, expected one of the two", where,
                verdict.closures.size(), verdict.refusal ? "and" : "without");
  for (const LoopClosure& closure : verdict.closures) {
    if (closure.from.chain != first.chain || closure.to.chain != second.chain)
      return fail(ErrorCode::invalid, "{}: its closure is from robot {} to robot {}", where,
                  to_string(closure.from.chain), to_string(closure.to.chain));
    if (!is_valid(closure.measurement.T_a_b)) return fail(ErrorCode::invalid, "{}: its closure is no pose", where);
    if (auto ok = check_covariance(closure.measurement.covariance); !ok) return in_context(where, ok.error());
  }
  return {};
}

/// Does `a` hold rather than `b`, both by one verifier on one pair, whichever came first? In doubt there is no closure.
/// More closures are those of a verifier that knows them one after the other.
bool holds_over(const ClosureVerdict& a, const ClosureVerdict& b) {
  if (a.closures.empty() || b.closures.empty()) return a.closures.empty() && !b.closures.empty();
  if (a.closures.size() != b.closures.size()) return a.closures.size() > b.closures.size();
  const auto numbers = [](const ClosureVerdict& verdict) {
    std::vector<double> out;
    for (const auto& [from, to, measured] : verdict.closures) {
      out.insert(out.end(), {static_cast<double>(from.index), static_cast<double>(to.index)});
      const auto append = [&out](const auto& matrix) {
        out.insert(out.end(), matrix.data(), matrix.data() + matrix.size());
      };
      append(measured.T_a_b.translation);
      append(measured.T_a_b.rotation.coeffs());
      append(measured.covariance);
    }
    return out;
  };
  return numbers(a) < numbers(b);
}

}  // namespace

MapServer::MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureVerifier> verifier,
                     std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch)
    : MapServer(std::move(robots), std::move(verifier), std::move(payloads), config, epoch, MapServerState{}) {}

MapServer::MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureVerifier> verifier,
                     std::shared_ptr<PayloadStore> payloads, const ServerConfig& config, std::uint64_t epoch,
                     MapServerState state)
    : robots_(std::move(robots)),
      verifier_(std::move(verifier)),
      payloads_(std::move(payloads)),
      config_(config),
      state_(std::move(state)) {
  TUTTI_CHECK(verifier_ != nullptr && payloads_ != nullptr, "no verifier or no store of payloads");
  const MethodId who = verifier_->id();
  TUTTI_CHECK(!who.name.empty() && who.version > 0, "a verifier without a name or a version");
  state_.epoch = std::max(epoch, state_.epoch + 1);
  if (state_.verifier != who) {
    state_.verifier = who;
    state_.answered.forget_answers();
    state_.refused.clear();
  }
  former_pairs_ = static_cast<std::size_t>(
      std::ranges::count_if(state_.verdicts, [&](const auto& entry) { return entry.second.verifier != who; }));
  for (const auto& [id, submap] : state_.submaps) state_.answered.add_submap(id);
  for (const SubmapId& id : state_.retired)
    if (state_.submaps.contains(id)) state_.answered.insert_all_but(id, {});
  restore_candidates();
  plan_open_verifications();
  news_ = !state_.submaps.empty();
}

Status MapServer::receive(const SubmapMessage& message) {
  const SubmapId id = message.submap.id;
  if (!robots_.contains(id.chain.robot) || message.header.robot != id.chain.robot ||
      message.header.session != id.chain.session)
    return fail(ErrorCode::unknown_robot,
                "submap {} from robot {} in session {}: expected one of the mission's {} robots, as sender",
                to_string(id), message.header.robot.value, message.header.session, robots_.size());
  if (auto ok = check_submap(message.submap); !ok) return ok;
  if (const auto known = state_.submaps.find(id); known != state_.submaps.end()) {
    if (known->second->keyframes == message.submap.keyframes) return replace_lost_payload(message.submap);
    return fail(ErrorCode::invalid, "submap {} differs from the one in the map: robot {} has used session {} before",
                to_string(id), id.chain.robot.value, id.chain.session);
  }
  if (auto ok = check_room_for(id.chain); !ok) return ok;
  if (const PayloadSize size = payload_size(message.submap); size != PayloadSize()) {
    if (auto ok = payloads_->put(message.submap); !ok) return ok;
    state_.payload_sizes[id] = size;
  }
  state_.submaps[id] = std::make_shared<const Submap>(without_payloads(message.submap));
  state_.answered.add_submap(id);
  if (config_.candidates_per_submap > 0)
    if (std::string looks = verifier_->place_of(message.submap); !looks.empty()) {
      state_.places[id] = {.looks = std::move(looks), .candidates = {}};
      compare_place(id);
    }
  judge_waiting();
  plan_verifications(id);
  note_news();
  return {};
}

/// Every robot has its share of the sessions that a graph can hold, so that none can take the others'.
Status MapServer::check_room_for(const ChainId& chain) const {
  const std::size_t most = std::max<std::size_t>(1, ProxyGraph::kMostChains / robots_.size());
  std::size_t others = 0;
  auto it = state_.submaps.lower_bound({ChainId(chain.robot), 0});
  while (it != state_.submaps.end() && it->first.chain.robot == chain.robot) {
    if (it->first.chain == chain) return {};
    ++others;
    it = state_.submaps.upper_bound({it->first.chain, std::numeric_limits<std::uint32_t>::max()});
  }
  if (others < most) return {};
  return fail(ErrorCode::invalid, "robot {} begins session {}, but has {} in the map already, expected at most {}",
              chain.robot.value, chain.session, others, most);
}

Status MapServer::replace_lost_payload(const Submap& duplicate) {
  const PayloadSize size = size_of(duplicate.id);
  if (size == PayloadSize() || payload_size(duplicate) != size) return {};
  const bool is_there = (size.points == 0 || payloads_->cloud(duplicate.id)) &&
                        (size.observations == 0 || payloads_->visual(duplicate.id));
  return is_there ? Status() : payloads_->put(duplicate);
}

PayloadSize MapServer::size_of(SubmapId id) const {
  const auto found = state_.payload_sizes.find(id);
  return found == state_.payload_sizes.end() ? PayloadSize() : found->second;
}

bool MapServer::is_asked(const SubmapPair& pair) const {
  const auto first = state_.submaps.find(pair.first);
  const auto second = state_.submaps.find(pair.second);
  return first != state_.submaps.end() && second != state_.submaps.end() &&
         verifier_->can_compare(size_of(pair.first), size_of(pair.second)) &&
         verifier_->is_candidate(*first->second, *second->second);
}

bool MapServer::is_answered(const SubmapPair& pair) const {
  if (const auto found = state_.verdicts.find(pair); found != state_.verdicts.end())
    return found->second.verifier == state_.verifier || says(state_.decisions, pair, Wish::accept);
  return state_.answered.contains(pair);
}

std::vector<VerificationJob> MapServer::take_jobs() { return std::exchange(jobs_, {}); }

void MapServer::give_back(VerificationJob job) {
  if (!is_answered(job.pair) && is_asked(job.pair) && !candidates_.excludes(job.pair)) jobs_.push_back(std::move(job));
}

Status MapServer::receive(const ClosureVerdict& verdict) {
  if (auto ok = check_alone(verdict, robots_); !ok) return ok;
  if (verdict.verifier != state_.verifier)
    return fail(ErrorCode::unsupported, "{}: of verifier {}, expected {}", name_of(verdict),
                to_string(verdict.verifier), to_string(state_.verifier));
  if (!has_submaps_of(verdict)) return wait_for_submaps(verdict);
  if (auto ok = check_against_submaps(verdict); !ok) return ok;
  take(verdict);
  return {};
}

bool MapServer::has_submaps_of(const ClosureVerdict& verdict) const { return has_both(state_.submaps, verdict.pair); }

Status MapServer::check_against_submaps(const ClosureVerdict& verdict) const {
  const auto& [first, second] = verdict.pair;
  if (!is_asked(verdict.pair)) return fail(ErrorCode::invalid, "{}: the pair was not asked for", name_of(verdict));
  const auto check = [&](SubmapId id, std::uint32_t keyframe) -> Status {
    const auto& keyframes = state_.submaps.at(id)->keyframes;
    if (keyframes.front().index <= keyframe && keyframe <= keyframes.back().index) return {};
    return fail(ErrorCode::invalid, "{}: its closure is at keyframe {}, expected one of {} to {} of submap {}",
                name_of(verdict), keyframe, keyframes.front().index, keyframes.back().index, to_string(id));
  };
  for (const LoopClosure& closure : verdict.closures) {
    if (auto ok = check(first, closure.from.index); !ok) return ok;
    if (auto ok = check(second, closure.to.index); !ok) return ok;
  }
  return {};
}

Status MapServer::wait_for_submaps(const ClosureVerdict& verdict) {
  if (std::ranges::find(waiting_, verdict) != waiting_.end()) return {};
  if (waiting_.size() == kMostWaiting)
    return fail(ErrorCode::invalid, "{}: its submaps have not come, and {} verdicts wait already", name_of(verdict),
                waiting_.size());
  waiting_.push_back(verdict);
  return {};
}

void MapServer::judge_waiting() {
  const auto ready = std::ranges::stable_partition(waiting_, [&](const auto& v) { return !has_submaps_of(v); });
  const std::vector<ClosureVerdict> verdicts(ready.begin(), ready.end());
  waiting_.erase(ready.begin(), ready.end());
  for (const ClosureVerdict& verdict : verdicts)
    if (auto ok = receive(verdict); !ok) late_errors_.push_back(std::move(ok.error()));
}

void MapServer::take(const ClosureVerdict& verdict) {
  const auto& pair = verdict.pair;
  const auto kept = state_.verdicts.find(pair);
  const bool is_kept = kept != state_.verdicts.end();
  if (is_kept && says(state_.decisions, pair, Wish::accept)) return;
  if (is_answered(pair) && !(is_kept && holds_over(verdict, kept->second))) return;
  if (!verdict.closures.empty() || is_kept) note_news();
  state_.answered.insert(pair);
  ++work_.pairs_verified;
  if (is_kept && kept->second.verifier != state_.verifier) --former_pairs_;
  if (verdict.refusal) {
    count_refusal(*verdict.refusal, pair.first.chain.robot, pair.second.chain.robot, state_.refused);
    state_.verdicts.erase(pair);
  } else {
    state_.verdicts.insert_or_assign(pair, verdict);
  }
}

Status MapServer::receive(const SubmapPair& pair, const ClosureDecision& given) {
  const auto kept = kept_decision(pair, given, state_.submaps, state_.verdicts, state_.decisions);
  if (!kept) return tl::unexpected(kept.error());
  if (!*kept) return {};
  const ClosureDecision& decision = **kept;
  const auto known = state_.decisions.find(pair);
  const bool is_new = known == state_.decisions.end();
  const bool was_accepted = says(state_.decisions, pair, Wish::accept);
  const bool changes = is_new ? decision.wish != Wish::withdraw : known->second.wish != decision.wish;
  const bool adds = !decision.by_hand.empty() || (!is_new && !known->second.by_hand.empty());
  state_.decisions.insert_or_assign(pair, decision);
  if (was_accepted && decision.wish != Wish::accept) plan_verification(pair);  // other verifiers were not asked
  if ((changes && has_closures(state_.verdicts, pair)) || adds) note_news();
  return {};
}

void MapServer::note_news() {
  news_ = graph_is_new_ = true;
  estimate_.reset();
}

Status MapServer::receive(const Refinement& refinement) {
  const auto where = [&] { return fmt::format("refinement of revision {}", refinement.revision); };
  if (refinement.revision > state_.revision)
    return fail(ErrorCode::invalid, "{}: expected one of at most {}", where(), state_.revision);
  if (!refinement.why.empty()) return fail(ErrorCode::invalid, "{}: {}", where(), refinement.why);
  for (const auto& [from, step] : refinement.steps) {
    if (!is_valid(step.T_a_b)) return fail(ErrorCode::invalid, "{}: a step is no pose", where());
    if (auto ok = check_covariance(step.covariance); !ok) return in_context(where(), ok.error());
  }
  for (const auto& [id, T_world_body] : refinement.T_world_body)
    if (!is_valid(T_world_body))
      return fail(ErrorCode::invalid, "{}: keyframe {} has no valid pose", where(), id.index);
  if (refining_ == refinement.revision) refining_.reset();
  if (state_.refinements.add(refinement)) news_ = true;
  return {};
}

void MapServer::refine(bool settle) {
  if (estimate_) plan_refinement(*estimate_, state_.submaps, state_.payload_sizes, state_.verdicts, settle);
}

void MapServer::plan_refinement(const MapEstimate& estimate, const SubmapSet& submaps,
                                const std::map<SubmapId, PayloadSize>& sizes, const VerdictSet& verdicts, bool settle) {
  if (refiner_ == nullptr || config_.refine_every == 0 || refining_) return;
  RefinementScope scope = refinable(estimate, submaps, sizes, verdicts, *refiner_);
  if (asked_ && asked_->whole && asked_->scope == scope) return;
  refinement_job_ = server::plan_refinement(scope, state_.refinements, estimate, map_, submaps,
                                            {static_cast<std::size_t>(config_.refine_every), settle}, state_.revision);
  if (!refinement_job_) return;
  refining_ = state_.revision;
  asked_ = Asked{std::move(scope), refinement_job_->whole};
}

MapJob MapServer::begin(std::uint64_t revision) {
  makes_news_ = std::exchange(news_, false);
  graph_is_new_ = false;
  MapJob job{.submaps = state_.submaps,
             .payload_sizes = {},
             .verdicts = of_candidates(state_.verdicts, candidates_, state_.decisions),
             .decisions = state_.decisions,
             .refinements = state_.refinements,
             .map = config_.map,
             .proxy_graph = config_.proxy_graph,
             .epoch = state_.epoch,
             .revision = revision,
             .estimate = estimate_,
             .keeps_estimate = refiner_ != nullptr,
             .held = state_.held,
             .retired = state_.retired};
  if (job.keeps_estimate) job.payload_sizes = state_.payload_sizes;
  return job;
}

MapJob MapServer::begin_update() { return begin(state_.revision + 1); }
MapJob MapServer::begin_rebuild() { return begin(state_.revision); }

void MapServer::finish(MadeMap made, bool refines) {
  makes_news_ = false;
  state_.revision = made.job.revision;
  ++work_.updates;
  work_.search += made.search;
  work_.monitor += made.monitor;
  map_ = std::move(made.map);
  retire(map_, made.job);
  if (made.estimate && refines)
    plan_refinement(*made.estimate, made.job.submaps, made.job.payload_sizes, made.job.verdicts, false);
  if (!graph_is_new_) estimate_ = std::move(made.estimate);
}

ProxyGraphMessage MapServer::optimise() {
  MadeMap made = make_map(begin_update());
  ProxyGraphMessage message = std::move(made.message);
  finish(std::move(made));
  return message;
}

ProxyGraphMessage MapServer::rebuild() {
  MadeMap made = make_map(begin_rebuild());
  ProxyGraphMessage message = std::move(made.message);
  finish(std::move(made));
  return message;
}

}  // namespace tutti::server
