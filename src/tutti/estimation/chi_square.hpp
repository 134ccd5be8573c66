// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti::estimation {

/// P(x <= value) of the chi-square distribution with 6 degrees of freedom (one SE(3) residual).
double chi_square_6_probability(double value);
/// Its inverse, probability in [0, 1).
double chi_square_6_quantile(double probability);

}  // namespace tutti::estimation
