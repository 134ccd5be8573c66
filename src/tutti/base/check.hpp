// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace tutti::internal {

[[noreturn]] inline void check_failed(const char* condition, const char* file, int line, const std::string& message) {
  throw std::logic_error(fmt::format("{}:{}: check failed: {} {}", file, line, condition, message));
}

}  // namespace tutti::internal

/// Broken precondition = our own bug: throws std::logic_error with file and line. Usage: TUTTI_CHECK(n > 0, "n = {}",
/// n).
#define TUTTI_CHECK(condition, ...)                                                                 \
  do {                                                                                              \
    if (!(condition)) [[unlikely]]                                                                  \
      ::tutti::internal::check_failed(#condition, __FILE__, __LINE__, fmt::format("" __VA_ARGS__)); \
  } while (false)
