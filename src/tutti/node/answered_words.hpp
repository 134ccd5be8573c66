// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// The last words of operators that the server has answered, as everybody is told who looks.
class AnsweredWords {
 public:
  /// `frame`: the message as it came; `why` it does not hold, or empty.
  void note(const std::string& frame, const std::string& why);
  [[nodiscard]] const std::vector<MissionStatus::Word>& all() const { return words_; }

 private:
  std::vector<MissionStatus::Word> words_;
};

}  // namespace tutti::node
