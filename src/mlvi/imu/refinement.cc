// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/refinement.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/imu/imu_residual.h"
#include "mlvi/imu/levelling.h"

namespace mlvi::internal {
namespace {

using namespace nav_index;

constexpr int kMaxIterations = 30;
constexpr double kConvergedDecrease = 1e-8;  // relative, of chi square

struct NormalEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;  // gradient / 2
  double chi_square = 0.0;

  explicit NormalEquations(std::size_t states)
      : H(Eigen::MatrixXd::Zero(15 * static_cast<Eigen::Index>(states),
                                15 * static_cast<Eigen::Index>(states))),
        g(Eigen::VectorXd::Zero(H.rows())) {}

  // A whitened residual with its Jacobian by the states from `first` on (15 columns each).
  void Add(std::size_t first, const Eigen::VectorXd& r, const Eigen::MatrixXd& J) {
    const Eigen::Index at = 15 * static_cast<Eigen::Index>(first), n = J.cols();
    H.block(at, at, n, n).noalias() += J.transpose() * J;
    g.segment(at, n).noalias() += J.transpose() * r;
    chi_square += r.squaredNorm();
  }
};

void AddMotion(std::size_t k, std::span<const NavState> states, const PreintegratedImu& motion,
               const Matrix15d& sqrt_information, double gravity, NormalEquations& equations) {
  const ImuResidual residual = EvaluateImuResidual(states[k], states[k + 1], motion, gravity);
  Eigen::Matrix<double, 15, 30> J;
  J << residual.by_first, residual.by_second;
  equations.Add(k, sqrt_information * residual.value, sqrt_information * J);
}

void AddStep(std::size_t k, std::span<const NavState> states, const RelativePose& step,
             NormalEquations& equations) {
  const Pose3& first = states[k].T_world_body;
  const Pose3 T_first_second = first.inverse() * states[k + 1].T_world_body;
  const Vector6d r = BoxMinus(T_first_second, step.T_from_to);
  const Eigen::Matrix3d Rt_step = step.T_from_to.R().transpose(), Rt = first.R().transpose();
  const Eigen::Matrix3d J_inverse = RightJacobianInverseSo3(r.tail<3>());
  Eigen::Matrix<double, 6, 30> J = Eigen::Matrix<double, 6, 30>::Zero();
  J.block<3, 3>(0, kPosition) = -Rt_step * Rt;
  J.block<3, 3>(0, kRotation) = Rt_step * Hat(T_first_second.translation());
  J.block<3, 3>(0, 15 + kPosition) = Rt_step * Rt;
  J.block<3, 3>(3, kRotation) = -J_inverse * T_first_second.R().transpose();
  J.block<3, 3>(3, 15 + kRotation) = J_inverse;
  const Eigen::LLT<Matrix6d> llt(step.covariance);
  equations.Add(k, llt.matrixL().solve(r), llt.matrixL().solve(J));
}

// Origin and heading of the first state, and the biases' prior.
void AddPriors(const NavState& first, const Heading& heading, const ImuSpec& imu,
               NormalEquations& equations) {
  const Eigen::Matrix3d R = first.T_world_body.R();
  Eigen::Matrix<double, 10, 1> r, sigma;
  Eigen::Matrix<double, 10, 15> J = Eigen::Matrix<double, 10, 15>::Zero();
  r << first.T_world_body.translation(), heading.Of(R), first.bias.accelerometer,
      first.bias.gyroscope;
  J.block<3, 3>(0, kPosition).setIdentity();
  J.block<1, 3>(3, kRotation) = heading.Derivative(R);
  J.block<3, 3>(4, kAccelerometerBias).setIdentity();
  J.block<3, 3>(7, kGyroscopeBias).setIdentity();
  sigma << Eigen::Vector3d::Constant(kGaugePositionSigma), kGaugeHeadingSigma,
      Eigen::Vector3d::Constant(imu.initial_accelerometer_bias_sigma),
      Eigen::Vector3d::Constant(imu.initial_gyroscope_bias_sigma);
  const auto weight = sigma.cwiseInverse().asDiagonal();
  equations.Add(0, weight * r, weight * J);
}

std::vector<NavState> Moved(std::vector<NavState> states, const Eigen::VectorXd& delta) {
  for (std::size_t k = 0; k < states.size(); ++k) {
    states[k] = BoxPlus(states[k], delta.segment<15>(15 * static_cast<Eigen::Index>(k)));
  }
  return states;
}

}  // namespace

Refinement RefineStates(std::vector<NavState> states, std::span<const PreintegratedImu> motions,
                        std::span<const RelativePose> steps, const ImuSpec& imu, double gravity) {
  MLVI_CHECK(motions.size() + 1 == states.size() && steps.size() == motions.size(),
             "{} states need one motion and one step between each two, got {} and {}",
             states.size(), motions.size(), steps.size());
  const Heading heading(states.front().T_world_body.R().transpose().col(2));
  std::vector<Matrix15d> sqrt_information;
  for (const PreintegratedImu& motion : motions)
    sqrt_information.push_back(SqrtInformation(motion));
  const auto linearize = [&](const std::vector<NavState>& at) {
    NormalEquations equations(at.size());
    for (std::size_t k = 0; k < motions.size(); ++k) {
      AddMotion(k, at, motions[k], sqrt_information[k], gravity, equations);
      AddStep(k, at, steps[k], equations);
    }
    AddPriors(at.front(), heading, imu, equations);
    return equations;
  };

  Refinement result;
  result.states = std::move(states);
  NormalEquations equations = linearize(result.states);
  double damping = 1e-6;
  while (result.iterations < kMaxIterations && !result.converged) {
    ++result.iterations;
    Eigen::MatrixXd damped = equations.H;
    damped.diagonal() *= 1.0 + damping;
    std::vector<NavState> candidate = Moved(result.states, damped.llt().solve(-equations.g));
    NormalEquations candidate_equations = linearize(candidate);
    const double decrease = equations.chi_square - candidate_equations.chi_square;
    result.converged = std::abs(decrease) <= kConvergedDecrease * (1.0 + equations.chi_square);
    if (decrease > 0.0) {
      result.states = std::move(candidate);
      equations = std::move(candidate_equations);
      damping = std::max(1e-9, 0.1 * damping);
    } else {
      damping *= 10.0;
    }
  }
  const Eigen::Index size = equations.H.rows();
  Eigen::MatrixXd last = Eigen::MatrixXd::Zero(size, 15);
  last.bottomRows<15>().setIdentity();
  result.covariance = equations.H.llt().solve(last).bottomRows<15>();
  result.chi_square = equations.chi_square;
  result.degrees_of_freedom = static_cast<int>(21 * motions.size() + 10) - static_cast<int>(size);
  return result;
}

}  // namespace mlvi::internal
