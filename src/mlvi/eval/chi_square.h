// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace mlvi {

// Probability that a chi-square variable of `dof` > 0 degrees of freedom is at most x.
double ChiSquareProbability(double x, double dof);
// The x that it does not exceed with probability p in (0, 1). Relative accuracy about 1e-10, also
// for millions of degrees of freedom.
double ChiSquareQuantile(double p, double dof);

}  // namespace mlvi
