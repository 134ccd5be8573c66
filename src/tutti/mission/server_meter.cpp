// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/server_meter.hpp"

#include <algorithm>
#include <variant>

#include "tutti/mission/load_meter.hpp"

namespace tutti::mission {

Result<ClosureVerdict> MeasuredVerifier::verify(const Submap& first, const Submap& second,
                                                const server::PayloadStore& payloads) const {
  double cpu_s = 0.0;
  drive::Stopwatch watch;
  auto verdict = [&] {
    const drive::CpuScope cpu(cpu_s);
    return wrapped().verify(first, second, payloads);
  }();
  const double took_ms = watch.lap_ms();
  const std::scoped_lock lock(mutex_);
  took_ms_.push_back(took_ms);
  cpu_s_ += cpu_s;
  return verdict;
}

Result<Refinement> MeasuredRefiner::refine(const RefinementJob& job, const server::SubmapSet& submaps,
                                           const server::PayloadStore& payloads) const {
  RefinementTiming timing{.whole = job.whole};
  const auto is_free = [](const RefinementJob::Part& part) { return part.is_free; };
  timing.free_submaps = static_cast<std::size_t>(std::ranges::count_if(job.parts, is_free));
  timing.submaps = job.parts.size();
  auto refinement = [&] {
    const drive::CpuScope cpu(timing.cpu_s);
    return refiner_->refine(job, submaps, payloads);
  }();
  took_.push_back(timing);
  return refinement;
}

double ServerMeter::refinement_cpu_s() const {
  double sum = 0.0;
  if (refiner_)
    for (const RefinementTiming& timing : refiner_->took()) sum += timing.cpu_s;
  return sum;
}

void ServerMeter::note_submap(double time_s, const node::Step& step) {
  if (std::ranges::none_of(
          step.events, [](const node::Event& event) { return std::holds_alternative<node::SubmapStored>(event.what); }))
    return;
  for (const bus::Envelope& message : step.messages)
    if (message.kind == bus::MessageKind::job) of_job_[message.id] = unanswered_.size();
  unanswered_.push_back({time_s, 0.0});
}

void ServerMeter::note_job(const std::string& job, double cpu_s) {
  if (const auto of = of_job_.find(job); of != of_job_.end()) unanswered_[of->second].verification_cpu_s += cpu_s;
}

/// The submaps are those that the update now ready is the first to contain. A lone core verifies a submap's pairs while
/// it waits for the next update.
void ServerMeter::note_update(const UpdateTiming& update) {
  updates_.push_back(update);
  map_cpu_s_ += 1e-3 * update.cpu_ms;
  for (const Unanswered& submap : unanswered_)
    update_latency_ms_.push_back(1e3 * std::max(update.time_s - submap.arrived_s, submap.verification_cpu_s) +
                                 update.took_ms);
  unanswered_.clear();
  of_job_.clear();
}

void ServerMeter::record(double mission_s, TimingRecord& timing) const {
  timing.server_verification_ms = verifier_->took_ms();
  timing.server_updates = updates_;
  if (refiner_) timing.server_refinements = refiner_->took();
  timing.server_load = {.mission_s = mission_s,
                        .map_cpu_s = map_cpu_s_,
                        .verification_cpu_s = verifier_->cpu_s(),
                        .update_latency_ms = update_latency_ms_,
                        .peak_memory_mb = peak_memory_mb(),
                        .refinement_cpu_s = refinement_cpu_s()};
}

}  // namespace tutti::mission
