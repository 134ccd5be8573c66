// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/node/event.hpp"

namespace tutti::mission {

/// Counts what went wrong with a robot, by the events that it reported.
class Troubles {
 public:
  struct Trouble {
    std::size_t count = 0;
    std::string first;  ///< Why it was first.
  };
  void note(const node::Event& event);
  /// `event` is the event's name in a program's log. One that is no trouble is passed over.
  void note(std::string_view event, const std::string& why, std::size_t count = 1);
  [[nodiscard]] Trouble of(std::string_view event) const;
  /// One line for each kind of event that there was.
  [[nodiscard]] std::vector<std::string> lines(const std::string& robot) const;

 private:
  std::map<std::string, Trouble, std::less<>> seen_;
};

}  // namespace tutti::mission
