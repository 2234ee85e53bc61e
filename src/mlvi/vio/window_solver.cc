// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

namespace mlvi {
namespace {

constexpr double kFirstDamping = 1e-6, kDampingFactor = 10.0;
constexpr int kAttempts = 6;  // per linearisation
// m^2: an inverse depth moves by about 1 / m at most where its bearings say nothing.
constexpr double kDepthDamping = 1.0;

// Everything that a step changes.
struct Values {
  explicit Values(const VioWindow& window)
      : states(window.frames.size()), calibration(window.calibration) {
    for (std::size_t i = 0; i < states.size(); ++i) states[i] = window.frames[i].state;
    for (const WindowFeature& f : window.features) inverse_depths.push_back(f.inverse_depth);
  }
  void Restore(VioWindow& window) const {
    for (std::size_t i = 0; i < states.size(); ++i) window.frames[i].state = states[i];
    for (std::size_t f = 0; f < inverse_depths.size(); ++f) {
      window.features[f].inverse_depth = inverse_depths[f];
    }
    window.calibration = calibration;
  }

  std::vector<NavState> states;
  std::vector<double> inverse_depths;
  VioCalibration calibration;
};

Eigen::VectorXd UnitDiagonalScale(const Eigen::MatrixXd& H) {
  return H.diagonal().array().max(1e-30).sqrt().inverse();
}

struct DampedStep {
  Eigen::VectorXd step;   // of everything but the features
  double decrease = 0.0;  // of the linearised objective, about
};

// Empty when the system is not positive definite.
std::optional<DampedStep> SolveDamped(const LinearizedWindow& system, double damping) {
  ReducedSystem reduced = EliminateFeatures(system, damping, kDepthDamping);
  const Eigen::VectorXd scale = UnitDiagonalScale(reduced.H);
  reduced.H = scale.asDiagonal() * reduced.H * scale.asDiagonal();
  reduced.H.diagonal().array() += damping;
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> llt(reduced.H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  DampedStep result{.step = scale.cwiseProduct(llt.solve(scale.cwiseProduct(reduced.b)))};
  if (!result.step.allFinite()) return std::nullopt;
  const Eigen::ArrayXd information = (1.0 + damping) * system.feature_information.array();
  result.decrease =
      0.5 * (reduced.b.dot(result.step) +
             (system.feature_gradient.array().square() / (information + kDepthDamping)).sum());
  return result;
}

void Move(VioWindow& window, const WindowConfig& config, const LinearizedWindow& system,
          const Eigen::VectorXd& step, double damping) {
  const Eigen::VectorXd depths = FeatureSteps(system, step, damping, kDepthDamping);
  MoveWindow(window, system.layout, step);
  for (std::size_t f = 0; f < window.features.size(); ++f) {
    double& rho = window.features[f].inverse_depth;
    // Not behind infinity: there, and where nothing moves, the sign of all motion would be free.
    rho = std::clamp(rho + depths[static_cast<Eigen::Index>(f)], 0.0, 1.0 / config.min_depth);
  }
}

// One step that lowers the objective, under more damping where needed, with `system` linearised anew
// where it leads to. False when there is none or it is not worth another one.
bool Improve(VioWindow& window, const WindowConfig& config, double gravity,
             LinearizedWindow& system, double& damping, WindowSolution& solution) {
  const Values before(window);
  for (int attempt = 0; attempt < kAttempts; ++attempt, damping *= kDampingFactor) {
    const auto step = SolveDamped(system, damping);
    if (!step) continue;
    solution.solved = true;
    if (step->decrease < config.min_decrease) return false;
    Move(window, config, system, step->step, damping);
    // An accepted step needs it next; only a rejected one, which is rare, could do with less.
    LinearizedWindow moved = Linearize(window, config, gravity);
    if (moved.cost <= system.cost) {
      const double decrease = system.cost - moved.cost;
      system = std::move(moved);
      damping = std::max(kFirstDamping, damping / (kDampingFactor * kDampingFactor));
      return decrease >= config.min_decrease;
    }
    before.Restore(window);
  }
  return false;
}

}  // namespace

std::optional<Eigen::MatrixXd> InverseColumns(const Eigen::MatrixXd& upper, int first, int count) {
  const Eigen::VectorXd scale = UnitDiagonalScale(upper);
  const Eigen::MatrixXd scaled = scale.asDiagonal() * upper * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> llt(scaled);
  if (llt.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(upper.rows(), count);
  for (int k = 0; k < count; ++k) columns(first + k, k) = scale[first + k];
  Eigen::MatrixXd inverse = scale.asDiagonal() * llt.solve(columns);
  if (!inverse.allFinite()) return std::nullopt;
  return inverse;
}

WindowSolution SolveWindow(VioWindow& window, const WindowConfig& config, double gravity) {
  WindowSolution solution;
  LinearizedWindow system = Linearize(window, config, gravity);
  solution.initial_cost = system.cost;
  double damping = kFirstDamping;
  for (bool done = false; !done && solution.iterations < config.max_iterations;) {
    ++solution.iterations;
    done = !Improve(window, config, gravity, system, damping, solution);
  }
  solution.final_cost = system.cost;
  solution.per_camera = system.per_camera;
  solution.information = EliminateFeatures(system);
  return solution;
}

}  // namespace mlvi
