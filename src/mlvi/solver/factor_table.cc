// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/factor_table.h"

#include <cmath>
#include <limits>

namespace mlvi::internal {
namespace {

typedef double Vector __attribute__((vector_size(64)));  // NOLINT(modernize-use-using): attribute

// out (rows x tangent, rows `stride` apart) = J (rows x ambient) * plus (ambient x tangent), both row-major.
template <int kAmbient, int kTangent>
void MultiplyFixed(const double* J, const double* plus, int rows, int stride, double* out) {
  using Plus = Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>;
  const Eigen::Map<const Plus> P(plus);
  for (int r = 0; r < rows; ++r) {
    const Eigen::Map<const Eigen::Matrix<double, 1, kAmbient>> row(J + r * kAmbient);
    Eigen::Map<Eigen::Matrix<double, 1, kTangent>>(out + r * stride) = row.lazyProduct(P);
  }
}

void MultiplyAny(const double* J, const double* plus, int rows, int ambient, int tangent, int stride, double* out) {
  for (int r = 0; r < rows; ++r) {
    for (int t = 0; t < tangent; ++t) {
      double sum = 0.0;
      for (int a = 0; a < ambient; ++a) sum += J[r * ambient + a] * plus[a * tangent + t];
      out[r * stride + t] = sum;
    }
  }
}

void CopyRows(const double* J, int rows, int columns, int stride, double* out) {
  for (int r = 0; r < rows; ++r) std::copy_n(J + r * columns, columns, out + r * stride);
}

bool AllFinite(const double* values, std::size_t size) {
  // Eight sums at a time; 0 * x is NaN for infinite and NaN x.
  Vector sum = {};
  for (std::size_t i = 0; i < size; i += kVectorSize) sum += 0.0 * *reinterpret_cast<const Vector*>(values + i);
  double total = 0.0;
  for (int k = 0; k < kVectorSize; ++k) total += sum[k];
  return total == 0.0;
}

double SquaredNorm(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double x : values) sum += x * x;
  return sum;
}

// H = A^T A and b = -A^T r from rows [A | r].
void FormHessian(const double* augmented, int rows, int dimension, int stride, double* hessian) {
  for (int column = 0; column < dimension; ++column) {
    double* out = hessian + static_cast<std::size_t>(column) * stride;
    for (int i = 0; i < stride; i += kVectorSize) {
      Vector sum = {};
      for (int r = 0; r < rows; ++r) {
        const double* row = augmented + static_cast<std::size_t>(r) * stride;
        sum += *reinterpret_cast<const Vector*>(row + i) * row[column];
      }
      *reinterpret_cast<Vector*>(out + i) = sum;
    }
    out[dimension] = -out[dimension];
  }
}

}  // namespace

bool FactorWorkspace::EvaluateAugmented(const VariableTable& variables, const Factor& factor) {
  const int rows = factor.cost->num_residuals();
  std::size_t ambient_total = 0;
  parameters_.clear();
  for (const int v : factor.variables) {
    parameters_.push_back(variables.linearization(v));
    ambient_total += static_cast<std::size_t>(rows) * variables.ambient_size(v);
  }
  residuals_.resize(rows);
  ambient_.resize(ambient_total);
  jacobians_.clear();
  double* next = ambient_.data();
  for (const int v : factor.variables) {
    jacobians_.push_back(next);
    next += static_cast<std::size_t>(rows) * variables.ambient_size(v);
  }
  if (!factor.cost->Evaluate(parameters_.data(), residuals_.data(), jacobians_.data())) return false;

  const int stride = factor.stride();
  augmented_.Reset(static_cast<std::size_t>(rows) * stride);
  for (std::size_t i = 0; i < factor.variables.size(); ++i) {
    const int v = factor.variables[i], ambient = variables.ambient_size(v), tangent = variables.tangent_size(v);
    const double* plus = variables.plus_jacobian(v);
    double* out = augmented_.data() + factor.start[i];
    if (plus == nullptr) {
      CopyRows(jacobians_[i], rows, tangent, stride, out);
    } else if (ambient == 7 && tangent == 6) {
      MultiplyFixed<7, 6>(jacobians_[i], plus, rows, stride, out);
    } else {
      MultiplyAny(jacobians_[i], plus, rows, ambient, tangent, stride, out);
    }
  }
  CopyRows(residuals_.data(), rows, 1, stride, augmented_.data() + factor.dimension());
  return AllFinite(augmented_.data(), static_cast<std::size_t>(rows) * stride);
}

bool FactorWorkspace::Linearize(const VariableTable& variables, Factor* factor) {
  if (!EvaluateAugmented(variables, *factor)) return false;
  const int rows = factor->cost->num_residuals(), stride = factor->stride();
  double rho[3] = {SquaredNorm(residuals_), 1.0, 0.0};
  if (factor->loss != nullptr) {
    factor->loss->Evaluate(rho[0], rho);
    const double weight = std::sqrt(rho[1]);
    if (!std::isfinite(weight)) return false;
    for (int i = 0; i < rows * stride; ++i) augmented_.data()[i] *= weight;
  }
  factor->objective = 0.5 * rho[0];
  factor->hessian.Reserve(static_cast<std::size_t>(factor->dimension()) * stride);
  FormHessian(augmented_.data(), rows, factor->dimension(), stride, factor->hessian.data());
  return true;
}

double FactorWorkspace::Objective(const VariableTable& variables, const Factor& factor) {
  parameters_.clear();
  for (const int v : factor.variables) parameters_.push_back(variables.estimate(v));
  residuals_.resize(factor.cost->num_residuals());
  if (!factor.cost->Evaluate(parameters_.data(), residuals_.data(), nullptr)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double rho[3] = {SquaredNorm(residuals_), 1.0, 0.0};
  if (factor.loss != nullptr) factor.loss->Evaluate(rho[0], rho);
  return 0.5 * rho[0];
}

double FactorWorkspace::ModelError(const VariableTable& variables, const Factor& factor) {
  step_.assign(factor.stride(), 0.0);  // zero in the rows behind dimension()
  for (std::size_t i = 0; i < factor.variables.size(); ++i) {
    const int v = factor.variables[i];
    std::copy_n(variables.delta(v), variables.tangent_size(v), step_.data() + factor.start[i]);
  }
  // H d, one vector of eight rows after the other; its row dimension() is b^T d.
  double model = factor.objective;
  const int dimension = factor.dimension();
  for (int row = 0; row < factor.stride(); row += kVectorSize) {
    Vector sum = {};
    for (int k = 0; k < dimension; ++k) {
      const double* column = factor.hessian.data() + static_cast<std::size_t>(k) * factor.stride();
      sum += *reinterpret_cast<const Vector*>(column + row) * step_[k];
    }
    for (int i = 0; i < kVectorSize; ++i) model += 0.5 * sum[i] * step_[row + i];
    if (dimension < row + kVectorSize) model -= sum[dimension - row];
  }
  return std::abs(Objective(variables, factor) - model);
}

}  // namespace mlvi::internal
