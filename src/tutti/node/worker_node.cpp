// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/worker_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace {

std::set<SubmapId> submaps_of(const Job& job) {
  std::set<SubmapId> ids;
  for (const auto& [first, second] : job.pairs) ids.insert({first, second});
  return ids;
}

std::set<SubmapId> submaps_of(const RefinementJob& job) {
  std::set<SubmapId> ids;
  for (const RefinementJob::Part& part : job.parts) ids.insert(part.submap);
  return ids;
}

std::set<SubmapId> submaps_of(const std::variant<Job, RefinementJob>& job) {
  return std::visit([](const auto& one) { return submaps_of(one); }, job);
}

/// An exception of a verifier or refiner is a defect of ours: it costs the pair, or the refinement, and nothing else.
template <class T, class Call>
Result<T> caught(Call&& call) {
  try {
    return call();
  } catch (const std::exception& error) {
    return fail(ErrorCode::invalid, "the worker has thrown, which is a defect of it: {}", plain_text(error.what()));
  }
}

}  // namespace

void WorkerNode::one_by_one(std::size_t count, const std::function<void(std::size_t)>& call) {
  for (std::size_t i = 0; i < count; ++i) call(i);
}

WorkerNode::WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureVerifier> verifier,
                       std::shared_ptr<const SubmapFrames> submaps, ForEach for_each)
    : self_(self), verifier_(std::move(verifier)), submaps_(std::move(submaps)), for_each_(std::move(for_each)) {}

WorkerNode::WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureVerifier> verifier,
                       std::shared_ptr<FrameCache> cache, ForEach for_each)
    : self_(self),
      verifier_(std::move(verifier)),
      cache_(std::move(cache)),
      submaps_(std::make_shared<const SubmapFrames>([frames = cache_](SubmapId id) { return frames->get(id); })),
      for_each_(std::move(for_each)) {}

Result<ClosureVerdict> WorkerNode::verify(const SubmapPair& pair) const {
  return caught<ClosureVerdict>([&] { return verify_or_throw(pair); });
}

Result<ClosureVerdict> WorkerNode::verify_or_throw(const SubmapPair& pair) const {
  const auto first = submaps_->submap(pair.first);
  if (!first) return tl::unexpected(first.error());
  const auto second = submaps_->submap(pair.second);
  if (!second) return tl::unexpected(second.error());
  auto verdict = asked_verifier_->verify(**first, **second, *submaps_);
  if (!verdict) return verdict;
  if (auto ok = wire::validate(*verdict); !ok) return tl::unexpected(ok.error());
  return verdict;
}

Step WorkerNode::receive(const bus::Envelope& envelope, Timestamp now) {
  Step step;
  if (envelope.kind == bus::MessageKind::job || envelope.kind == bus::MessageKind::refinement_job)
    receive_job(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::submap_copy)
    receive_copy(envelope, now, step);
  else
    step.emit(now, MessageRefused{envelope.from, envelope.kind, "not for a worker"});
  return step;
}

Result<WorkerNode::AnyJob> WorkerNode::decode(const bus::Envelope& envelope) {
  if (envelope.kind == bus::MessageKind::job) return wire::decode_job(*envelope.bytes);
  return wire::decode_refinement_job(*envelope.bytes);
}

std::vector<MethodId> WorkerNode::can() const {
  std::vector<MethodId> out;
  if (maker_) out = maker_->can();
  out.push_back(verifier_->id());
  if (refiner_ && !refiner_->id().name.empty()) out.push_back(refiner_->id());
  return out;
}

Status WorkerNode::prepare(const Job& job) {
  if (job.verifier == verifier_->id()) {
    asked_verifier_ = verifier_;
    return {};
  }
  if (asked_verifier_ && asked_verifier_->id() == job.verifier) return {};
  auto made = maker_ ? maker_->verifier(job.verifier, job.settings)
                     : fail(ErrorCode::unsupported, "this worker has verifier {} alone", to_string(verifier_->id()));
  if (!made) return tl::unexpected(made.error());
  asked_verifier_ = std::move(*made);
  return {};
}

Status WorkerNode::prepare(const RefinementJob& job) {
  if (job.refiner.name.empty() || (refiner_ && refiner_->id() == job.refiner)) {
    asked_refiner_ = refiner_;
    return {};
  }
  if (asked_refiner_ && asked_refiner_->id() == job.refiner) return {};
  auto made = maker_ ? maker_->refiner(job.refiner, job.settings)
                     : fail(ErrorCode::unsupported, "this worker has no refiner {}", to_string(job.refiner));
  if (!made) return tl::unexpected(made.error());
  asked_refiner_ = std::move(*made);
  return {};
}

void WorkerNode::send(bus::MessageKind kind, const std::string& job, std::string bytes, Step& step) const {
  step.messages.push_back(
      {self_, bus::Endpoint::server(), kind, job, std::make_shared<const std::string>(std::move(bytes))});
}

void WorkerNode::decline(const Job& job, const std::string& why, bool cannot, Step& step) const {
  const Verdicts answer{.job = job.id,
                        .verdicts = {},
                        .failed = job.pairs,
                        .why = why.substr(0, wire::kMaxReasonBytes),
                        .cannot = cannot};
  send(bus::MessageKind::verdicts, job.id, wire::encode(answer), step);
}

void WorkerNode::decline(const RefinementJob& job, const std::string& why, bool cannot, Step& step) const {
  Refinement answer = answer_to(job);
  answer.why = why.substr(0, wire::kMaxReasonBytes);
  answer.cannot = cannot;
  send(bus::MessageKind::refinement, job.id, wire::encode(answer), step);
}

void WorkerNode::decline_unread(const bus::Envelope& envelope, const std::string& why, Step& step) const {
  if (envelope.kind == bus::MessageKind::job)
    decline(Job{.id = envelope.id, .pairs = {}}, why, true, step);
  else
    decline(RefinementJob{.id = envelope.id}, why, true, step);
}

void WorkerNode::receive_job(const bus::Envelope& envelope, Timestamp now, Step& step) {
  TUTTI_CHECK(!pending_ && !rests_until_, "a second job");
  auto job = decode(envelope);
  if (!job) {
    step.emit(now, MessageRefused{envelope.from, envelope.kind, job.error().message});
    if (job.error().code != ErrorCode::unsupported) return;
    decline_unread(envelope, job.error().message, step);
    if (rest_s_ > 0.0) rests_until_ = now + rest_s_;
    return;
  }
  const Status ready = std::visit([&](const auto& one) { return prepare(one); }, *job);
  if (!ready) {
    std::visit([&](const auto& one) { decline(one, ready.error().message, true, step); }, *job);
    if (rest_s_ > 0.0) rests_until_ = now + rest_s_;
    return;
  }
  std::set<SubmapId> missing;
  if (cache_)
    for (const SubmapId& id : submaps_of(*job))
      if (!cache_->contains(id)) missing.insert(id);
  if (missing.empty()) return answer(*job, now, step);
  pending_ = PendingJob{.job = std::move(*job), .missing = std::move(missing), .asked = {}, .last_came = now};
  ask(now, step);
}

/// A copy that is no good, or was not asked for, is not taken.
void WorkerNode::receive_copy(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto refuse = [&](const std::string& why) {
    step.emit(now, MessageRefused{envelope.from, envelope.kind, why});
  };
  auto copy = wire::decode_submap_copy(*envelope.bytes);
  if (!copy) return refuse(copy.error().message);
  if (!pending_ || !pending_->missing.contains(copy->id)) return;  // it came twice
  if (copy->frame.empty()) {  // nobody's job: answered as failed, which makes room for the next
    const PendingJob pending = *std::exchange(pending_, std::nullopt);
    const std::string why = fmt::format("submap {} is not in the map", to_string(copy->id));
    std::visit([&](const auto& job) { decline(job, why, false, step); }, pending.job);
    return;
  }
  const auto message = wire::decode_submap(copy->frame);
  if (!message && message.error().code == ErrorCode::unsupported) {
    const PendingJob pending = *std::exchange(pending_, std::nullopt);
    const std::string why = fmt::format("submap {}: {}", to_string(copy->id), message.error().message);
    std::visit([&](const auto& job) { decline(job, why, true, step); }, pending.job);
    rests_until_ = now + kRest_s;  // also the server's own: the job is asked again at once
  }
  if (!message) return refuse(message.error().message);
  if (message->submap.id != copy->id) return refuse("another submap than it says");
  cache_->put(copy->id, std::move(copy->frame));
  pending_->missing.erase(copy->id);
  pending_->asked.erase(copy->id);
  pending_->last_came = now;
  if (!pending_->missing.empty()) return ask(now, step);
  const PendingJob pending = *std::exchange(pending_, std::nullopt);
  answer(pending.job, now, step);
  cache_->trim({});
}

void WorkerNode::ask(Timestamp now, Step& step) {
  PendingJob& pending = *pending_;
  std::erase_if(pending.asked, [&](const auto& asked) { return now - asked.second >= kAskAgain_s; });
  SubmapRequest request;
  for (const SubmapId& id : pending.missing) {
    if (pending.asked.size() >= kMostAsked) break;
    if (pending.asked.emplace(id, now).second) request.submaps.push_back(id);
  }
  if (request.submaps.empty()) return;
  step.messages.push_back({self_,
                           bus::Endpoint::server(),
                           bus::MessageKind::submap_request,
                           {},
                           std::make_shared<const std::string>(wire::encode(request))});
  cache_->trim(submaps_of(pending.job));
}

std::optional<Timestamp> WorkerNode::next_timer() const {
  const auto due = later_.next_due();
  if (!pending_) return due && rests_until_ ? std::min(due, rests_until_) : due ? due : rests_until_;
  Timestamp next = std::min(pending_->last_came + kPatience_s, due.value_or(kLastTimestamp));
  for (const auto& [id, asked] : pending_->asked) next = std::min(next, asked + kAskAgain_s);
  return next;
}

Step WorkerNode::on_timer(Timestamp now) {
  Step step;
  if (rests_until_ && *rests_until_ <= now) rests_until_.reset();
  send_due(now, step);
  if (!pending_) return step;
  if (now - pending_->last_came < kPatience_s) {
    ask(now, step);
    return step;
  }
  const PendingJob pending = *std::exchange(pending_, std::nullopt);
  answer(pending.job, now, step);  // without them: those pairs have failed
  return step;
}

Result<Refinement> WorkerNode::refine(const RefinementJob& job) const {
  return caught<Refinement>([&] { return refine_or_throw(job); });
}

Result<Refinement> WorkerNode::refine_or_throw(const RefinementJob& job) const {
  if (!asked_refiner_) return fail(ErrorCode::unsupported, "this worker refines no maps: its mission has no cameras");
  server::SubmapSet submaps;
  for (const RefinementJob::Part& part : job.parts) {
    auto submap = submaps_->submap(part.submap);
    if (!submap) return tl::unexpected(submap.error());
    submaps[part.submap] = std::move(*submap);
  }
  auto refinement = asked_refiner_->refine(job, submaps, *submaps_);
  if (!refinement) return refinement;
  if (auto ok = wire::validate(*refinement); !ok) return tl::unexpected(ok.error());
  return refinement;
}

void WorkerNode::answer(const RefinementJob& job, Timestamp /*now*/, Step& step) {
  Result<Refinement> result = answer_to(job);
  for_each_(1, [&](std::size_t) { result = refine(job); });
  Refinement answer = result ? std::move(*result) : answer_to(job);
  if (!result) answer.why = result.error().message.substr(0, wire::kMaxReasonBytes);
  send(bus::MessageKind::refinement, job.id, wire::encode(answer), step);
}

void WorkerNode::answer(const AnyJob& job, Timestamp now, Step& step) {
  std::visit([&](const auto& one) { answer(one, now, step); }, job);
}

/// Empty when all closures of the verdict are known.
std::vector<Timestamp> WorkerNode::known_at(const ClosureVerdict& verdict, Timestamp now) {
  const auto first = submaps_->submap(verdict.pair.first), second = submaps_->submap(verdict.pair.second);
  if (verdict.closures.empty() || !first || !second) return {};
  auto known_at = asked_verifier_->known_at(**first, **second);
  if (!known_at.empty())
    later_.note_newest(std::max((*first)->keyframes.back().stamp, (*second)->keyframes.back().stamp), now);
  return known_at;
}

void WorkerNode::send_due(Timestamp now, Step& step) {
  for (const Verdicts& answer : later_.take_due(now))
    send(bus::MessageKind::verdicts, answer.job, wire::encode(answer), step);
}

void WorkerNode::answer(const Job& job, Timestamp now, Step& step) {
  std::vector<Result<ClosureVerdict>> results(job.pairs.size());
  for_each_(job.pairs.size(), [&](std::size_t i) { results[i] = verify(job.pairs[i]); });
  Verdicts answer{.job = job.id, .verdicts = {}, .failed = {}, .why = {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i]) {
      if (clock_ && !results[i]->closures.empty()) results[i]->verified_ns = clock_();
      if (auto later = known_at(*results[i], now); !later.empty())
        later_.add(job.id, std::move(*results[i]), std::move(later));
      else
        answer.verdicts.push_back(std::move(*results[i]));
      continue;
    }
    if (answer.failed.empty()) answer.why = results[i].error().message.substr(0, wire::kMaxReasonBytes);
    answer.failed.push_back(job.pairs[i]);
  }
  if (later_.has(job.id)) answer.job = later_.part_of(job.id);
  if (!later_.has(job.id) || !answer.verdicts.empty() || !answer.failed.empty())
    send(bus::MessageKind::verdicts, answer.job, wire::encode(answer), step);
  send_due(now, step);
}

}  // namespace tutti::node
