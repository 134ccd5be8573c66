// SPDX-License-Identifier: BSD-3-Clause
// What a ServerNode asks its workers, and what they answer.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <system_error>
#include <utility>

#include "tutti/node/server_node.hpp"
#include "tutti/node/words.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

constexpr unsigned kMostDoubled = 10;
constexpr double kFailedAgain = 0.1;  // of the time for an answer

}  // namespace

void ServerNode::receive_verdicts(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto answer = wire::decode_verdicts(*envelope.bytes);
  if (!answer) return refuse(envelope, answer.error().message, now, step);
  const bool was_open = close(answer->job, now).has_value();
  if (answer->cannot) {
    if (was_open) note_waiting(answer->failed, answer->why, now, step);
    return;
  }
  std::vector<ClosureVerdict> strange;
  const auto is_strange = [&](const ClosureVerdict& verdict) { return verdict.finder != server_.state().finder; };
  std::ranges::copy_if(answer->verdicts, std::back_inserter(strange), is_strange);
  std::erase_if(answer->verdicts, is_strange);
  if (!strange.empty()) set_aside(envelope, strange, was_open, now, step);
  Verdicts refused{.job = answer->job, .verdicts = {}, .failed = {}, .why = {}};
  for (ClosureVerdict& verdict : answer->verdicts) {
    const bool is_workers = envelope.from.role == bus::Endpoint::Role::worker && !verdict.closures.empty();
    failed_.erase(verdict.pair);
    waiting_.erase(verdict.pair);
    verdict.worker = is_workers ? std::optional(envelope.from.number) : std::nullopt;
    if (const Status taken = take(verdict, refused, step); !taken) refuse(envelope, taken.error().message, now, step);
  }
  for (const SubmapPair& pair : answer->failed) note_failed(pair, answer->why, now, refused, step);
  keep(refused, step);
  step.tell(now, VerdictsTaken{answer->job, answer->verdicts.size()});
}

/// Of another finder than the server's, as of a program of another version: believed when the server's is that one.
/// Closures are kept until then, one answer for each pair.
void ServerNode::set_aside(const bus::Envelope& envelope, const std::vector<ClosureVerdict>& verdicts, bool was_open,
                           Timestamp now, Step& step) {
  const std::string why = fmt::format("answers of finder {}, expected {}: not believed",
                                      to_string(verdicts.front().finder), to_string(server_.state().finder));
  refuse(envelope, why, now, step);
  if (!was_open) return;
  std::vector<SubmapPair> pairs;
  for (const ClosureVerdict& verdict : verdicts) {
    const SubmapPair& pair = verdict.pair;
    const server::SubmapSet& submaps = server_.state().submaps;
    if (!server::has_both(submaps, pair)) continue;
    pairs.push_back(pair);
    if (verdict.closures.empty()) continue;
    Verdicts aside{.job = fmt::format("aside/{}-{}", to_string(pair.first), to_string(pair.second)),
                   .verdicts = {verdict}};
    step.writes.push_back({"answers", aside.job, wire::encode(aside)});
  }
  note_waiting(pairs, why, now, step);
}

/// No fault of the pair: it waits for a worker that can, however long.
void ServerNode::note_waiting(const std::vector<SubmapPair>& pairs, const std::string& why, Timestamp now, Step& step) {
  const server::SubmapSet& submaps = server_.state().submaps;
  const bool was_empty = waiting_.empty();
  for (const SubmapPair& pair : pairs)
    if (server::has_both(submaps, pair) && !server_.state().answered.contains(pair)) waiting_.insert(pair);
  why_waiting_ = wire::plain_text(why);
  if (was_empty && !waiting_.empty()) step.tell(now, VerificationFailed{*waiting_.begin(), why});
  if (was_empty != waiting_.empty()) ++changes_;
  if (std::ranges::any_of(workers_, [&](const auto& entry) {
        return now - entry.second.last_seen <= kWorkerIsThere_s && can(entry.second.status, server_.finder().id());
      }))
    ask_waiting(now, step);
}

bool ServerNode::can(const NodeStatus& worker, const MethodId& id) {
  return std::ranges::any_of(worker.can, [&](const MethodId& can) {
    return can.name == id.name && can.version == id.version && (can.settings == 0 || can.settings == id.settings);
  });
}

void ServerNode::ask_waiting(Timestamp now, Step& step) {
  for (const SubmapPair& pair : std::exchange(waiting_, {})) give_back(pair);
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
}

void ServerNode::keep(const Verdicts& refused, Step& step) {
  if (!refused.verdicts.empty()) step.writes.push_back({"answers", refused.job, wire::encode(refused)});
}

/// It has ended every worker that had it (bus::Port::receive()). Of many pairs one may have done that: each is asked
/// alone then.
void ServerNode::receive_returned_job(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto job = wire::decode_job(*envelope.bytes);
  if (!job) return refuse(envelope, job.error().message, now, step);
  if (!close(job->id, now)) return;
  Verdicts refused{.job = job->id, .verdicts = {}, .failed = {}, .why = {}};
  if (job->pairs.size() == 1) {
    give_up(job->pairs.front(), "every worker that had it has ended", now, refused, step);
    return keep(refused, step);
  }
  for (const SubmapPair& pair : job->pairs) give_back(pair);
  send_jobs(std::nullopt, now, 0, 1, step);
  step.tell(now, VerificationFailed{
                     job->pairs.front(),
                     fmt::format("one of {} pairs has ended every worker: asked one by one", job->pairs.size())});
}

void ServerNode::note_failed(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused,
                             Step& step) {
  const server::SubmapSet& submaps = server_.state().submaps;
  if (!server::has_both(submaps, pair)) return;
  Failed& failed = failed_[pair];
  if (failed.again) return;  // it is known: the answer has come twice
  if (++failed.times >= config_.most_tries)
    return give_up(pair, fmt::format("{} tries have failed: {}", failed.times, why), now, refused, step);
  step.tell(now, VerificationFailed{pair, why});
  if (config_.job_timeout_s > 0.0)
    failed.again = now + failed_again_after(failed.times);
  else
    give_back(pair);
}

double ServerNode::failed_again_after(unsigned times) const {
  return kFailedAgain * config_.job_timeout_s * static_cast<double>(1U << (times - 1));
}

/// The map goes on without it, and another finder asks again.
void ServerNode::give_up(const SubmapPair& pair, const std::string& why, Timestamp now, Verdicts& refused, Step& step) {
  failed_.erase(pair);
  const ClosureVerdict verdict{
      .pair = pair, .closures = {}, .refusal = Refusal{RefusalReason::unverified}, .finder = server_.state().finder};
  if (!take(verdict, refused, step)) return;
  note_refusal(bus::Endpoint::Role::worker, bus::MessageKind::job,
               fmt::format("submaps {} and {} are given up: {}", to_string(pair.first), to_string(pair.second), why));
  step.tell(now, VerificationFailed{pair, why, true});
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
    step.writes.push_back({"verdicts", key_of(verdict.pair), std::move(row)});
  }
  if (verdict.refusal && !after && (before || was_answered != is_answered)) refused.verdicts.push_back(verdict);
  return {};
}

/// A job is one submap against others: `newest`, if it is in the pair. Its name is no other map's: a bus takes one job
/// of a name. `asked`: how often before.
void ServerNode::send_jobs(std::optional<SubmapId> newest, Timestamp now, unsigned asked, std::size_t most_pairs,
                           Step& step) {
  std::map<SubmapId, std::vector<SubmapPair>> pairs;
  for (const server::VerificationJob& job : server_.take_jobs())
    pairs[job.pair.first == newest ? job.pair.first : job.pair.second].push_back(job.pair);
  for (const auto& [submap, of_it] : pairs)
    for (std::size_t first = 0; first < of_it.size(); first += most_pairs) {
      const std::size_t last = std::min(of_it.size(), first + most_pairs);
      const auto at = [&](std::size_t i) { return of_it.begin() + static_cast<std::ptrdiff_t>(i); };
      const Job job{.id = job_name(jobs_),
                    .pairs = {at(first), at(last)},
                    .finder = server_.state().finder,
                    .settings = server_.finder().settings()};
      open_jobs_.emplace(jobs_++, OpenJob{job.pairs, nullptr, now, asked});
      step.messages.push_back({bus::Endpoint::server(), bus::Endpoint::any_worker(), bus::MessageKind::job, job.id,
                               std::make_shared<const std::string>(wire::encode(job))});
    }
}

std::string ServerNode::job_name(std::uint64_t number) const { return fmt::format("{}{}", names_of_jobs(), number); }

/// An older map that was put back counts its starts once more.
std::string ServerNode::names_of_jobs() const {
  const std::string start = fmt::format("{}/{}/", server_.state().epoch, start_);
  return config_.incarnation == 0 ? start : fmt::format("{}{:08x}/", start, config_.incarnation);
}

/// The jobs that were sent later have not had their turn, as long as it goes on: a long queue is no reason to ask
/// again.
std::optional<ServerNode::OpenJob> ServerNode::close(const std::string& job, Timestamp now) {
  const std::string mine = names_of_jobs();
  std::uint64_t number = 0;
  if (!job.starts_with(mine)) return std::nullopt;
  const char* end = job.data() + job.size();
  if (const auto read = std::from_chars(job.data() + mine.size(), end, number);
      read.ec != std::errc() || read.ptr != end)
    return std::nullopt;
  if (number >= jobs_) return std::nullopt;
  auto open = open_jobs_.extract(number);
  for (auto later = open_jobs_.upper_bound(number); later != open_jobs_.end(); ++later) later->second.since = now;
  return open ? std::optional(std::move(open.mapped())) : std::nullopt;
}

bool ServerNode::give_back(const SubmapPair& pair) {
  const server::SubmapSet& submaps = server_.state().submaps;
  const auto first = submaps.find(pair.first), second = submaps.find(pair.second);
  if (first == submaps.end() || second == submaps.end()) return false;
  server_.give_back({pair, first->second, second->second});
  return true;
}

/// Every time twice as long: without workers the bus fills slowly.
Timestamp ServerNode::due(const OpenJob& job) const {
  return job.since + config_.job_timeout_s * static_cast<double>(1U << std::min(job.asked, kMostDoubled));
}

std::optional<Timestamp> ServerNode::next_timer() const {
  std::optional<Timestamp> next = timer_;
  const auto consider = [&](Timestamp t) { next = next ? std::min(*next, t) : t; };
  if (compute_at_) consider(*compute_at_);
  if (settle_at_) consider(*settle_at_);
  if (config_.job_timeout_s <= 0.0) return next;
  for (const auto& [number, job] : open_jobs_) consider(due(job));
  for (const auto& [pair, failed] : failed_)
    if (failed.again) consider(*failed.again);
  if (refine_again_) consider(refine_again_->due);
  return next;
}

/// The bus gives up a job that has ended five workers, and may lose one. An answer that comes after all does no harm.
void ServerNode::ask_again(Timestamp now, Step& step) {
  if (config_.job_timeout_s <= 0.0) return;
  bool is_due = false;
  for (auto& [pair, failed] : failed_)
    if (failed.again && *failed.again <= now) {
      failed.again.reset();
      is_due = give_back(pair) || is_due;
    }
  if (is_due) send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  refine_again(now, step);
  std::vector<OpenJob> late;
  for (auto job = open_jobs_.begin(); job != open_jobs_.end();) {
    const auto next = std::next(job);
    if (due(job->second) <= now) late.push_back(std::move(open_jobs_.extract(job).mapped()));
    job = next;
  }
  for (const OpenJob& job : late) {
    const std::string why = fmt::format("no worker has answered for {:g} s: asked again", now - job.since);
    if (job.refinement) {
      ask_for_refinement(*job.refinement, now, job.asked + 1, step);
      step.tell(now, RefinementFailed{job.refinement->revision, why});
      continue;
    }
    const std::size_t before = step.messages.size();
    for (const SubmapPair& pair : job.pairs) give_back(pair);
    send_jobs(std::nullopt, now, job.asked + 1, config_.pairs_per_job, step);
    if (step.messages.size() > before) step.tell(now, VerificationFailed{job.pairs.front(), why});
  }
}

}  // namespace tutti::node
