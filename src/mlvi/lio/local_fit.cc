// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/local_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace mlvi {
namespace {

constexpr double kPriorWeight = 3.0;  // observations

// Conditions are written so that a number that is not one fails them.

LocalFit Decompose(const Neighbors& neighbors) {
  LocalFit fit;
  fit.count = neighbors.count;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = 0; i < neighbors.count; ++i) sum += neighbors.points[i];
  const Eigen::Vector3f center = sum / static_cast<float>(neighbors.count);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < neighbors.count; ++i) {
    const Eigen::Vector3d d = (neighbors.points[i] - center).cast<double>();
    scatter.noalias() += d * d.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(scatter / neighbors.count);
  fit.centroid = center.cast<double>();
  fit.axes = solver.eigenvectors();
  fit.variances = solver.eigenvalues().cwiseMax(0.0);
  return fit;
}

double PointVariance(double squared_sum, double degrees_of_freedom, double prior_sigma) {
  return (squared_sum + kPriorWeight * prior_sigma * prior_sigma) /
         (degrees_of_freedom + kPriorWeight);
}

}  // namespace

std::optional<LocalFit> FitPlane(const Neighbors& neighbors, double max_thickness,
                                 double prior_sigma) {
  if (neighbors.count < 4) return std::nullopt;
  LocalFit fit = Decompose(neighbors);
  const bool spread = fit.variances[1] > 0.0 && fit.variances[1] >= 1e-3 * fit.variances[2] &&
                      fit.variances[1] >= 4.0 * fit.variances[0];
  if (!spread) return std::nullopt;
  for (int i = 0; i < neighbors.count; ++i) {
    const double distance = fit.axes.col(0).dot(neighbors.points[i].cast<double>() - fit.centroid);
    if (!(std::abs(distance) <= max_thickness)) return std::nullopt;
  }
  fit.point_variance = PointVariance(fit.count * fit.variances[0], fit.count - 3.0, prior_sigma);
  return fit;
}

std::optional<LocalFit> FitLine(const Neighbors& neighbors, double max_thickness,
                                double prior_sigma) {
  if (neighbors.count < 3) return std::nullopt;
  LocalFit fit = Decompose(neighbors);
  const bool thin = fit.variances[2] > 0.0 && fit.variances[2] >= 9.0 * fit.variances[1] &&
                    fit.variances[1] <= max_thickness * max_thickness;
  if (!thin) return std::nullopt;
  // Two directions across the line, four parameters.
  fit.point_variance = PointVariance(0.5 * fit.count * (fit.variances[0] + fit.variances[1]),
                                     fit.count - 2.0, prior_sigma);
  return fit;
}

}  // namespace mlvi
