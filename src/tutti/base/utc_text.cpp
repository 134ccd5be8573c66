// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/utc_text.hpp"

#include <ctime>

namespace tutti {

std::string utc_text(std::int64_t wall_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::time_t seconds = wall_ns / kSecond_ns;
  std::tm utc{};
  char text[32] = "?";
  if (gmtime_r(&seconds, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc);
  return text;
}

}  // namespace tutti
