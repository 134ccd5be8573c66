// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace tutti::judge {

/// While one lives, this thread's searches for what is wrong ask it between decisions whether to go on. Once it says
/// no, no other decision is tried, and the map is made with those that are there. It is no argument, because from
/// server::judge_graph() to the searches it would go through every function of a map that is not to be stopped.
class Patience {
 public:
  explicit Patience(std::function<bool()> stop);
  ~Patience();
  Patience(const Patience&) = delete;
  Patience& operator=(const Patience&) = delete;

 private:
  std::function<bool()> stop_;
};

/// True when this thread's Patience says so; false without one.
bool is_out_of_patience();

}  // namespace tutti::judge
