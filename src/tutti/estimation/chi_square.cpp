// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/chi_square.hpp"

#include <cmath>

#include "tutti/base/check.hpp"

namespace tutti::estimation {

double chi_square_6_probability(double value) {
  if (value <= 0.0) return 0.0;
  const double h = 0.5 * value;
  return 1.0 - std::exp(-h) * (1.0 + h + 0.5 * h * h);  // Poisson tail: even degrees of freedom have a closed form
}

double chi_square_6_quantile(double probability) {
  TUTTI_CHECK(probability >= 0.0 && probability < 1.0, "probability = {}", probability);
  double low = 0.0;
  double high = 16.0;
  while (chi_square_6_probability(high) < probability) high *= 2.0;
  while (true) {  // bisection to the last bit
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return high;
    (chi_square_6_probability(middle) < probability ? low : high) = middle;
  }
}

}  // namespace tutti::estimation
