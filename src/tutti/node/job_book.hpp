// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/refinement.hpp"

namespace tutti::node {

/// The jobs that a server has given to its workers and that have no answer yet. A job is asked again when no answer has
/// come for so long, every time after twice as long, because without workers the bus fills slowly. A job that waits
/// behind others begins to count when the last of those was answered: a long queue is no reason to ask again.
class JobBook {
 public:
  struct OpenJob {
    std::vector<SubmapPair> pairs;
    std::shared_ptr<const RefinementJob> refinement;  ///< Or this, instead of pairs.
    Timestamp since;                                  ///< It was sent, or had its turn at the earliest.
    unsigned asked = 0;                               ///< Before.
  };

  /// `prefix`: what the names of all jobs begin with; no other start of any map has the same, for a bus takes one job
  /// of a name. `timeout_s`: 0: jobs are never asked again.
  JobBook(std::string prefix, double timeout_s) : prefix_(std::move(prefix)), timeout_s_(timeout_s) {}

  /// That open() will give.
  [[nodiscard]] std::string next_name() const;
  void open(OpenJob job) { open_.emplace(given_++, std::move(job)); }
  /// It is answered, and need not be asked again. Nothing: it is not open, or of an earlier start.
  std::optional<OpenJob> close(std::string_view name, Timestamp now);
  /// Those that are to be asked again now; they are open no more.
  std::vector<OpenJob> take_late(Timestamp now);
  /// When take_late() is to be called next.
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  [[nodiscard]] std::size_t size() const { return open_.size(); }

 private:
  [[nodiscard]] Timestamp due(const OpenJob& job) const;

  std::string prefix_;
  double timeout_s_;
  std::uint64_t given_ = 0;
  std::map<std::uint64_t, OpenJob> open_;  // by number
};

/// Pairs of submaps that no worker could verify when it was asked.
class FailedPairs {
 public:
  enum class Next { nothing, ask_now, ask_later, give_up };

  /// A pair is given up after `most_tries`. The second try comes after a tenth of the time for an answer, every further
  /// one after twice as long; without such a time at once.
  FailedPairs(double timeout_s, unsigned most_tries) : timeout_s_(timeout_s), most_tries_(most_tries) {}

  /// What is to be done about a pair that has failed. Nothing: that is known, the answer has come twice. A pair that is
  /// given up is forgotten.
  Next note(const SubmapPair& pair, Timestamp now);
  /// It has been verified after all.
  void forget(const SubmapPair& pair) { failed_.erase(pair); }
  /// Those that are to be asked again now.
  std::vector<SubmapPair> take_due(Timestamp now);
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  /// How many are to be asked again later.
  [[nodiscard]] std::size_t waiting() const;

 private:
  struct Failed {
    unsigned times = 0;
    std::optional<Timestamp> again;  // when it is to be asked; nothing: it is being asked
  };
  double timeout_s_;
  unsigned most_tries_;
  std::map<SubmapPair, Failed> failed_;
};

/// How long after the so-manieth failure the next try comes, s. `timeout_s`: the time for an answer.
double try_again_after_s(double timeout_s, unsigned failures);

}  // namespace tutti::node
