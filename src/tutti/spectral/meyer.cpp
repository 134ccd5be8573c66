// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/meyer.hpp"

#include <cmath>
#include <numbers>

#include "tutti/base/check.hpp"

namespace tutti::spectral {
namespace {

/// Smooth step: v(0) = 0, v(1) = 1, v(y) + v(1 - y) = 1, three continuous derivatives at both ends.
double smooth_step(double y) { return y * y * y * y * (35.0 + y * (-84.0 + y * (70.0 - 20.0 * y))); }

double rise(double y) { return std::sin(std::numbers::pi / 2.0 * smooth_step(y)); }
double fall(double y) { return std::cos(std::numbers::pi / 2.0 * smooth_step(y)); }

/// Meyer's scaling function in the frequency domain.
double phi(double z) {
  if (z < 2.0 / 3.0) return 1.0;
  if (z < 4.0 / 3.0) return fall(1.5 * z - 1.0);
  return 0.0;
}

/// Meyer's wavelet in the frequency domain.
double psi(double z) {
  if (z < 2.0 / 3.0) return 0.0;
  if (z < 4.0 / 3.0) return rise(1.5 * z - 1.0);
  if (z < 8.0 / 3.0) return fall(0.75 * z - 1.0);
  return 0.0;
}

}  // namespace

MeyerFilterBank::MeyerFilterBank(int scales, double lambda_max) : scales_(scales), lambda_max_(lambda_max) {
  TUTTI_CHECK(scales >= 1, "scales = {}", scales);
  TUTTI_CHECK(std::isfinite(lambda_max) && lambda_max >= 0.0, "lambda_max = {}", lambda_max);
}

double MeyerFilterBank::kernel(int scale, double lambda) const {
  TUTTI_CHECK(scale >= 0 && scale < scales_, "scale {} of {}", scale, scales_);
  if (scales_ == 1) return 1.0;
  if (lambda <= 0.0) return scale == 0 ? 1.0 : 0.0;
  const int band = scale == 0 ? 0 : scale - 1;
  const double t = std::ldexp(4.0 / 3.0, scales_ - 2 - band) / lambda_max_;
  return scale == 0 ? phi(t * lambda) : psi(t * lambda);
}

}  // namespace tutti::spectral
