// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "tutti/node/frame_cache.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/closure_finder.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::node {

/// Verifies loop closures and refines maps for the server, with the finder or refiner that a job names: its own, or one
/// that is made of the job's settings. A job for one that it cannot have goes back to the server; the next one is not
/// taken for some time, so that others get it. Remembers nothing between jobs that it could not get again. One that has
/// not all submaps at hand asks the server for those that a job names, and holds the job meanwhile.
class WorkerNode {
 public:
  /// Calls its argument with 0 ... count - 1, in any order, maybe on several threads, and returns when all have.
  using ForEach = std::function<void(std::size_t count, const std::function<void(std::size_t)>&)>;
  static void one_by_one(std::size_t count, const std::function<void(std::size_t)>& call);

  /// Submaps asked for at a time, after how long again, and how long without any until the job is answered without.
  static constexpr std::size_t kMostAsked = 16;
  static constexpr double kAskAgain_s = 2.0;
  static constexpr double kPatience_s = 60.0;
  static constexpr double kRest_s = 10.0;  ///< After a job that it cannot do.

  /// With every submap at hand.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder,
             std::shared_ptr<const SubmapFrames> submaps, ForEach for_each = one_by_one);
  /// With those that are in `cache`.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder, std::shared_ptr<FrameCache> cache,
             ForEach for_each = one_by_one);

  /// Tells the time, in nanoseconds since the Unix epoch, for the evidence of closures; without it they have none.
  void set_clock(std::function<std::int64_t()> clock) { clock_ = std::move(clock); }
  /// Its own refiner of maps.
  void refine_with(std::shared_ptr<const server::MapRefiner> refiner) { refiner_ = std::move(refiner); }
  /// Who makes finders and refiners that are not its own; without one it has none but these.
  void make_others_with(std::shared_ptr<const server::FinderMaker> maker) { maker_ = std::move(maker); }
  /// How long after a job that it cannot do; 0 for the server's own worker: what that cannot do nobody waits for.
  void rest_for(double seconds) { rest_s_ = seconds; }
  /// Its finders and refiners, for its status.
  [[nodiscard]] std::vector<MethodId> can() const;
  /// A job, and only when none is held; the same one twice gives the same verdicts. Or a submap that was asked for.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// The job that came last is not answered yet, or another one is not to come yet; or it never is answered: it, or a
  /// submap of it, is of a version that this program does not read. Such a one is to be left to another worker.
  [[nodiscard]] bool holds_job() const { return held_.has_value() || leaves_job_ || rests_until_.has_value(); }
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
  /// Whom the job asks for, from now on.
  Status prepare(const Job& job);
  Status prepare(const RefinementJob& job);
  void decline(const Job& job, const std::string& why, Step& step) const;
  void decline(const RefinementJob& job, const std::string& why, Step& step) const;
  void answer(const Job& job, Step& step) const;
  void answer(const RefinementJob& job, Step& step) const;
  void answer(const AnyJob& job, Step& step) const;
  [[nodiscard]] Result<ClosureVerdict> verify(const SubmapPair& pair) const;
  [[nodiscard]] Result<ClosureVerdict> verify_or_throw(const SubmapPair& pair) const;
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job) const;
  [[nodiscard]] Result<Refinement> refine_or_throw(const RefinementJob& job) const;
  void send(bus::MessageKind kind, const std::string& job, std::string bytes, Step& step) const;

  bus::Endpoint self_;
  std::shared_ptr<const server::ClosureFinder> finder_;  // its own
  std::shared_ptr<FrameCache> cache_;                    // null: nothing is missing
  std::shared_ptr<const SubmapFrames> submaps_;
  ForEach for_each_;
  std::function<std::int64_t()> clock_;
  std::shared_ptr<const server::MapRefiner> refiner_;  // its own; null: none
  std::shared_ptr<const server::FinderMaker> maker_;
  std::shared_ptr<const server::ClosureFinder> asked_finder_;  // that the last job asks for, and so the refiner
  std::shared_ptr<const server::MapRefiner> asked_refiner_;
  std::optional<Held> held_;
  double rest_s_ = kRest_s;
  std::optional<Timestamp> rests_until_;
  bool leaves_job_ = false;
};

}  // namespace tutti::node
