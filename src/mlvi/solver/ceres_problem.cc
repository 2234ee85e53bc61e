// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/ceres_problem.h"

#include <ceres/version.h>

#include "mlvi/base/error.h"

#if CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR == 0
#define MLVI_CERES_WITHOUT_MANIFOLD
#include <ceres/local_parameterization.h>
#else
#include <ceres/manifold.h>
#endif

namespace mlvi {
namespace {

#ifdef MLVI_CERES_WITHOUT_MANIFOLD

class CeresChart final : public ceres::LocalParameterization {
 public:
  explicit CeresChart(std::shared_ptr<const Manifold> manifold) : manifold_(std::move(manifold)) {}

  int GlobalSize() const override { return manifold_->AmbientSize(); }
  int LocalSize() const override { return manifold_->TangentSize(); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    manifold_->Plus(x, delta, x_plus_delta);
    return true;
  }
  bool ComputeJacobian(const double* x, double* jacobian) const override {
    manifold_->PlusJacobian(x, jacobian);
    return true;
  }

 private:
  std::shared_ptr<const Manifold> manifold_;
};

#else

class CeresChart final : public ceres::Manifold {
 public:
  explicit CeresChart(std::shared_ptr<const mlvi::Manifold> manifold)
      : manifold_(std::move(manifold)) {}

  int AmbientSize() const override { return manifold_->AmbientSize(); }
  int TangentSize() const override { return manifold_->TangentSize(); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    manifold_->Plus(x, delta, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    manifold_->PlusJacobian(x, jacobian);
    return true;
  }
  // Needed by Ceres' gradient checks and manifold tests only.
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  std::shared_ptr<const mlvi::Manifold> manifold_;
};

#endif

}  // namespace

void AddParameterBlock(std::shared_ptr<const Manifold> manifold, double* values,
                       ceres::Problem& problem) {
  MLVI_CHECK(manifold != nullptr, "a parameter block without a manifold");
  const int size = manifold->AmbientSize();
  problem.AddParameterBlock(values, size, new CeresChart(std::move(manifold)));
}

}  // namespace mlvi
