// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Robust kernels in the convention of Ceres: with s the squared whitened residual, the cost is
// rho(s) / 2 and iteratively reweighted least squares uses the weight rho'(s). All have rho(0) = 0
// and rho'(0) = 1, so that inliers are left alone. `scale` is in units of the whitened residual
// (standard deviations).
#pragma once

#include <cmath>

namespace mlvi {

// Quadratic up to `scale`, linear beyond: rho = s, or 2 c sqrt(s) - c^2.
struct HuberKernel {
  double scale = 1.0;
  double Cost(double s) const {
    return s <= scale * scale ? s : 2.0 * scale * std::sqrt(s) - scale * scale;
  }
  double Weight(double s) const { return s <= scale * scale ? 1.0 : scale / std::sqrt(s); }
};

// rho = c^2 log(1 + s / c^2): grows with the logarithm; outliers keep little influence.
struct CauchyKernel {
  double scale = 1.0;
  double Cost(double s) const { return scale * scale * std::log1p(s / (scale * scale)); }
  double Weight(double s) const { return 1.0 / (1.0 + s / (scale * scale)); }
};

// rho = s / (1 + s / c^2): bounded by c^2; outliers lose their influence.
struct GemanMcClureKernel {
  double scale = 1.0;
  double Cost(double s) const { return s / (1.0 + s / (scale * scale)); }
  double Weight(double s) const {
    const double root = 1.0 / (1.0 + s / (scale * scale));
    return root * root;
  }
};

}  // namespace mlvi
