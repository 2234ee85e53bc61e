// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/deskew_error.h"

#include <Eigen/Cholesky>

namespace mlvi {
namespace {

// Covariance of the displacements (world position, body rotation) of parts with the lags u, v (s).
Matrix6d DisplacementCovariance(const DeskewError& error, double u, double v) {
  const double shorter = std::min(u, v), longer = std::max(u, v);
  const double a = error.accelerometer_density, g = error.gyroscope_density;
  Matrix6d C = Matrix6d::Zero();
  C.topLeftCorner<3, 3>() = u * v * error.velocity;
  C.bottomRightCorner<3, 3>() = u * v * error.gyroscope_bias;
  C.diagonal().head<3>().array() += a * a * shorter * shorter * (3.0 * longer - shorter) / 6.0;
  C.diagonal().tail<3>().array() += g * g * shorter;
  return C;
}

}  // namespace

DeskewError DeskewErrorOf(const StateEstimate& at_end, Duration span, const ImuNoise& noise) {
  return {.span = span.seconds(),
          .velocity = at_end.covariance.block<3, 3>(nav_index::kVelocity, nav_index::kVelocity),
          .gyroscope_bias =
              at_end.covariance.block<3, 3>(nav_index::kGyroscopeBias, nav_index::kGyroscopeBias),
          .accelerometer_density = noise.accelerometer_density,
          .gyroscope_density = noise.gyroscope_density};
}

Matrix6d DeskewCovariance(const DeskewError& error, const SweepParts& information) {
  constexpr double kLeast = 1.0;  // 1/m^2, 1/rad^2: keeps A regular where a direction is blind
  Matrix6d A = kLeast * Matrix6d::Identity();
  for (const Matrix6d& part : information) A += part;
  const Eigen::LDLT<Matrix6d> solver(A);
  SweepParts B;
  for (std::size_t k = 0; k < kSweepParts; ++k) B[k] = solver.solve(information[k]);
  const auto lag = [&](std::size_t k) {
    return error.span * (static_cast<double>(k) + 0.5) / static_cast<double>(kSweepParts);
  };
  Matrix6d result = Matrix6d::Zero();
  for (std::size_t k = 0; k < kSweepParts; ++k) {
    for (std::size_t l = 0; l < kSweepParts; ++l) {
      result += B[k] * DisplacementCovariance(error, lag(k), lag(l)) * B[l].transpose();
    }
  }
  return result;
}

}  // namespace mlvi
