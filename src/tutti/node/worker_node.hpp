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
#include "tutti/node/later_answers.hpp"
#include "tutti/node/step.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::node {

/// Verifies loop closures and refines maps for the server, with the verifier or refiner that the job names: the
/// worker's own, or one made from the job's settings. A job that it cannot do, also because the job or a submap of it
/// is of a version that this program cannot read, goes back to the server, and the worker then pauses so that other
/// workers get the job. It keeps nothing between jobs that it could not get again, except closures that become known
/// later (LaterAnswers): a worker that ends forgets those of pairs that it has begun to answer. A worker that lacks
/// submaps of a job asks the server for them, and keeps the job until they are there.
class WorkerNode {
 public:
  /// Calls its argument with 0 ... count - 1, in any order and possibly on several threads, and returns after the last
  /// call.
  using ForEach = std::function<void(std::size_t count, const std::function<void(std::size_t)>&)>;
  static void one_by_one(std::size_t count, const std::function<void(std::size_t)>& call);

  /// How many submaps are asked for at a time, after how long again, and after how long without any the job is answered
  /// without them.
  static constexpr std::size_t kMostAsked = 16;
  static constexpr double kAskAgain_s = 2.0;
  static constexpr double kPatience_s = 60.0;
  static constexpr double kRest_s = 10.0;  ///< Pause after a job that the worker cannot do.

  /// A worker that has all submaps.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureVerifier> verifier,
             std::shared_ptr<const SubmapFrames> submaps, ForEach for_each = one_by_one);
  /// A worker that has the submaps in `cache`, and asks the server for others.
  WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureVerifier> verifier,
             std::shared_ptr<FrameCache> cache, ForEach for_each = one_by_one);

  /// Sets the clock (nanoseconds since the Unix epoch) for the evidence of closures; without it there is no evidence.
  void set_clock(std::function<std::int64_t()> clock) { clock_ = std::move(clock); }
  /// Sets the worker's own refiner.
  void refine_with(std::shared_ptr<const server::MapRefiner> refiner) { refiner_ = std::move(refiner); }
  /// Sets what makes verifiers and refiners that are not the worker's own; without it the worker has only its own.
  void make_others_with(std::shared_ptr<const server::VerifierMaker> maker) { maker_ = std::move(maker); }
  /// Sets the pause after a job that the worker cannot do. 0 is for the server's own worker, as nobody else waits for
  /// its jobs.
  void rest_for(double seconds) { rest_s_ = seconds; }
  /// The worker's verifiers and refiners, for its status.
  [[nodiscard]] std::vector<MethodId> can() const;
  /// Takes a job, only when holds_job() is false, or a submap that was asked for. The same job gives the same verdicts.
  Step receive(const bus::Envelope& envelope, Timestamp now);
  /// True while no further job may come: the last job is not answered, or the worker pauses.
  [[nodiscard]] bool holds_job() const { return pending_.has_value() || rests_until_.has_value(); }
  /// When on_timer() is to be called next; nothing while no job is pending and no closure is to become known.
  [[nodiscard]] std::optional<Timestamp> next_timer() const;
  Step on_timer(Timestamp now);

 private:
  using AnyJob = std::variant<Job, RefinementJob>;
  struct PendingJob {
    AnyJob job;
    std::set<SubmapId> missing;
    std::map<SubmapId, Timestamp> asked;
    Timestamp last_came;  ///< When the job, or any of its submaps, came last.
  };

  static Result<AnyJob> decode(const bus::Envelope& envelope);
  void receive_job(const bus::Envelope& envelope, Timestamp now, Step& step);
  void receive_copy(const bus::Envelope& envelope, Timestamp now, Step& step);
  /// Answers a job of a version that this program cannot read: nothing but its id is known.
  void decline_unread(const bus::Envelope& envelope, const std::string& why, Step& step) const;
  void ask(Timestamp now, Step& step);
  /// Sets the verifier (refiner) that the job asks for.
  Status prepare(const Job& job);
  Status prepare(const RefinementJob& job);
  /// Answers that nothing of the job was done; `cannot`: because this worker lacks what the job asks for.
  void decline(const Job& job, const std::string& why, bool cannot, Step& step) const;
  void decline(const RefinementJob& job, const std::string& why, bool cannot, Step& step) const;
  void answer(const Job& job, Timestamp now, Step& step);
  [[nodiscard]] std::vector<Timestamp> known_at(const ClosureVerdict& verdict, Timestamp now);
  void send_due(Timestamp now, Step& step);
  void answer(const RefinementJob& job, Timestamp now, Step& step);
  void answer(const AnyJob& job, Timestamp now, Step& step);
  [[nodiscard]] Result<ClosureVerdict> verify(const SubmapPair& pair) const;
  [[nodiscard]] Result<ClosureVerdict> verify_or_throw(const SubmapPair& pair) const;
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job) const;
  [[nodiscard]] Result<Refinement> refine_or_throw(const RefinementJob& job) const;
  void send(bus::MessageKind kind, const std::string& job, std::string bytes, Step& step) const;

  bus::Endpoint self_;
  std::shared_ptr<const server::ClosureVerifier> verifier_;  // its own verifier
  std::shared_ptr<FrameCache> cache_;                        // null: all submaps are there
  std::shared_ptr<const SubmapFrames> submaps_;
  ForEach for_each_;
  std::function<std::int64_t()> clock_;
  std::shared_ptr<const server::MapRefiner> refiner_;  // its own; null: none
  std::shared_ptr<const server::VerifierMaker> maker_;
  std::shared_ptr<const server::ClosureVerifier> asked_verifier_;  // of the last job; likewise the refiner
  std::shared_ptr<const server::MapRefiner> asked_refiner_;
  std::optional<PendingJob> pending_;
  double rest_s_ = kRest_s;
  std::optional<Timestamp> rests_until_;
  LaterAnswers later_;
};

}  // namespace tutti::node
