// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// One check for every Jacobian of every factor: the analytic ambient Jacobian, brought into the
// chart by PlusJacobian, against central differences through Manifold::Plus. For tests.
#pragma once

#include <ceres/cost_function.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "mlvi/solver/manifold.h"

namespace mlvi {

// One parameter block: where to evaluate, and its manifold (null = Euclidean).
struct FactorBlock {
  Eigen::VectorXd value;
  const Manifold* manifold = nullptr;
};

namespace internal {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline int TangentSize(const FactorBlock& block) {
  return block.manifold != nullptr ? block.manifold->TangentSize()
                                   : static_cast<int>(block.value.size());
}

inline Eigen::VectorXd Moved(const FactorBlock& block, const Eigen::VectorXd& delta) {
  if (block.manifold == nullptr) return block.value + delta;
  Eigen::VectorXd moved(block.value.size());
  block.manifold->Plus(block.value.data(), delta.data(), moved.data());
  return moved;
}

inline RowMajorMatrix PlusJacobian(const FactorBlock& block) {
  const auto n = block.value.size();
  if (block.manifold == nullptr) return RowMajorMatrix::Identity(n, n);
  RowMajorMatrix J(n, block.manifold->TangentSize());
  block.manifold->PlusJacobian(block.value.data(), J.data());
  return J;
}

inline bool EvaluateFactor(const ceres::CostFunction& cost, const std::vector<FactorBlock>& blocks,
                           Eigen::VectorXd* residuals, std::vector<RowMajorMatrix>* jacobians) {
  std::vector<const double*> parameters;
  for (const FactorBlock& block : blocks) parameters.push_back(block.value.data());
  residuals->resize(cost.num_residuals());
  if (jacobians == nullptr) return cost.Evaluate(parameters.data(), residuals->data(), nullptr);
  std::vector<double*> pointers;
  jacobians->clear();
  for (const FactorBlock& block : blocks)
    jacobians->emplace_back(cost.num_residuals(), block.value.size());
  for (RowMajorMatrix& jacobian : *jacobians) pointers.push_back(jacobian.data());
  return cost.Evaluate(parameters.data(), residuals->data(), pointers.data());
}

// Central differences of the residual along the chart of block `index`.
inline Eigen::MatrixXd NumericJacobian(const ceres::CostFunction& cost,
                                       std::vector<FactorBlock> blocks, std::size_t index,
                                       double step) {
  const FactorBlock original = blocks[index];
  Eigen::MatrixXd numeric(cost.num_residuals(), TangentSize(original));
  Eigen::VectorXd plus, minus;
  for (int k = 0; k < numeric.cols(); ++k) {
    const Eigen::VectorXd delta = step * Eigen::VectorXd::Unit(numeric.cols(), k);
    blocks[index].value = Moved(original, delta);
    EvaluateFactor(cost, blocks, &plus, nullptr);
    blocks[index].value = Moved(original, -delta);
    EvaluateFactor(cost, blocks, &minus, nullptr);
    numeric.col(k) = (plus - minus) / (2.0 * step);
  }
  return numeric;
}

}  // namespace internal

// Success when, for every block, analytic and numeric Jacobian agree to `tolerance` relative to the
// largest entry of the numeric one (but at least `tolerance` absolute), Evaluate without Jacobians
// and with null entries for single blocks gives the same residuals and Jacobians. The truncation
// error of central differences is about step^2, their round-off 1e-16 * |residual| / step: the
// default step balances them for residuals of order one.
inline testing::AssertionResult JacobiansAreCorrect(const ceres::CostFunction& cost,
                                                    const std::vector<FactorBlock>& blocks,
                                                    double tolerance = 1e-6, double step = 1e-5) {
  if (blocks.size() != cost.parameter_block_sizes().size()) {
    return testing::AssertionFailure()
           << blocks.size() << " blocks for a factor of " << cost.parameter_block_sizes().size();
  }
  Eigen::VectorXd residuals, repeated;
  std::vector<internal::RowMajorMatrix> jacobians;
  if (!internal::EvaluateFactor(cost, blocks, &residuals, &jacobians) ||
      !internal::EvaluateFactor(cost, blocks, &repeated, nullptr) || !residuals.allFinite()) {
    return testing::AssertionFailure() << "the factor cannot be evaluated here";
  }
  if (residuals != repeated)
    return testing::AssertionFailure() << "residuals depend on whether Jacobians are asked for";
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Eigen::MatrixXd analytic = jacobians[b] * internal::PlusJacobian(blocks[b]);
    const Eigen::MatrixXd numeric = internal::NumericJacobian(cost, blocks, b, step);
    const double allowed = tolerance * std::max(1.0, numeric.cwiseAbs().maxCoeff());
    const double difference = (analytic - numeric).cwiseAbs().maxCoeff();
    if (!(difference <= allowed)) {  // also NaN
      return testing::AssertionFailure() << "block " << b << ": Jacobians differ by " << difference
                                         << ", allowed " << allowed << "\nanalytic\n"
                                         << analytic << "\nnumeric\n"
                                         << numeric;
    }
    std::vector<const double*> parameters;
    for (const FactorBlock& block : blocks) parameters.push_back(block.value.data());
    std::vector<double*> only(blocks.size(), nullptr);
    internal::RowMajorMatrix alone(jacobians[b].rows(), jacobians[b].cols());
    only[b] = alone.data();
    cost.Evaluate(parameters.data(), repeated.data(), only.data());
    if (alone != jacobians[b])
      return testing::AssertionFailure() << "block " << b << " alone differs";
  }
  return testing::AssertionSuccess();
}

}  // namespace mlvi
