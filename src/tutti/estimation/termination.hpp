// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace tutti::estimation {

/// How an optimisation ended. A summary that was never filled is `not_run`.
enum class Termination {
  not_run,
  converged,
  max_iterations,  ///< Stopped while still improving; the estimate is usable.
  stalled,         ///< No step along the Gauss-Newton direction lowers the cost any more; the estimate is usable.
  singular,        ///< The measurements do not determine every pose; the poses are those before the failing step.
  invalid_input,   ///< NaN or infinity in poses, measurements or information; the poses are the given ones.
};

constexpr std::string_view to_string(Termination t) {
  switch (t) {
    case Termination::not_run:
      return "not_run";
    case Termination::converged:
      return "converged";
    case Termination::max_iterations:
      return "max_iterations";
    case Termination::stalled:
      return "stalled";
    case Termination::singular:
      return "singular";
    case Termination::invalid_input:
      return "invalid_input";
  }
  return "";
}

/// True when the returned poses are an optimum or on the way to one.
constexpr bool is_usable(Termination t) {
  return t == Termination::converged || t == Termination::max_iterations || t == Termination::stalled;
}

}  // namespace tutti::estimation
