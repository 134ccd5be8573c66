// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/chi_square.hpp"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

#include "tutti/base/check.hpp"

namespace tutti {
namespace {

double exceeded(double value, double degrees) { return Eigen::numext::igammac(0.5 * degrees, 0.5 * value); }

/// The value up to which a condition is true, which is false above it.
template <class IsBelow>
double bisect(double degrees, IsBelow is_below) {
  double low = 0.0;
  double high = degrees + 10.0;
  while (is_below(high)) high *= 2.0;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return high;
    (is_below(middle) ? low : high) = middle;
  }
}

}  // namespace

double chi_square_probability(double value, double degrees) {
  TUTTI_CHECK(degrees > 0.0, "{} degrees of freedom", degrees);
  return value <= 0.0 ? 0.0 : Eigen::numext::igamma(0.5 * degrees, 0.5 * value);
}

double chi_square_quantile(double probability, double degrees) {
  TUTTI_CHECK(probability >= 0.0 && probability < 1.0 && degrees > 0.0, "probability {}, {} degrees of freedom",
              probability, degrees);
  return bisect(degrees, [&](double x) { return chi_square_probability(x, degrees) < probability; });
}

double chi_square_exceeded_with(double probability, double degrees) {
  TUTTI_CHECK(probability > 0.0 && probability < 1.0 && degrees > 0.0, "probability {}, {} degrees of freedom",
              probability, degrees);
  return bisect(degrees, [&](double x) { return exceeded(x, degrees) > probability; });
}

}  // namespace tutti
