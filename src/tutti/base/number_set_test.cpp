// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/number_set.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

namespace tutti {
namespace number_set_test {

RC_GTEST_PROP(NumberSet, IsASetInAsFewIntervalsAsThereAre, ()) {
  NumberSet set;
  std::set<std::uint64_t> model;
  for (const int number : *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 40))) {
    set.insert(static_cast<std::uint64_t>(number));
    model.insert(static_cast<std::uint64_t>(number));
  }
  std::size_t begins = 0;
  for (std::uint64_t number = 0; number < 42; ++number) {
    RC_ASSERT(set.contains(number) == model.contains(number));
    if (model.contains(number) && !model.contains(number - 1)) ++begins;
  }
  RC_ASSERT(set.intervals().size() == begins);
  std::uint64_t first_missing = 0;
  while (model.contains(first_missing)) ++first_missing;
  RC_ASSERT(set.watermark() == first_missing);
  NumberSet again;
  for (const NumberSet::Interval& interval : set.intervals()) {
    RC_ASSERT(again.append(interval));
    RC_ASSERT(!again.append(interval));
    RC_ASSERT(!again.append({interval.end, interval.end + 1}));  // touches
  }
  RC_ASSERT(again == set);
}

}  // namespace number_set_test
}  // namespace tutti
