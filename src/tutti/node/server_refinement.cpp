// SPDX-License-Identifier: BSD-3-Clause
// How a ServerNode has its map refined.
#include <fmt/format.h>

#include <set>
#include <utility>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::node {
namespace {

std::set<std::uint64_t> revisions(const server::Refinements& refinements) {
  std::set<std::uint64_t> out;
  for (const auto& [revision, refinement] : refinements.all()) out.insert(revision);
  return out;
}

}  // namespace

void ServerNode::send_refinement_job(Timestamp now, Step& step) {
  auto job = server_.take_refinement_job();
  if (!job) return;
  refine_from_ = now + config_.server.refine_pause_s;
  ask_for_refinement(std::move(*job), now, 0, step);
}

void ServerNode::ask_for_refinement(RefinementJob job, Timestamp now, unsigned asked, Step& step) {
  job.id = jobs_.next_name();
  job.refiner = config_.refiner->id();
  job.settings = config_.refiner->settings();
  if (const Status valid = wire::validate(job); !valid)
    return give_up_refinement(job.revision, valid.error().message, now, step);
  step.messages.push_back({bus::Endpoint::server(), bus::Endpoint::any_worker(), bus::MessageKind::refinement_job,
                           job.id, std::make_shared<const std::string>(wire::encode(job))});
  jobs_.open({{}, std::make_shared<const RefinementJob>(std::move(job)), now, asked});
}

void ServerNode::receive_refinement(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto refinement = wire::decode_refinement(*envelope.bytes);
  if (!refinement) return refuse(envelope, refinement.error().message, now, step);
  const auto closed = jobs_.close(refinement->job, now);
  if (!closed || !closed->refinement) return refuse_unasked(envelope, refinement->job, now, step);
  const RefinementJob& asked = *closed->refinement;
  const auto failed = [&](const std::string& why) {
    if (!closed->is_replaced) note_failed_refinement(asked, why, now, step);
  };
  if (refinement->cannot) {
    if (closed->is_replaced) return;
    refinements_.wait(asked);
    why_waiting_ = plain_text(refinement->why);
    ++changes_;
    return step.emit(now, RefinementFailed{asked.revision, refinement->why});
  }
  if (refinement->revision != asked.revision || refinement->whole != asked.whole) {
    const std::string why = "an answer to another refinement than was asked for";
    refuse(envelope, why, now, step);
    return failed(why);
  }
  if (!refinement->why.empty()) return failed(refinement->why);
  const std::set<std::uint64_t> before = revisions(server_.state().refinements);
  if (const Status taken = server_.receive(*refinement); !taken) {
    refuse(envelope, taken.error().message, now, step);
    return failed(taken.error().message);
  }
  refinements_.start_anew();
  const std::set<std::uint64_t> after = revisions(server_.state().refinements);
  for (const std::uint64_t revision : before)
    if (!after.contains(revision)) step.writes.push_back({map_tables::kMeta, refinement_key(revision), std::nullopt});
  for (const std::uint64_t revision : after)
    if (!before.contains(revision))
      step.writes.push_back({map_tables::kMeta, refinement_key(revision), *envelope.bytes});
  step.emit(now, RefinementTaken{refinement->job, refinement->revision, refinement->whole, refinement->steps.size(),
                                 refinement->remarks});
}

/// It has ended every worker that had it (bus::Port::receive()).
void ServerNode::receive_returned_refinement(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto job = wire::decode_refinement_job(*envelope.bytes);
  if (!job) return refuse(envelope, job.error().message, now, step);
  if (const auto closed = jobs_.close(job->id, now); closed && !closed->is_replaced)
    give_up_refinement(job->revision, "every worker that had it has ended", now, step);
}

void ServerNode::note_failed_refinement(const RefinementJob& job, const std::string& why, Timestamp now, Step& step) {
  if (!refinements_.note_failed(job, now)) return give_up_refinement(job.revision, why, now, step);
  step.emit(now, RefinementFailed{job.revision, why});
}

/// The map goes on without it, and asks for another when something new has come.
void ServerNode::give_up_refinement(std::uint64_t revision, const std::string& why, Timestamp now, Step& step) {
  refinements_.start_anew();
  server_.give_up_refinement();
  note_refusal(bus::Endpoint::Role::worker, bus::MessageKind::refinement_job,
               fmt::format("the refinement of revision {} is given up: {}", revision, why));
  step.emit(now, RefinementFailed{revision, why, true});
}

void ServerNode::note_settling(Timestamp now) {
  settle_at_.reset();
  refine_at_ = config_.refiner == nullptr || may_refine(now) ? std::nullopt : refine_from_;
  if (server_.is_unsettled())
    settle_at_ = now + static_cast<double>(config_.server.refine_every) * config_.server.refine_pause_s;
}

void ServerNode::settle(Timestamp now, Step& step) {
  if (refine_at_ && *refine_at_ <= now) {
    refine_at_.reset();
    server_.refine();
    send_refinement_job(now, step);
  }
  if (!settle_at_ || *settle_at_ > now) return;
  settle_at_.reset();
  server_.settle();
  send_refinement_job(now, step);
}

}  // namespace tutti::node
