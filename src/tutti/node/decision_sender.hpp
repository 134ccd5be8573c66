// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tutti/bus/envelope.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/map_mark.hpp"
#include "tutti/model/status.hpp"

namespace tutti::node {

/// Sends an operator's decision or mark to the server until it answers, because a bus whose stream had to be made anew
/// loses what it had accepted. The server takes repetitions for one decision.
class DecisionSender {
 public:
  static constexpr double kAgain_s = 5.0;

  DecisionSender(bus::Endpoint self, const ClosureDecision& decision);
  DecisionSender(bus::Endpoint self, const MarkOrder& order);
  /// The message to be sent at this time, in seconds of any clock: at once, and then every kAgain_s. Each has an id of
  /// its own, because the bus does not pass on an id twice.
  std::optional<bus::Envelope> due(double now_s);
  /// The server's answer: why the decision is not stored, or empty when it is. Nothing while there is no answer.
  [[nodiscard]] std::optional<std::string> answer(const MissionStatus& status) const;

 private:
  DecisionSender(bus::Endpoint self, std::string id, std::string frame);

  bus::Endpoint self_;
  std::string id_;
  std::shared_ptr<const std::string> bytes_;
  std::uint64_t content_;
  unsigned sent_ = 0;
  double next_s_ = 0.0;
};

}  // namespace tutti::node
