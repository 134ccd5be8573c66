// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// The operators' words that the server answered last, as MissionStatus::words tells them.
class AnsweredWords {
 public:
  /// Notes the answer to a word: `frame` is the message as it came, `why` says why the word is not stored (empty: it
  /// is).
  void note(const std::string& frame, const std::string& why);
  [[nodiscard]] const std::vector<MissionStatus::Word>& all() const { return words_; }

 private:
  std::vector<MissionStatus::Word> words_;
};

}  // namespace tutti::node
