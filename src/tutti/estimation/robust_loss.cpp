// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/robust_loss.hpp"

#include <cmath>

#include "tutti/base/check.hpp"

namespace tutti::estimation {

double RobustLoss::rho(double s) const {
  const double c2 = scale * scale;
  switch (kind) {
    case LossKind::none:
      return s;
    case LossKind::huber:
      return s <= c2 ? s : 2.0 * scale * std::sqrt(s) - c2;
    case LossKind::cauchy:
      return c2 * std::log1p(s / c2);
  }
  return s;
}

double RobustLoss::weight(double s) const {
  const double c2 = scale * scale;
  switch (kind) {
    case LossKind::none:
      return 1.0;
    case LossKind::huber:
      return s <= c2 ? 1.0 : scale / std::sqrt(s);
    case LossKind::cauchy:
      return c2 / (c2 + s);
  }
  return 1.0;
}

double RobustLoss::curvature(double s) const {
  constexpr double kConvex = 0.1;
  const double c2 = scale * scale;
  double share = 1.0;
  if (kind == LossKind::cauchy) share = (c2 - s) / (c2 + s);
  return share > kConvex ? share : 1.0;  // Huber's is 1 or 0
}

LossKind loss_kind(const std::string& name) {
  if (name == "none") return LossKind::none;
  if (name == "huber") return LossKind::huber;
  TUTTI_CHECK(name == "cauchy", "unknown loss '{}'", name);
  return LossKind::cauchy;
}

}  // namespace tutti::estimation
