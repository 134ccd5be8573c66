// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tutti/drive/stopwatch.hpp"
#include "tutti/mission/timing_record.hpp"
#include "tutti/node/step.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::mission {

/// Wraps a verifier and measures how long it takes for each pair.
class MeasuredVerifier final : public server::WrappedVerifier {
 public:
  explicit MeasuredVerifier(std::shared_ptr<const server::ClosureVerifier> verifier)
      : WrappedVerifier(std::move(verifier)) {}
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;

  /// Not to be called while it verifies.
  [[nodiscard]] const std::vector<double>& took_ms() const { return took_ms_; }
  [[nodiscard]] double cpu_s() const { return cpu_s_; }

 private:
  mutable std::mutex mutex_;  // guards what follows
  mutable std::vector<double> took_ms_;
  mutable double cpu_s_ = 0.0;
};

/// Wraps a refiner and measures how long it takes for each job.
class MeasuredRefiner final : public server::MapRefiner {
 public:
  explicit MeasuredRefiner(std::shared_ptr<const server::MapRefiner> refiner) : refiner_(std::move(refiner)) {}
  [[nodiscard]] MethodId id() const override { return refiner_->id(); }
  [[nodiscard]] std::string settings() const override { return refiner_->settings(); }
  [[nodiscard]] bool can_refine(const PayloadSize& size) const override { return refiner_->can_refine(size); }
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job, const server::SubmapSet& submaps,
                                          const server::PayloadStore& payloads) const override;

  /// Not to be called while it refines.
  [[nodiscard]] const std::vector<RefinementTiming>& took() const { return took_; }

 private:
  std::shared_ptr<const server::MapRefiner> refiner_;
  mutable std::vector<RefinementTiming> took_;  // one job at a time
};

/// Measures how much time server and workers take on this machine. It is separate from the nodes, because these know no
/// clock.
class ServerMeter {
 public:
  /// `refiner` may be null.
  explicit ServerMeter(std::shared_ptr<const server::ClosureVerifier> verifier,
                       std::shared_ptr<const server::MapRefiner> refiner = nullptr)
      : verifier_(std::make_shared<MeasuredVerifier>(std::move(verifier))),
        refiner_(refiner ? std::make_shared<MeasuredRefiner>(std::move(refiner)) : nullptr) {}
  /// To be given to server and workers.
  [[nodiscard]] std::shared_ptr<const server::ClosureVerifier> verifier() const { return verifier_; }
  [[nodiscard]] std::shared_ptr<const server::MapRefiner> refiner() const { return refiner_; }

  /// Calls `step` of the server, which may store a submap, and returns its result.
  template <class F>
  node::Step serve(double time_s, F&& step) {
    const drive::CpuScope cpu(map_cpu_s_);
    node::Step made = step();
    note_submap(time_s, made);
    return made;
  }
  /// Calls `step` of the server, which updates the map, and returns its result.
  template <class F>
  node::Step update(double time_s, F&& step) {
    double cpu_s = 0.0;
    drive::Stopwatch watch;
    node::Step made = [&] {
      const drive::CpuScope cpu(cpu_s);
      return step();
    }();
    note_update({time_s, watch.lap_ms(), 1e3 * cpu_s});
    return made;
  }
  /// Calls `step` of a worker for this job, and returns its result.
  template <class F>
  node::Step verify(const std::string& job, F&& step) {
    const double before_s = verifier_->cpu_s();
    node::Step made = step();
    note_job(job, verifier_->cpu_s() - before_s);
    return made;
  }

  /// CPU time of everything measured so far.
  [[nodiscard]] double cpu_s() const { return map_cpu_s_ + verifier_->cpu_s() + refinement_cpu_s(); }
  /// Writes the figures of a mission that lasted `mission_s` into `timing`.
  void record(double mission_s, TimingRecord& timing) const;

 private:
  struct Unanswered {
    double arrived_s = 0.0;
    double verification_cpu_s = 0.0;
  };
  [[nodiscard]] double refinement_cpu_s() const;
  void note_submap(double time_s, const node::Step& step);
  void note_job(const std::string& job, double cpu_s);
  void note_update(const UpdateTiming& update);

  std::shared_ptr<MeasuredVerifier> verifier_;
  std::shared_ptr<MeasuredRefiner> refiner_;
  double map_cpu_s_ = 0.0;
  std::vector<Unanswered> unanswered_;         // submaps that no broadcast contains yet
  std::map<std::string, std::size_t> of_job_;  // which of these the job verifies
  std::vector<UpdateTiming> updates_;
  std::vector<double> update_latency_ms_;
};

}  // namespace tutti::mission
