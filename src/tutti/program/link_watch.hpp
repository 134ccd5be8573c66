// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/bus/port.hpp"
#include "tutti/model/status.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::program {

/// Reports changes of a program's link to the bus: there is no link, or none any more; the bus stores nothing, as when
/// its disk is full; it does not allow something; it had lost its streams; it gives jobs to workers in vain; a worker
/// speaks of others' jobs.
class LinkWatch {
 public:
  static constexpr double kPatience_s = 5.0;  ///< A missing link is reported after this time.
  static constexpr double kStores_s = 25.0;   ///< Longer than a port waits for one confirmation.
  static constexpr double kStrange_s = 60.0;  ///< A worker that speaks of others' jobs is trouble for so long.

  struct Line {
    Level level = Level::info;
    std::string sentence;
  };
  /// The sentences to report now. To be called about once a second.
  std::vector<Line> check(const bus::LinkState& state, double wall_s);
  /// The present trouble; empty when there is none.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  std::optional<double> gone_since_s_;
  bool was_there_ = false;
  bool said_gone_ = false;
  bool reported_full_ = false;
  bool reported_in_vain_ = false;
  std::uint64_t strange_settlements_ = 0;
  std::optional<double> strange_s_;  ///< When the last of these came.
  std::string reported_denied_;
  std::uint64_t made_anew_ = 0;
  std::string trouble_;
};

/// Jobs wait, workers are heard, and none has taken one for kUntaken_s, which nothing else notices: such a worker says
/// that it is well. In a sentence with what to do; empty: that is not so.
std::string untaken_trouble(const bus::LinkState& state, const MissionStatus& status);
inline constexpr double kUntaken_s = 30.0;

/// Decides when a worker's port is to connect anew: the bus gives jobs to workers and gets no answers
/// (LinkState::given_in_vain), and this worker has none. So they are given to an old request, or over a connection that
/// the bus takes for a good one.
class AnewWatch {
 public:
  static constexpr double kAgain_s = 60.0;  ///< Not more often than this.
  /// True: connect anew now. To be called about once a second.
  bool connects_anew(bool is_in_vain, bool holds_job, double wall_s);

 private:
  std::optional<double> last_s_;
};

}  // namespace tutti::program
