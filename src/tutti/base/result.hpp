// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/core.h>

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace tutti {

/// The kind of a failure of the outside world.
enum class ErrorCode {
  io,           ///< A file could not be opened, read or written.
  parse,        ///< Text or bytes do not follow their format.
  invalid,      ///< Well formed, but a value is out of its range (NaN, non-unit quaternion, stamps going backwards...).
  unsupported,  ///< Well formed, but of a variant or protocol version that this program does not read.
  unknown_robot,  ///< A message names a robot that is not part of the mission.
  configuration,  ///< A setting is unknown or out of range.
};

/// Failure of the outside world. The message has what, where, the value, and what was expected.
struct Error {
  ErrorCode code = ErrorCode::invalid;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;
using Status = Result<void>;

/// `return fail(ErrorCode::parse, "{}:{}: expected 8 columns, got {}", file, line, n);`
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
  return tl::unexpected<Error>(Error{code, fmt::format(format, std::forward<Args>(args)...)});
}

/// Passes an error on, saying where it happened: `return in_context(path, result.error());`
[[nodiscard]] inline tl::unexpected<Error> in_context(const std::string& where, const Error& error) {
  return tl::unexpected<Error>(Error{error.code, where + ": " + error.message});
}

}  // namespace tutti
