// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>

#include <string>

namespace tutti::internal {

[[noreturn]] void check_failed(const char* condition, const char* file, int line, const std::string& message);

}  // namespace tutti::internal

/// Guards a precondition whose violation is a bug of the program, not of its input: throws std::logic_error with
/// condition, file, line and message. Usage: TUTTI_CHECK(n > 0, "n = {}", n).
#define TUTTI_CHECK(condition, ...)                                                                 \
  do {                                                                                              \
    if (!(condition)) [[unlikely]]                                                                  \
      ::tutti::internal::check_failed(#condition, __FILE__, __LINE__, fmt::format("" __VA_ARGS__)); \
  } while (false)
