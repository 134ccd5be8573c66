// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/bus/nats_port.hpp"
#include "tutti/program/event_log.hpp"

namespace tutti::program {

/// What a program says of its link to the bus, as that changes: that there is none, or none any more; that the bus
/// stores nothing, as one does whose disk is full; that it had lost its streams.
class LinkWatch {
 public:
  static constexpr double kPatience_s = 5.0;  ///< Without a link.
  static constexpr double kStores_s = 25.0;   ///< Longer than a port waits for one confirmation.

  struct Said {
    Level level = Level::info;
    std::string sentence;
  };
  /// To be called about once a second.
  std::vector<Said> look(const bus::NatsState& state, double wall_s);
  /// What is wrong now; empty: nothing.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  std::optional<double> gone_since_s_;
  bool was_there_ = false;
  bool said_gone_ = false;
  bool said_full_ = false;
  std::uint64_t made_anew_ = 0;
  std::string trouble_;
};

}  // namespace tutti::program
