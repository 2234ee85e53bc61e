// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/factor_table.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

namespace mlvi::internal {
namespace {

typedef double Vector __attribute__((vector_size(64)));  // NOLINT(modernize-use-using): attribute

// out (rows x tangent, rows `stride` apart) = J (rows x ambient) * plus (ambient x tangent), both
// row-major.
template <int kAmbient, int kTangent>
void MultiplyFixed(const double* J, const double* plus, int rows, int stride, double* out) {
  using Plus = Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>;
  const Eigen::Map<const Plus> P(plus);
  for (int r = 0; r < rows; ++r) {
    const Eigen::Map<const Eigen::Matrix<double, 1, kAmbient>> row(J + r * kAmbient);
    Eigen::Map<Eigen::Matrix<double, 1, kTangent>>(out + r * stride) = row.lazyProduct(P);
  }
}

void MultiplyAny(const double* J, const double* plus, int rows, int ambient, int tangent,
                 int stride, double* out) {
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
  for (std::size_t i = 0; i < size; i += kVectorSize)
    sum += 0.0 * *reinterpret_cast<const Vector*>(values + i);
  double total = 0.0;
  for (int k = 0; k < kVectorSize; ++k) total += sum[k];
  return total == 0.0;
}

double SquaredNorm(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double x : values) sum += x * x;
  return sum;
}

// Replaces rows [A | r] by the fewer rows of a triangular matrix with the same A^T A, A^T r and
// |r|. Returns their number.
int Triangularize(int rows, int columns, int stride, double* augmented) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor, 0, Eigen::OuterStride<>> map(augmented, rows, columns,
                                                    Eigen::OuterStride<>(stride));
  const Eigen::HouseholderQR<RowMajor> qr(map);
  map.topRows(columns) = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  return columns;
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
  if (!factor.cost->Evaluate(parameters_.data(), residuals_.data(), jacobians_.data()))
    return false;

  const int stride = factor.stride();
  augmented_.Reset(static_cast<std::size_t>(rows) * stride);
  for (std::size_t i = 0; i < factor.variables.size(); ++i) {
    const int v = factor.variables[i], ambient = variables.ambient_size(v),
              tangent = variables.tangent_size(v);
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
  const int columns = factor->dimension() + 1;
  factor->objective = 0.5 * rho[0];
  factor->rows = rows > columns ? Triangularize(rows, columns, stride, augmented_.data()) : rows;
  const std::size_t size = static_cast<std::size_t>(factor->rows) * stride;
  factor->augmented.Reserve(size);
  std::copy_n(augmented_.data(), size, factor->augmented.data());
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
  const int stride = factor.stride(), dimension = factor.dimension();
  step_.Reset(stride);
  double* step = step_.data();
  for (const int v : factor.variables)
    step = std::copy_n(variables.delta(v), variables.tangent_size(v), step);
  *step = 1.0;  // times r
  double model = factor.objective;
  for (int r = 0; r < factor.rows; ++r) {
    const double* row = factor.augmented.data() + static_cast<std::size_t>(r) * stride;
    Vector sum = {};
    for (int i = 0; i < stride; i += kVectorSize) {
      sum += *reinterpret_cast<const Vector*>(row + i) *
             *reinterpret_cast<const Vector*>(step_.data() + i);
    }
    double residual = 0.0;
    for (int i = 0; i < kVectorSize; ++i) residual += sum[i];
    model += 0.5 * (residual * residual - row[dimension] * row[dimension]);
  }
  return std::abs(Objective(variables, factor) - model);
}

}  // namespace mlvi::internal
