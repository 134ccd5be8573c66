// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/timestamp.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

namespace tutti {

double typical_gap_s(std::span<const Timestamp> stamps) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) gaps.push_back(stamps[i] - stamps[i - 1]);
  if (gaps.empty()) return 0.0;
  const auto middle = gaps.begin() + std::ssize(gaps) / 2;
  std::ranges::nth_element(gaps, middle);
  return *middle;
}

}  // namespace tutti
