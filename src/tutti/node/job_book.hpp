// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/refinement.hpp"

namespace tutti::node {

/// The jobs that a server has given to its workers and that are not answered. A job without an answer is asked again
/// after a timeout, which doubles every time, because without workers the bus would fill up. A job's time begins when
/// the last job before it was answered, so a long queue causes no repetitions.
class JobBook {
 public:
  struct OpenJob {
    std::vector<SubmapPair> pairs;                    ///< In order.
    std::shared_ptr<const RefinementJob> refinement;  ///< A refinement instead of pairs.
    Timestamp since;     ///< When it was sent, or when the last job before it was answered.
    unsigned asked = 0;  ///< How often it was asked before.
    /// Its pairs were asked again under another name; an answer is still welcome.
    bool is_replaced = false;
    [[nodiscard]] bool has(const SubmapPair& pair) const { return std::ranges::binary_search(pairs, pair); }
  };

  /// `prefix` begins the names of all jobs. It must be unique to this start of this map, because a bus accepts a name
  /// once. With `timeout_s` = 0 jobs are never asked again.
  JobBook(std::string prefix, double timeout_s) : prefix_(std::move(prefix)), timeout_s_(timeout_s) {}

  /// The name that the next open() gives.
  [[nodiscard]] std::string next_name() const;
  /// Adds a job that is being sent under next_name().
  void open(OpenJob job);
  /// Removes the job of this name, which is answered, and returns it. Nothing when it is not open, or of an earlier
  /// start.
  std::optional<OpenJob> close(std::string_view name, Timestamp now);
  /// Returns the jobs that are to be asked again now, under other names. Answers to these stay welcome.
  std::vector<OpenJob> take_late(Timestamp now);
  /// When take_late() has something to return; nothing when never.
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  /// How many jobs wait for an answer; those that were asked again count once.
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(
        std::ranges::count(open_, false, [](const auto& job) { return job.second.is_replaced; }));
  }

  /// True if an open job needs this submap. Workers ask it of every submap of every job, so it is looked up.
  [[nodiscard]] bool needs(SubmapId submap) const { return needed_.contains(submap); }
  /// The job of this name, which stays open; nothing likewise.
  [[nodiscard]] std::optional<OpenJob> find(std::string_view name) const;
  /// True if this book has given the name, whether or not the job is open.
  [[nodiscard]] bool has_given(std::string_view name) const { return number_of(name).has_value(); }

 private:
  [[nodiscard]] std::optional<std::uint64_t> number_of(std::string_view name) const;
  [[nodiscard]] Timestamp due(const OpenJob& job) const;
  /// The submaps that a job needs, each once.
  static std::set<SubmapId> submaps_of(const OpenJob& job);

  std::string prefix_;
  double timeout_s_;
  std::uint64_t given_ = 0;
  std::map<std::uint64_t, OpenJob> open_;             // by number
  std::unordered_map<SubmapId, std::size_t> needed_;  // by how many open jobs
};

/// The pairs of submaps that no worker could verify when they were asked, with the time of the next try.
class FailedPairs {
 public:
  enum class Next { nothing, ask_now, ask_later, give_up };

  /// A pair is given up after `most_tries` tries. The second try comes after a tenth of `timeout_s`, the time for an
  /// answer; each further one after twice as long. With `timeout_s` = 0 it comes at once.
  FailedPairs(double timeout_s, unsigned most_tries) : timeout_s_(timeout_s), most_tries_(most_tries) {}

  /// Notes that a pair has failed, and decides what to do. `nothing` means that the failure was known, because an
  /// answer has come twice. A pair that is given up is forgotten.
  Next note(const SubmapPair& pair, Timestamp now);
  /// The pair has been verified after all.
  void forget(const SubmapPair& pair) { failed_.erase(pair); }
  /// Returns the pairs that are to be asked again now.
  std::vector<SubmapPair> take_due(Timestamp now);
  [[nodiscard]] std::optional<Timestamp> next_due() const;
  /// How many pairs wait for their next try.
  [[nodiscard]] std::size_t waiting() const;

 private:
  struct Failed {
    unsigned times = 0;
    std::optional<Timestamp> again;  // when to ask again; nothing while it is being asked
  };
  double timeout_s_;
  unsigned most_tries_;
  std::map<SubmapPair, Failed> failed_;
};

/// Seconds from the `failures`-th failure (counted from 1) to the next try; `timeout_s` is the time for an answer.
double try_again_after_s(double timeout_s, unsigned failures);

}  // namespace tutti::node
