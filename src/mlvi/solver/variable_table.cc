// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/variable_table.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"

namespace mlvi::internal {

int VariableTable::Add(std::span<const double> value, std::shared_ptr<const Manifold> manifold,
                       std::span<const double> scale) {
  const int ambient = static_cast<int>(value.size());
  MLVI_CHECK(ambient > 0, "a variable of size {}", ambient);
  MLVI_CHECK(manifold == nullptr || manifold->AmbientSize() == ambient,
             "value of {} for a manifold in {} dimensions", ambient, manifold->AmbientSize());
  const int tangent = manifold != nullptr ? manifold->TangentSize() : ambient;
  MLVI_CHECK(scale.empty() || static_cast<int>(scale.size()) == tangent,
             "{} scales for {} dimensions", scale.size(), tangent);
  for (const double s : scale) MLVI_CHECK(s > 0.0, "scale {}", s);
  const int v = size();
  manifolds_.push_back(std::move(manifold));
  ambient_start_.push_back(ambient_start_.back() + ambient);
  tangent_start_.push_back(tangent_start_.back() + tangent);
  linearization_.insert(linearization_.end(), value.begin(), value.end());
  estimate_.insert(estimate_.end(), value.begin(), value.end());
  delta_.resize(tangent_start_.back(), 0.0);
  for (int k = 0; k < tangent; ++k) inverse_scale_.push_back(scale.empty() ? 1.0 : 1.0 / scale[k]);
  jacobian_start_.push_back(jacobian_start_.back() +
                            (manifolds_[v] != nullptr ? ambient * tangent : 0));
  plus_jacobian_.resize(jacobian_start_.back());
  ComputePlusJacobian(v);
  return v;
}

void VariableTable::Truncate(int size) {
  manifolds_.resize(size);
  ambient_start_.resize(size + 1);
  tangent_start_.resize(size + 1);
  jacobian_start_.resize(size + 1);
  linearization_.resize(ambient_start_.back());
  estimate_.resize(ambient_start_.back());
  delta_.resize(tangent_start_.back());
  inverse_scale_.resize(tangent_start_.back());
  plus_jacobian_.resize(jacobian_start_.back());
}

const double* VariableTable::plus_jacobian(int v) const {
  return manifolds_[v] != nullptr ? plus_jacobian_.data() + jacobian_start_[v] : nullptr;
}

double VariableTable::ScaledStep(int v) const {
  const double* inverse_scale = inverse_scale_.data() + tangent_start_[v];
  const double* step = delta(v);
  double distance = 0.0;
  for (int k = 0; k < tangent_size(v); ++k)
    distance = std::max(distance, std::abs(step[k]) * inverse_scale[k]);
  return distance;
}

void VariableTable::UpdateEstimate(int v) {
  const double* x = linearization(v);
  double* estimate = estimate_.data() + ambient_start_[v];
  if (manifolds_[v] != nullptr) {
    manifolds_[v]->Plus(x, delta(v), estimate);
  } else {
    for (int k = 0; k < ambient_size(v); ++k) estimate[k] = x[k] + delta(v)[k];
  }
}

void VariableTable::MoveLinearizationToEstimate(int v) {
  std::copy_n(estimate(v), ambient_size(v), linearization_.data() + ambient_start_[v]);
  std::fill_n(delta(v), tangent_size(v), 0.0);
  ComputePlusJacobian(v);
}

void VariableTable::Restore(int v, const double* estimate) {
  std::copy_n(estimate, ambient_size(v), estimate_.data() + ambient_start_[v]);
  MoveLinearizationToEstimate(v);
}

void VariableTable::ComputePlusJacobian(int v) {
  if (manifolds_[v] == nullptr) return;
  manifolds_[v]->PlusJacobian(linearization(v), plus_jacobian_.data() + jacobian_start_[v]);
}

}  // namespace mlvi::internal
