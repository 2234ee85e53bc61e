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

// Neighbouring states alone share residuals, so H is block tridiagonal.
struct NormalEquations {
  std::vector<Matrix15d> diagonal;  // H_kk
  std::vector<Matrix15d> next;      // H_k,k+1
  std::vector<Vector15d> gradient;  // half of it
  double chi_square = 0.0;

  explicit NormalEquations(std::size_t states)
      : diagonal(states, Matrix15d::Zero()),
        next(states - 1, Matrix15d::Zero()),
        gradient(states, Vector15d::Zero()) {}

  // A whitened residual with its Jacobian by one state.
  void Add(std::size_t k, const Eigen::VectorXd& r, const Eigen::MatrixXd& J) {
    diagonal[k].noalias() += J.transpose() * J;
    gradient[k].noalias() += J.transpose() * r;
    chi_square += r.squaredNorm();
  }
  // By states k and k + 1, 15 columns each.
  void AddBetween(std::size_t k, const Eigen::VectorXd& r, const Eigen::MatrixXd& J) {
    const auto a = J.leftCols<15>(), b = J.rightCols<15>();
    Add(k, r, a);
    diagonal[k + 1].noalias() += b.transpose() * b;
    gradient[k + 1].noalias() += b.transpose() * r;
    next[k].noalias() += a.transpose() * b;
  }
};

// Block elimination of (H + damping diag H) x = -gradient from the first state to the last.
struct Elimination {
  std::vector<Vector15d> step;                // x, by state
  std::vector<Eigen::LLT<Matrix15d>> pivots;  // the inverse of the last is the last state's block
                                              // of the whole inverse
};

Elimination Eliminate(const NormalEquations& equations, double damping) {
  const std::size_t n = equations.diagonal.size();
  std::vector<Eigen::LLT<Matrix15d>> pivots;
  std::vector<Vector15d> rest;  // of the right-hand side
  for (std::size_t k = 0; k < n; ++k) {
    Matrix15d pivot = equations.diagonal[k];
    pivot.diagonal() *= 1.0 + damping;
    rest.push_back(-equations.gradient[k]);
    if (k > 0) {
      const Matrix15d& coupling = equations.next[k - 1];
      pivot -= coupling.transpose() * pivots.back().solve(coupling);
      rest.back() -= coupling.transpose() * pivots.back().solve(rest[k - 1]);
    }
    pivots.emplace_back(pivot);
  }
  std::vector<Vector15d> step(n);
  for (std::size_t k = n; k-- > 0;) {
    if (k + 1 < n) rest[k] -= equations.next[k] * step[k + 1];
    step[k] = pivots[k].solve(rest[k]);
  }
  return {std::move(step), std::move(pivots)};
}

// d(pose chart) / d(error state) at an attitude.
Eigen::Matrix<double, 6, 15> PoseChart(const Eigen::Matrix3d& R_world_body) {
  Eigen::Matrix<double, 6, 15> J = Eigen::Matrix<double, 6, 15>::Zero();
  J.block<3, 3>(0, kPosition) = R_world_body.transpose();
  J.block<3, 3>(3, kRotation).setIdentity();
  return J;
}

// Refinement::relative. Given state k + 1, state k has the inverse of its pivot as covariance and
// moves with it by -pivot^-1 H_k,k+1; so blocks of the inverse follow from the last state down.
std::vector<Matrix6d> RelativeCovariances(std::span<const NavState> states,
                                          const NormalEquations& equations,
                                          const Elimination& elimination) {
  const Matrix15d last = elimination.pivots.back().solve(Matrix15d::Identity());
  const Pose3& T_world_last = states.back().T_world_body;
  std::vector<Matrix6d> relative(states.size(), Matrix6d::Zero());
  Matrix15d own = last, with_last = last;  // Cov(k, k) and Cov(k, last)
  for (std::size_t k = states.size() - 1; k-- > 0;) {
    const Eigen::LLT<Matrix15d>& pivot = elimination.pivots[k];
    const Matrix15d follows = -pivot.solve(equations.next[k]);
    own = pivot.solve(Matrix15d::Identity()) + follows * own * follows.transpose();
    with_last = follows * with_last;
    const Pose3& T_world_k = states[k].T_world_body;
    const Eigen::Matrix<double, 6, 15> by_k = PoseChart(T_world_k.R());
    const Eigen::Matrix<double, 6, 15> by_last =
        -AdjointSe3(T_world_k.inverse() * T_world_last) * PoseChart(T_world_last.R());
    const Matrix6d cross = by_k * with_last * by_last.transpose();
    relative[k] = by_k * own * by_k.transpose() + by_last * last * by_last.transpose() + cross +
                  cross.transpose();
  }
  return relative;
}

void AddMotion(std::size_t k, std::span<const NavState> states, const PreintegratedImu& motion,
               const Matrix15d& sqrt_information, double gravity, NormalEquations& equations) {
  const ImuResidual residual = EvaluateImuResidual(states[k], states[k + 1], motion, gravity);
  Eigen::Matrix<double, 15, 30> J;
  J << residual.by_first, residual.by_second;
  equations.AddBetween(k, sqrt_information * residual.value, sqrt_information * J);
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
  equations.AddBetween(k, llt.matrixL().solve(r), llt.matrixL().solve(J));
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

std::vector<NavState> Moved(std::vector<NavState> states, const std::vector<Vector15d>& step) {
  for (std::size_t k = 0; k < states.size(); ++k) states[k] = BoxPlus(states[k], step[k]);
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
    std::vector<NavState> candidate = Moved(result.states, Eliminate(equations, damping).step);
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
  const Elimination elimination = Eliminate(equations, 0.0);
  result.covariance = elimination.pivots.back().solve(Matrix15d::Identity());
  result.relative = RelativeCovariances(result.states, equations, elimination);
  result.chi_square = equations.chi_square;
  result.degrees_of_freedom =
      static_cast<int>(21 * motions.size() + 10) - 15 * static_cast<int>(result.states.size());
  return result;
}

}  // namespace mlvi::internal
