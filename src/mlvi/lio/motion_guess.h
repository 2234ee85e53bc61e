// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/lio/filter_state.h"

namespace mlvi {

// The IMU's prediction improved by the motion that another sensor saw. `last` is the estimate that
// `prediction` starts from. The relative pose is a measurement of both ends at once, so the update
// runs over the joint Gaussian of the last and the predicted state (stochastic cloning, Roumeliotis
// and Burdick 2002); the last state is then marginalised:
//   z = T_last_end,  h = BoxMinus(T_last^-1 T_end, z),  joint covariance [P, P F^T; F P, F P F^T +
//   Q].
// Where the guess does not reach from the last estimate to the end of the sweep, the IMU bridges
// the rest.
StateEstimate FuseMotionGuess(const StateEstimate& last, const Prediction& prediction,
                              const MotionPrior& guess);

}  // namespace mlvi
