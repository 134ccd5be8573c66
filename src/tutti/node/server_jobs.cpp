// SPDX-License-Identifier: BSD-3-Clause
// The part of ServerNode that asks workers and takes their answers.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/refused_rows.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

/// A bus may bring an answer twice, which is nothing to report.
void ServerNode::refuse_unasked(const bus::Envelope& envelope, const std::string& job, Timestamp now, Step& step) {
  if (!jobs_.has_given(job))
    refuse(envelope, fmt::format("job '{}' is none of this server's since it started", plain_text(job)), now, step);
}

/// An answer counts for what was asked, and is the answer to all of it.
void ServerNode::receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto answer = wire::decode_verdicts(*envelope.bytes);
  if (!answer) return refuse(envelope, answer.error().message, now, step);
  const std::size_t part = answer->job.find('+');  // LaterAnswers::part_of(): there is more to come
  const bool is_all = part == std::string::npos;
  const std::string name = answer->job.substr(0, part);
  const auto job = is_all ? jobs_.close(name, now) : jobs_.find(name);
  if (!job) return refuse_unasked(envelope, name, now, step);
  std::erase_if(answer->failed, [&](const SubmapPair& pair) { return job->is_replaced || !job->has(pair); });
  std::erase_if(answer->verdicts, [&](const ClosureVerdict& verdict) { return !job->has(verdict.pair); });
  if (answer->cannot) {
    const bool is_unread = answer->failed.empty();  // the worker cannot read the job, and knows its id alone
    if (!job->is_replaced) note_waiting(is_unread ? job->pairs : answer->failed, answer->why, now, step);
    return;
  }
  std::set<SubmapPair> unanswered(job->pairs.begin(), job->pairs.end());
  for (const ClosureVerdict& verdict : answer->verdicts) unanswered.erase(verdict.pair);
  for (const SubmapPair& pair : answer->failed) unanswered.erase(pair);
  std::vector<ClosureVerdict> strange;
  const auto is_strange = [&](const ClosureVerdict& verdict) { return verdict.verifier != server_.state().verifier; };
  std::ranges::copy_if(answer->verdicts, std::back_inserter(strange), is_strange);
  std::erase_if(answer->verdicts, is_strange);
  if (!strange.empty()) set_aside(envelope, strange, now, step);
  Verdicts refused{.job = answer->job, .verdicts = {}, .failed = {}, .why = {}};
  for (ClosureVerdict& verdict : answer->verdicts) {
    const bool is_workers = envelope.from.role == bus::Endpoint::Role::worker && !verdict.closures.empty();
    failed_.forget(verdict.pair);
    waiting_.erase(verdict.pair);
    verdict.worker = is_workers ? std::uint64_t{envelope.from.number} + 1 : 0;
    if (const Status taken = take(verdict, refused, step); !taken) {
      refuse(envelope, taken.error().message, now, step);
      unanswered.insert(verdict.pair);
    }
  }
  for (const SubmapPair& pair : answer->failed) note_failed(pair, answer->why, now, refused, step);
  for (const SubmapPair& pair : unanswered)
    if (is_all && !job->is_replaced && !server_.state().answered.contains(pair))
      note_failed(pair, "the answer has nothing valid on it", now, refused, step);
  keep(refused, step);
  step.emit(now, VerdictsTaken{answer->job, answer->verdicts.size()});
}

/// Verdicts of another verifier than the server's, as of a program of another version: believed once the server has
/// that verifier. Closures are kept until then, one answer for each pair.
void ServerNode::set_aside(const bus::Envelope& envelope, const std::vector<ClosureVerdict>& verdicts, Timestamp now,
                           Step& step) {
  const std::string why = fmt::format("answers of verifier {}, expected {}: not believed",
                                      to_string(verdicts.front().verifier), to_string(server_.state().verifier));
  refuse(envelope, why, now, step);
  std::vector<SubmapPair> pairs;
  for (const ClosureVerdict& verdict : verdicts) {
    const SubmapPair& pair = verdict.pair;
    const server::SubmapSet& submaps = server_.state().submaps;
    if (!server::has_both(submaps, pair)) continue;
    pairs.push_back(pair);
    if (verdict.closures.empty()) continue;
    Verdicts aside{.job = fmt::format("aside/{}-{}", to_string(pair.first), to_string(pair.second)),
                   .verdicts = {verdict}};
    step.writes.push_back({map_tables::kAnswers, aside.job, wire::encode(aside)});
  }
  note_waiting(pairs, why, now, step);
}

/// No fault of the pair: it waits for a worker that can, however long.
void ServerNode::note_waiting(const std::vector<SubmapPair>& pairs, const std::string& why, Timestamp now, Step& step) {
  const server::SubmapSet& submaps = server_.state().submaps;
  const bool was_empty = waiting_.empty();
  for (const SubmapPair& pair : pairs)
    if (server::has_both(submaps, pair) && !server_.state().answered.contains(pair)) waiting_.insert(pair);
  why_waiting_ = plain_text(why);
  if (was_empty && !waiting_.empty()) step.emit(now, VerificationFailed{*waiting_.begin(), why});
  if (was_empty != waiting_.empty()) ++changes_;
  if (workers_.any_can(server_.verifier().id(), now)) ask_waiting(now, step);
}

void ServerNode::ask_waiting(Timestamp now, Step& step) {
  for (const SubmapPair& pair : std::exchange(waiting_, {})) give_back(pair);
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
}

void ServerNode::keep(const Verdicts& refused, Step& step) {
  std::ranges::move(rows_of_refusals(refused), std::back_inserter(step.writes));
}

/// It has ended every worker that had it (bus::Port::receive()). If the job has many pairs, one of them may have
/// done that: then each is asked alone.
void ServerNode::receive_returned_job(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto job = wire::decode_job(*envelope.bytes);
  if (!job) return refuse(envelope, job.error().message, now, step);
  if (const auto closed = jobs_.close(job->id, now); !closed || closed->is_replaced) return;
  Verdicts refused{.job = job->id, .verdicts = {}, .failed = {}, .why = {}};
  if (job->pairs.size() == 1) {
    give_up(job->pairs.front(), "every worker that had it has ended", now, refused, step);
    return keep(refused, step);
  }
  for (const SubmapPair& pair : job->pairs) give_back(pair);
  send_jobs(std::nullopt, now, 0, 1, step);
  step.emit(now, VerificationFailed{
                     job->pairs.front(),
                     fmt::format("one of {} pairs has ended every worker: asked one by one", job->pairs.size())});
}

void ServerNode::note_failed(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused,
                             Step& step) {
  const server::SubmapSet& submaps = server_.state().submaps;
  if (!server::has_both(submaps, pair)) return;
  const FailedPairs::Next next = failed_.note(pair, now);
  if (next == FailedPairs::Next::nothing) return;
  if (next == FailedPairs::Next::give_up)
    return give_up(pair, fmt::format("{} tries have failed: {}", config_.most_tries, why), now, refused, step);
  step.emit(now, VerificationFailed{pair, why});
  if (next == FailedPairs::Next::ask_now) give_back(pair);
}

/// The map goes on without it, and another verifier asks again.
void ServerNode::give_up(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step) {
  failed_.forget(pair);
  const ClosureVerdict verdict{.pair = pair,
                               .closures = {},
                               .refusal = Refusal{RefusalReason::unverified},
                               .verifier = server_.state().verifier};
  if (!take(verdict, refused, step)) return;
  note_refusal(bus::Endpoint::Role::worker, bus::MessageKind::job,
               fmt::format("submaps {} and {} are given up: {}", to_string(pair.first), to_string(pair.second), why));
  step.emit(now, VerificationFailed{pair, why, true});
}

Status ServerNode::take(const ClosureVerdict& verdict, Verdicts& refused, Step& step) {
  const server::VerdictSet& kept = server_.state().verdicts;
  const auto find = [&]() -> std::optional<ClosureVerdict> {
    const auto found = kept.find(verdict.pair);
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  };
  const auto before = find();
  const bool was_answered = server_.state().answered.contains(verdict.pair);
  if (auto ok = server_.receive(without_evidence(verdict)); !ok) return ok;
  const auto after = find();
  const bool is_answered = server_.state().answered.contains(verdict.pair);
  if (before != after) {
    std::optional<std::string> row;
    if (after) row = wire::encode(verdict);
    step.writes.push_back({map_tables::kVerdicts, key_of(verdict.pair), std::move(row)});
  }
  if (verdict.refusal && !after && (before || was_answered != is_answered)) refused.verdicts.push_back(verdict);
  return {};
}

/// A job is one submap against others: `newest`, if it is in the pair. `asked`: how often before.
void ServerNode::send_jobs(std::optional<SubmapId> newest, Timestamp now, unsigned asked, std::size_t most_pairs,
                           Step& step) {
  std::map<SubmapId, std::vector<SubmapPair>> pairs;
  for (const server::VerificationJob& job : server_.take_jobs())
    pairs[job.pair.first == newest ? job.pair.first : job.pair.second].push_back(job.pair);
  for (const auto& [submap, of_it] : pairs)
    for (std::size_t first = 0; first < of_it.size(); first += most_pairs) {
      const std::size_t last = std::min(of_it.size(), first + most_pairs);
      const auto at = [&](std::size_t i) { return of_it.begin() + static_cast<std::ptrdiff_t>(i); };
      const Job job{.id = jobs_.next_name(),
                    .pairs = {at(first), at(last)},
                    .verifier = server_.state().verifier,
                    .settings = server_.verifier().settings()};
      jobs_.open({job.pairs, nullptr, now, asked});
      step.messages.push_back({bus::Endpoint::server(), bus::Endpoint::any_worker(), bus::MessageKind::job, job.id,
                               std::make_shared<const std::string>(wire::encode(job))});
    }
}

bool ServerNode::give_back(const SubmapPair& pair) {
  const server::SubmapSet& submaps = server_.state().submaps;
  const auto first = submaps.find(pair.first), second = submaps.find(pair.second);
  if (first == submaps.end() || second == submaps.end()) return false;
  server_.give_back({pair, first->second, second->second});
  return true;
}

std::optional<Timestamp> ServerNode::next_timer() const {
  std::optional<Timestamp> next;
  const auto note = [&](const std::optional<Timestamp>& due) {
    if (due) next = std::min(next.value_or(*due), *due);
  };
  for (const auto& due : {settle_at_, refine_at_, jobs_.next_due(), failed_.next_due(), refinements_.next_due()})
    note(due);
  if (is_making_map_) return next;
  note(timer_);
  note(compute_at_);
  note(review_at_);
  return next;
}

/// The bus gives up a job that has ended five workers, and may lose one. An answer that comes after all is taken.
void ServerNode::ask_again(Timestamp now, Step& step) {
  bool is_due = false;
  for (const SubmapPair& pair : failed_.take_due(now)) is_due = give_back(pair) || is_due;
  if (is_due) send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  if (auto job = refinements_.take_due(now)) ask_for_refinement(std::move(*job), now, 0, step);
  for (const JobBook::OpenJob& job : jobs_.take_late(now)) {
    const std::string why = fmt::format("no worker has answered for {:g} s: asked again", now - job.since);
    if (job.refinement) {
      ask_for_refinement(*job.refinement, now, job.asked + 1, step);
      step.emit(now, RefinementFailed{job.refinement->revision, why});
      continue;
    }
    const std::size_t before = step.messages.size();
    for (const SubmapPair& pair : job.pairs) give_back(pair);
    send_jobs(std::nullopt, now, job.asked + 1, config_.pairs_per_job, step);
    if (step.messages.size() > before) step.emit(now, VerificationFailed{job.pairs.front(), why});
  }
}

}  // namespace tutti::node
