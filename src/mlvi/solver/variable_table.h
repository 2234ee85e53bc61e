// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "mlvi/solver/manifold.h"

namespace mlvi::internal {

// All variables of a smoother, by index, in contiguous arrays: linearisation point, step from it,
// and estimate = linearisation point boxplus step.
class VariableTable {
 public:
  int Add(std::span<const double> value, std::shared_ptr<const Manifold> manifold,
          std::span<const double> scale);
  void Truncate(int size);  // forgets the last ones

  int size() const { return static_cast<int>(manifolds_.size()); }
  int ambient_size(int v) const { return ambient_start_[v + 1] - ambient_start_[v]; }
  int tangent_size(int v) const { return tangent_start_[v + 1] - tangent_start_[v]; }
  int tangent_start(int v) const { return tangent_start_[v]; }
  const double* linearization(int v) const { return linearization_.data() + ambient_start_[v]; }
  const double* estimate(int v) const { return estimate_.data() + ambient_start_[v]; }
  double* delta(int v) { return delta_.data() + tangent_start_[v]; }
  const double* delta(int v) const { return delta_.data() + tangent_start_[v]; }

  // ambient_size x tangent_size, row-major, at the linearisation point; null for a Euclidean
  // variable.
  const double* plus_jacobian(int v) const;

  // max_k |step_k| / scale_k.
  double ScaledStep(int v) const;

  void UpdateEstimate(int v);               // from linearisation point and step
  void MoveLinearizationToEstimate(int v);  // the step becomes zero
  // Back to `estimate` (ambient_size(v) numbers), which becomes the linearisation point, too.
  void Restore(int v, const double* estimate);

 private:
  void ComputePlusJacobian(int v);

  std::vector<int> ambient_start_ = {0}, tangent_start_ = {0};
  std::vector<std::size_t> jacobian_start_ = {0};
  std::vector<std::shared_ptr<const Manifold>> manifolds_;
  std::vector<double> linearization_, estimate_, delta_, inverse_scale_, plus_jacobian_;
};

}  // namespace mlvi::internal
