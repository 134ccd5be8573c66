// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <type_traits>

namespace tutti::app {

/// Accepts finite numbers above zero (or also zero). CLI11's own PositiveNumber and NonNegativeNumber accept NaN.
inline CLI::Validator finite(bool zero_too) {
  return {[zero_too](const std::string& input) {
            double value = 0.0;
            const bool is_finite = CLI::detail::lexical_cast(input, value) && std::isfinite(value);
            if (is_finite && (value > 0.0 || (zero_too && value == 0.0))) return std::string();
            return fmt::format("is '{}', expected a finite number {} 0", input, zero_too ? ">=" : ">");
          },
          ""};
}

/// Accepts numbers from `low` to `high`. CLI11's own Range accepts NaN.
inline CLI::Validator within(double low, double high) {
  return {[low, high](const std::string& input) {
            double value = 0.0;
            if (CLI::detail::lexical_cast(input, value) && value >= low && value <= high) return std::string();
            return fmt::format("is '{}', expected a number from {:g} to {:g}", input, low, high);
          },
          ""};
}

/// Accepts whole numbers of 64 bits. CLI11 takes -1, and numbers that are too large, for the largest one.
inline CLI::Validator whole_number() {
  return {[](const std::string& input) {
            std::uint64_t value = 0;
            const char* end = input.data() + input.size();
            const auto [last, error] = std::from_chars(input.data(), end, value);
            if (error == std::errc{} && last == end) return std::string();
            return fmt::format("is '{}', expected a whole number from 0 to 2^64 - 1", input);
          },
          ""};
}

/// Adds an option that takes a number, and shows its default if it has one.
template <class Number>
CLI::Option* add_number(CLI::App& command, const std::string& name, Number& value, const std::string& help,
                        const std::string& unit, const CLI::Validator& check = finite(false)) {
  CLI::Option* option = command.add_option(name, value, help)->check(check)->type_name(unit);
  if constexpr (std::is_arithmetic_v<Number>) option->capture_default_str();
  return option;
}

/// Prints on stderr why a command failed; returns the exit code.
inline int complain(const char* command, const std::string& message, int exit_code = 1) {
  fmt::print(stderr, "tutti {}: {}\n", command, message);
  return exit_code;
}

}  // namespace tutti::app
