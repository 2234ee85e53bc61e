// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/problem.h>

#include <memory>

#include "mlvi/solver/manifold.h"

namespace mlvi {

// Adds `values` to `problem` as a variable on `manifold`, which the problem keeps. For batch
// solutions by Ceres of the factors that the smoother has, beside it.
void AddParameterBlock(std::shared_ptr<const Manifold> manifold, double* values,
                       ceres::Problem& problem);

}  // namespace mlvi
