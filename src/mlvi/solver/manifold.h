// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace mlvi {

// What the smoother knows of a variable that is no vector: a chart around each of its points x,
// which are stored as AmbientSize() numbers. ceres::Manifold without its inverse; Ceres 2.0
// (Ubuntu 22.04) has none.
class Manifold {
 public:
  virtual ~Manifold() = default;
  virtual int AmbientSize() const = 0;
  virtual int TangentSize() const = 0;
  // x_plus_delta = x boxplus delta.
  virtual void Plus(const double* x, const double* delta, double* x_plus_delta) const = 0;
  // d(x boxplus delta) / d(delta) at delta = 0: AmbientSize x TangentSize, row-major.
  virtual void PlusJacobian(const double* x, double* jacobian) const = 0;
};

}  // namespace mlvi
