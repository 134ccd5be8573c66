// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti {

/// P(x <= value) of the chi-square distribution with `degrees` > 0 degrees of freedom, which need not be whole.
double chi_square_probability(double value, double degrees);

/// x with P(chi^2 <= x) = probability, probability in [0, 1). A residual of a relative pose has 6 degrees of freedom.
double chi_square_quantile(double probability, double degrees);

/// x with P(chi^2 > x) = probability, probability in (0, 1). This is chi_square_quantile(1 - probability), whose
/// argument would round a small probability away.
double chi_square_exceeded_with(double probability, double degrees);

}  // namespace tutti
