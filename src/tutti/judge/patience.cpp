// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/patience.hpp"

#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::judge {
namespace {

thread_local const std::function<bool()>* asked = nullptr;

}  // namespace

Patience::Patience(std::function<bool()> stop) : stop_(std::move(stop)) {
  TUTTI_CHECK(asked == nullptr, "one Patience in another");
  if (stop_) asked = &stop_;
}

Patience::~Patience() {
  if (asked == &stop_) asked = nullptr;
}

bool is_out_of_patience() { return asked != nullptr && (*asked)(); }

}  // namespace tutti::judge
