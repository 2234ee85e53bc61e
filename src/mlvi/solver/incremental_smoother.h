// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// iSAM2 (Kaess, Johannsson, Roberts, Ila, Leonard, Dellaert, "iSAM2: Incremental smoothing and
// mapping using the Bayes tree", IJRR 2012) over ceres::CostFunction factors and Manifold
// variables, so that one factor serves the sliding window (Ceres) and the graph. It knows nothing
// of what the variables mean.
//
//   IncrementalSmoother smoother(config);
//   const VariableId pose = smoother.AddVariable(value, manifold);
//   smoother.AddFactor(prior, nullptr, {pose});
//   if (const auto summary = smoother.Update(); !summary) return tl::unexpected(summary.error());
//   LoadPose(smoother.Estimate(pose).data());
#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <Eigen/Core>
#include <initializer_list>
#include <memory>
#include <span>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/id.h"
#include "mlvi/solver/manifold.h"

namespace mlvi {

using VariableId = Id<struct SmootherVariableTag>;
using FactorId = Id<struct SmootherFactorTag>;

struct IncrementalSmootherConfig {
  // A variable is linearised anew when a component of its step from the linearisation point,
  // divided by the scale of the variable (AddVariable), exceeds this. Radians and metres for scale
  // 1. Early is cheap: at 0.1 cubicle.g2o needs more rounds than at 0.05, as model errors build up
  // until they are urgent.
  double relinearize_threshold = 0.05;
  // The variables of a factor are linearised anew, too, when its quadratic approximation errs by
  // more than this about its objective (a number without unit: 1 is a residual of 1.4 sigma). It
  // catches what a threshold of distance cannot know: how strongly the factor bends, and changes of
  // robust weights.
  double model_error_threshold = 0.01;
  // The steps of a clique of the Bayes tree are left as they were, and the tree below it unvisited,
  // when that costs no more than this of the linearised objective (without unit: 1 is a residual of
  // 1.4 sigma). The costs of the cliques add up to the whole, so the result is above the linear
  // optimum by at most this times the number of cliques. A threshold of distance (iSAM2's alpha)
  // cannot serve weak and strong factors alike (docs/decisions.md).
  double wildfire_threshold = 1e-4;
  // What exceeds a threshold is linearised anew by the next Update, as in iSAM2. What exceeds this
  // many times a threshold (a loop closure that moves much) is not put off: linearisation and
  // solution repeat within the Update, at most `max_rounds` times. 1 iterates every Update to
  // convergence.
  double urgency = 10.0;
  int max_rounds = 10;
};

// What one Update did.
struct IncrementalSmootherSummary {
  int rounds = 0;                  // linear solutions
  int relinearized_variables = 0;  // summed over rounds, like the counts below
  int relinearized_factors = 0;
  int reordered_variables = 0;
  int reeliminated_cliques = 0;
  int cliques = 0;  // of the tree afterwards
  // False: `max_rounds` was spent and something urgent is left to the next Update.
  bool converged = true;
  // Exceed a threshold, urgently or not, and are left to the next Update. None: further ones would
  // change nothing.
  int stale_variables = 0;
};

// Not safe for concurrent use of one instance. The same sequence of calls gives the same bits at
// any number of threads.
class IncrementalSmoother {
 public:
  explicit IncrementalSmoother(const IncrementalSmootherConfig& config = {});
  ~IncrementalSmoother();
  IncrementalSmoother(IncrementalSmoother&&) noexcept;
  IncrementalSmoother& operator=(IncrementalSmoother&&) noexcept;

  // Adds a variable whose first estimate is `value` (ambient coordinates of `manifold`; null =
  // Euclidean). `scale` holds one positive number per tangent dimension, the unit of the thresholds
  // (empty: 1). Takes part from the next Update on. Later variables are eliminated later, so add
  // them in temporal order.
  VariableId AddVariable(std::span<const double> value,
                         std::shared_ptr<const Manifold> manifold = nullptr,
                         std::span<const double> scale = {});

  // Adds the factor 1/2 loss(|cost|^2) over different `variables`, whose ambient sizes must be the
  // parameter block sizes of `cost`; null `loss` = quadratic. Takes part from the next Update on.
  FactorId AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                     std::shared_ptr<const ceres::LossFunction> loss,
                     std::span<const VariableId> variables);
  FactorId AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                     std::shared_ptr<const ceres::LossFunction> loss,
                     std::initializer_list<VariableId> variables) {
    return AddFactor(std::move(cost), std::move(loss),
                     std::span(variables.begin(), variables.size()));
  }

  // Takes the factor out with the next Update. `factor` must be present.
  void RemoveFactor(FactorId factor);

  // Brings the estimate up to date with all additions and removals.
  // Errors (kEstimation): a factor that cannot be evaluated or is not finite (named), or a variable
  // that the factors do not determine (named). Estimates are then as before the call and the
  // changes still pending: repair them (AddFactor, RemoveFactor) or drop them (DiscardPending), and
  // go on.
  Expected<IncrementalSmootherSummary> Update();

  // Forgets variables and factors added, and removals asked for, since the last successful Update.
  // Their ids become invalid and may be given again.
  void DiscardPending();

  // The current estimate in ambient coordinates; for a variable that is still pending, the value it
  // was added with. The span lives until the next non-const call.
  std::span<const double> Estimate(VariableId variable) const;

  // Covariances in the tangent space at the linearisation points of the last successful Update,
  // which must include `variables`; rows and columns in the order of `variables`.
  Eigen::MatrixXd MarginalCovariance(VariableId variable) const;
  Eigen::MatrixXd MarginalCovariance(std::span<const VariableId> variables) const;

  // 1/2 sum loss(|cost|^2) of all factors (pending ones too) at the estimate. Evaluates every
  // factor.
  double Objective() const;
  // 1/2 loss(|cost|^2) of one factor at the estimate.
  double FactorObjective(FactorId factor) const;

  int variable_count() const;
  int factor_count() const;
  bool Contains(FactorId factor) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mlvi
