// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/check.hpp"

#include <stdexcept>

namespace tutti::internal {

void check_failed(const char* condition, const char* file, int line, const std::string& message) {
  throw std::logic_error(fmt::format("{}:{}: check failed: {} {}", file, line, condition, message));
}

}  // namespace tutti::internal
