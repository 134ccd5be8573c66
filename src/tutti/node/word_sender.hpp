// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tutti/bus/envelope.hpp"
#include "tutti/model/closure_word.hpp"
#include "tutti/model/status.hpp"

namespace tutti::node {

/// Says an operator's word to the server until it answers: the bus may lose what it had taken, with a stream that had
/// to be made anew. What comes twice the server takes for one.
class WordSender {
 public:
  static constexpr double kAgain_s = 5.0;

  WordSender(bus::Endpoint self, const ClosureWord& word);
  /// What is to be sent at this time, in seconds of any clock, if anything: at once, and every kAgain_s. Each has an id
  /// of its own: a bus that has had one does not pass it on again.
  std::optional<bus::Envelope> due(double now_s);
  /// Why the word is not stored; empty: it is. Nothing: the server has not answered it.
  [[nodiscard]] std::optional<std::string> answer(const MissionStatus& status) const;

 private:
  bus::Endpoint self_;
  std::string id_;
  std::shared_ptr<const std::string> bytes_;
  std::uint64_t content_;
  unsigned sent_ = 0;
  double next_s_ = 0.0;
};

}  // namespace tutti::node
