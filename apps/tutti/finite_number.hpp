// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace tutti::app {

/// CLI11's own PositiveNumber and NonNegativeNumber let NaN through.
inline CLI::Validator finite(bool zero_too) {
  return {[zero_too](const std::string& input) {
            double value = 0.0;
            const bool is_finite = CLI::detail::lexical_cast(input, value) && std::isfinite(value);
            if (is_finite && (value > 0.0 || (zero_too && value == 0.0))) return std::string();
            return fmt::format("is '{}', expected a finite number {} 0", input, zero_too ? ">=" : ">");
          },
          ""};
}

}  // namespace tutti::app
