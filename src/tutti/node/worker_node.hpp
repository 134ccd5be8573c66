// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <variant>

#include "tutti/node/frame_cache.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/closure_finder.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::node {

/// Verifies loop closures and refines maps for the server. Remembers nothing between jobs that it could not get again.
/// One that has not all submaps at hand asks the server for those that a job names, and holds the job meanwhile.
class WorkerNode {
 public:
  /// Calls its argument with 0 ... count - 1, in any order, maybe on several threads, and returns when all have.
  using ForEach = std::function<void(std::size_t count, const std::function<void(std::size_t)>&)>;
  static void one_by_one(std::size_t count, const std::function<void(std::size_t)>& call);

  /// Submaps asked for at a time, after how long again, and how long without any until the job is answered without.
  static constexpr std::size_t kMostAsked = 16;
  static constexpr double kAskAgain_s = 2.0;
  static constexpr double kPatience_s = 60.0;

  /// With every submap at hand.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder,
             std::shared_ptr<const SubmapFrames> submaps, ForEach for_each = one_by_one);
  /// With those that are in `cache`.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder, std::shared_ptr<FrameCache> cache,
             ForEach for_each = one_by_one);

  /// Tells the time, in nanoseconds since the Unix epoch, for the evidence of closures; without it they have none.
  void set_clock(std::function<std::int64_t()> clock) { clock_ = std::move(clock); }
  /// Who refines maps; without one such jobs are answered as failed.
  void refine_with(std::shared_ptr<const server::MapRefiner> refiner) { refiner_ = std::move(refiner); }
  /// A job, and only when none is held; the same one twice gives the same verdicts. Or a submap that was asked for.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// The job that came last is not answered yet, or never is: it, or a submap of it, is of a version that this program
  /// does not read. Such a one is to be left to another worker.
  [[nodiscard]] bool holds_job() const { return held_.has_value() || leaves_job_; }
  /// When on_timer() is to be called next; nothing while no job is held.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  Step on_timer(Timestamp now);

 private:
  using AnyJob = std::variant<Job, RefinementJob>;
  struct Held {
    AnyJob job;
    std::set<SubmapId> missing;
    std::map<SubmapId, Timestamp> asked;
    Timestamp last_came;  ///< Any of them, or the job.
  };

  static Result<AnyJob> decode(const bus::Envelope& envelope);
  void receive_job(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_copy(const bus::Envelope& envelope, Timestamp now, Step& step);
  void ask(Timestamp now, Step& step);
  void answer(const Job& job, Step& step) const;
  void answer(const RefinementJob& job, Step& step) const;
  void answer(const AnyJob& job, Step& step) const;
  [[nodiscard]] Result<ClosureVerdict> verify(const SubmapPair& pair) const;
  [[nodiscard]] Result<ClosureVerdict> verify_or_throw(const SubmapPair& pair) const;
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job) const;
  [[nodiscard]] Result<Refinement> refine_or_throw(const RefinementJob& job) const;

  bus::Endpoint self_;
  std::shared_ptr<const server::ClosureFinder> finder_;
  std::shared_ptr<FrameCache> cache_;  // null: nothing is missing
  std::shared_ptr<const SubmapFrames> submaps_;
  ForEach for_each_;
  std::function<std::int64_t()> clock_;
  std::shared_ptr<const server::MapRefiner> refiner_;
  std::optional<Held> held_;
  bool leaves_job_ = false;
};

}  // namespace tutti::node
