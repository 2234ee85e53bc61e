// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/incremental_smoother.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mlvi/base/parallel.h"
#include "mlvi/solver/bayes_tree.h"
#include "mlvi/solver/factor_table.h"
#include "mlvi/solver/variable_table.h"

namespace mlvi {
namespace {

// Factors per chunk of the parallel linearisation.
constexpr std::size_t kFactorGrain = 64;

void SortUnique(std::vector<int>* values) {
  std::ranges::sort(*values);
  values->erase(std::unique(values->begin(), values->end()), values->end());
}

}  // namespace

class IncrementalSmoother::Impl {
 public:
  explicit Impl(const IncrementalSmootherConfig& config)
      : config_(config), tree_(&variables_, &factors_) {
    MLVI_CHECK(config.relinearize_threshold > 0.0, "relinearize_threshold {}",
               config.relinearize_threshold);
    MLVI_CHECK(config.urgency >= 1.0, "urgency {}", config.urgency);
    MLVI_CHECK(config.model_error_threshold > 0.0, "model_error_threshold {}",
               config.model_error_threshold);
    MLVI_CHECK(config.wildfire_threshold >= 0.0, "wildfire_threshold {}",
               config.wildfire_threshold);
    MLVI_CHECK(config.max_rounds >= 1, "max_rounds {}", config.max_rounds);
  }

  VariableId AddVariable(std::span<const double> value, std::shared_ptr<const Manifold> manifold,
                         std::span<const double> scale) {
    factors_of_.emplace_back();
    return VariableId(variables_.Add(value, std::move(manifold), scale));
  }

  FactorId AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                     std::shared_ptr<const ceres::LossFunction> loss,
                     std::span<const VariableId> variables);
  void RemoveFactor(FactorId factor);
  Expected<IncrementalSmootherSummary> Update();
  void DiscardPending();

  const internal::VariableTable& variables() const { return variables_; }
  int CheckedIndex(VariableId id) const {
    MLVI_CHECK(id.value() >= 0 && id.value() < variables_.size(), "variable {} of {}", id.value(),
               variables_.size());
    return static_cast<int>(id.value());
  }
  bool Contains(FactorId id) const {
    return id.value() >= 0 && id.value() < static_cast<std::int64_t>(factors_.size()) &&
           factors_[id.value()].alive() && !is_removed_[id.value()];
  }
  int factor_count() const { return factor_count_; }

  Eigen::MatrixXd Covariance(std::span<const VariableId> ids) const;
  double Objective() const;
  double FactorObjective(FactorId id) const;

 private:
  // The factors that one round linearises anew, without repetition.
  std::vector<int> FactorsOf(const std::vector<int>& moved);
  std::optional<Error> Linearize(const std::vector<int>& factors);
  std::vector<int> FindStale(const std::vector<int>& changed);
  std::optional<Error> Relinearize(const std::vector<int>& variables,
                                   IncrementalSmootherSummary* summary);
  void Save(const std::vector<int>& variables);
  std::optional<Error> Iterate(IncrementalSmootherSummary* summary);
  void Commit();
  void Restore(const std::vector<int>& touched);
  Error Describe(int factor) const;

  IncrementalSmootherConfig config_;
  internal::VariableTable variables_;
  std::vector<internal::Factor> factors_;
  std::vector<std::vector<int>> factors_of_;  // per variable
  internal::BayesTree tree_;
  // What the last successful Update knew, and what was taken away since.
  int committed_variables_ = 0, committed_factors_ = 0;
  std::vector<int> pending_removals_;
  std::vector<char> is_removed_;   // per factor
  std::vector<char> factor_mark_;  // scratch per factor
  std::vector<char> is_stale_;     // scratch per variable, all zero between calls
  bool is_urgent_ = false;
  // Estimates before the Update of the variables that it has moved, in case it fails.
  std::vector<int> saved_;
  std::vector<double> saved_estimates_;
  std::vector<char> is_saved_;  // per variable
  // Variables that the last Update should have linearised anew, had it had more rounds.
  std::vector<int> stale_;
  int factor_count_ = 0;
};

FactorId IncrementalSmoother::Impl::AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                                              std::shared_ptr<const ceres::LossFunction> loss,
                                              std::span<const VariableId> variables) {
  MLVI_CHECK(cost != nullptr, "a factor without cost function");
  const std::vector<std::int32_t>& sizes = cost->parameter_block_sizes();
  MLVI_CHECK(sizes.size() == variables.size(), "{} variables for {} parameter blocks",
             variables.size(), sizes.size());
  internal::Factor factor;
  factor.start = {0};
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const int v = CheckedIndex(variables[i]);
    MLVI_CHECK(variables_.ambient_size(v) == sizes[i],
               "variable {} has size {}, block {} of the factor {}", v, variables_.ambient_size(v),
               i, sizes[i]);
    MLVI_CHECK(std::ranges::find(factor.variables, v) == factor.variables.end(),
               "variable {} twice in a factor", v);
    factor.variables.push_back(v);
    factor.start.push_back(factor.start.back() + variables_.tangent_size(v));
  }
  const int index = static_cast<int>(factors_.size());
  for (const int v : factor.variables) factors_of_[v].push_back(index);
  factor.cost = std::move(cost);
  factor.loss = std::move(loss);
  factors_.push_back(std::move(factor));
  is_removed_.push_back(0);
  ++factor_count_;
  return FactorId(index);
}

void IncrementalSmoother::Impl::RemoveFactor(FactorId id) {
  MLVI_CHECK(Contains(id), "factor {} is not present", id.value());
  is_removed_[id.value()] = 1;
  pending_removals_.push_back(static_cast<int>(id.value()));
  --factor_count_;
}

Error IncrementalSmoother::Impl::Describe(int factor) const {
  std::string names;
  for (const int v : factors_[factor].variables)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", v);
  return Error{ErrorKind::kEstimation,
               fmt::format("factor {} between variables {} cannot be evaluated or gives a number "
                           "that is not finite; "
                           "check its measurement and the values of its variables, or remove it",
                           factor, names)};
}

std::vector<int> IncrementalSmoother::Impl::FactorsOf(const std::vector<int>& moved) {
  factor_mark_.resize(factors_.size(), 0);
  std::vector<int> factors;
  for (const int v : moved) {
    for (const int f : factors_of_[v]) {
      if (factors_[f].clique < 0 || is_removed_[f] || factor_mark_[f]) continue;
      factor_mark_[f] = 1;
      factors.push_back(f);
    }
  }
  for (const int f : factors) factor_mark_[f] = 0;
  return factors;
}

std::optional<Error> IncrementalSmoother::Impl::Linearize(const std::vector<int>& factors) {
  std::vector<char> failed(factors.size(), 0);
  ParallelForChunks(factors.size(), kFactorGrain, [&](std::size_t begin, std::size_t end) {
    internal::FactorWorkspace workspace;
    for (std::size_t i = begin; i < end; ++i)
      failed[i] = !workspace.Linearize(variables_, &factors_[factors[i]]);
  });
  const auto bad = std::ranges::find(failed, 1);
  if (bad == failed.end()) return std::nullopt;
  return Describe(factors[bad - failed.begin()]);
}

// The variables that must be linearised anew after the steps of `changed` have changed.
std::vector<int> IncrementalSmoother::Impl::FindStale(const std::vector<int>& changed) {
  is_stale_.resize(variables_.size(), 0);
  is_urgent_ = false;
  std::vector<int> stale;
  const auto add = [&](int v) {
    if (is_stale_[v]) return;
    is_stale_[v] = 1;
    stale.push_back(v);
  };
  for (const int v : changed) {
    const double step = variables_.ScaledStep(v) / config_.relinearize_threshold;
    if (step > 1.0) add(v);
    is_urgent_ |= step > config_.urgency;
  }
  const std::vector<int> factors = FactorsOf(changed);
  std::vector<char> errs(factors.size(), 0), urgent(factors.size(), 0);
  ParallelForChunks(factors.size(), kFactorGrain, [&](std::size_t begin, std::size_t end) {
    internal::FactorWorkspace workspace;
    for (std::size_t i = begin; i < end; ++i) {
      const internal::Factor& factor = factors_[factors[i]];
      if (std::ranges::all_of(factor.variables, [&](int v) { return is_stale_[v] != 0; })) continue;
      const double error = workspace.ModelError(variables_, factor) / config_.model_error_threshold;
      errs[i] = !(error <= 1.0);  // also NaN
      urgent[i] = !(error <= config_.urgency);
    }
  });
  is_urgent_ |= std::ranges::any_of(urgent, [](char u) { return u != 0; });
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (!errs[i]) continue;
    for (const int v : factors_[factors[i]].variables) {
      if (variables_.ScaledStep(v) > 0.0) add(v);
    }
  }
  for (const int v : stale) is_stale_[v] = 0;
  std::ranges::sort(stale);
  return stale;
}

Expected<IncrementalSmootherSummary> IncrementalSmoother::Impl::Update() {
  std::vector<int> added;
  for (int f = committed_factors_; f < static_cast<int>(factors_.size()); ++f) {
    if (!is_removed_[f]) added.push_back(f);
  }
  if (std::optional<Error> error = Linearize(added)) return tl::unexpected(*error);

  IncrementalSmootherSummary summary;
  std::vector<int> touched;
  for (int v = committed_variables_; v < variables_.size(); ++v) touched.push_back(v);
  for (const std::vector<int>* changed : {&added, &pending_removals_}) {
    for (const int f : *changed) {
      touched.insert(touched.end(), factors_[f].variables.begin(), factors_[f].variables.end());
    }
  }
  SortUnique(&touched);
  // Removed factors vanish from the tree, but can come back (DiscardPending) until the update has
  // succeeded.
  std::vector<std::shared_ptr<const ceres::CostFunction>> removed;
  for (const int f : pending_removals_) removed.push_back(std::move(factors_[f].cost));
  // All variables of new factors go last, as the next factors will most likely touch them again.
  if (!touched.empty()) summary.reordered_variables = tree_.Restructure(touched, added, touched);

  if (std::optional<Error> error = Iterate(&summary)) {
    for (std::size_t i = 0; i < removed.size(); ++i)
      factors_[pending_removals_[i]].cost = std::move(removed[i]);
    Restore(touched);
    return tl::unexpected(*error);
  }
  Commit();
  summary.cliques = tree_.clique_count();
  return summary;
}

// Moves linearisation points to the estimates.
std::optional<Error> IncrementalSmoother::Impl::Relinearize(const std::vector<int>& variables,
                                                            IncrementalSmootherSummary* summary) {
  for (const int v : variables) variables_.MoveLinearizationToEstimate(v);
  const std::vector<int> factors = FactorsOf(variables);
  for (const int f : factors) tree_.MarkDirty(factors_[f].clique);
  summary->relinearized_variables += static_cast<int>(variables.size());
  summary->relinearized_factors += static_cast<int>(factors.size());
  return Linearize(factors);
}

void IncrementalSmoother::Impl::Save(const std::vector<int>& variables) {
  is_saved_.resize(variables_.size(), 0);
  for (const int v : variables) {
    if (is_saved_[v]) continue;
    is_saved_[v] = 1;
    saved_.push_back(v);
    const double* estimate = variables_.estimate(v);
    saved_estimates_.insert(saved_estimates_.end(), estimate,
                            estimate + variables_.ambient_size(v));
  }
}

std::optional<Error> IncrementalSmoother::Impl::Iterate(IncrementalSmootherSummary* summary) {
  for (const int v : saved_) is_saved_[v] = 0;
  saved_.clear();
  saved_estimates_.clear();
  // Staleness outlives an update that did not touch the variable.
  std::vector<int> moved = std::exchange(stale_, {});
  do {
    ++summary->rounds;
    if (std::optional<Error> error = Relinearize(moved, summary)) return error;
    const internal::BayesTree::Elimination elimination = tree_.Eliminate();
    summary->reeliminated_cliques += elimination.cliques;
    if (elimination.singular_variable) {
      return Error{
          ErrorKind::kEstimation,
          fmt::format(
              "the factors do not determine variable {}: add a prior or the missing factors",
              *elimination.singular_variable)};
    }
    const std::vector<int>& changed = tree_.Solve(config_.wildfire_threshold);
    Save(changed);
    ParallelFor(changed.size(), kFactorGrain,
                [&](std::size_t i) { variables_.UpdateEstimate(changed[i]); });
    moved = FindStale(changed);
  } while (is_urgent_ && summary->rounds < config_.max_rounds);
  summary->converged = !is_urgent_;
  summary->stale_variables = static_cast<int>(moved.size());
  stale_ = std::move(moved);
  return std::nullopt;
}

void IncrementalSmoother::Impl::Commit() {
  for (const int f : pending_removals_) {
    for (const int v : factors_[f].variables) std::erase(factors_of_[v], f);
    factors_[f] = internal::Factor{};
  }
  pending_removals_.clear();
  committed_variables_ = variables_.size();
  committed_factors_ = static_cast<int>(factors_.size());
}

// Back to the state of the last successful Update, with the same estimates; what the failed one,
// which had `touched` variables, moved is linearised there anew. Costs no more than that did.
void IncrementalSmoother::Impl::Restore(const std::vector<int>& touched) {
  const double* estimate = saved_estimates_.data();
  for (const int v : saved_) {
    variables_.Restore(v, estimate);
    estimate += variables_.ambient_size(v);
  }
  // A factor may have been removed before it was ever committed.
  std::vector<int> returned = pending_removals_;
  std::erase_if(returned, [&](int f) { return f >= committed_factors_; });
  tree_.Withdraw(touched, returned, committed_variables_, committed_factors_);
  std::erase_if(saved_, [&](int v) {
    if (v >= committed_variables_) is_saved_[v] = 0;
    return v >= committed_variables_;
  });
  IncrementalSmootherSummary unused;
  // A factor that cannot be evaluated even at the estimate keeps its last approximation.
  (void)Relinearize(saved_, &unused);
  (void)Linearize(returned);
  (void)tree_.Eliminate();
}

void IncrementalSmoother::Impl::DiscardPending() {
  for (const int f : pending_removals_) {
    is_removed_[f] = 0;
    ++factor_count_;
  }
  pending_removals_.clear();
  for (int f = static_cast<int>(factors_.size()) - 1; f >= committed_factors_; --f) {
    for (const int v : factors_[f].variables) std::erase(factors_of_[v], f);
    --factor_count_;
  }
  factors_.resize(committed_factors_);
  is_removed_.resize(committed_factors_);
  variables_.Truncate(committed_variables_);
  factors_of_.resize(committed_variables_);
}

Eigen::MatrixXd IncrementalSmoother::Impl::Covariance(std::span<const VariableId> ids) const {
  std::vector<int> variables;
  for (const VariableId id : ids) {
    const int v = CheckedIndex(id);
    MLVI_CHECK(v < committed_variables_, "variable {} has no covariance before the next Update", v);
    MLVI_CHECK(std::ranges::find(variables, v) == variables.end(), "variable {} given twice", v);
    variables.push_back(v);
  }
  return tree_.Covariance(variables);
}

double IncrementalSmoother::Impl::FactorObjective(FactorId id) const {
  MLVI_CHECK(Contains(id), "factor {} is not present", id.value());
  return internal::FactorWorkspace().Objective(variables_, factors_[id.value()]);
}

double IncrementalSmoother::Impl::Objective() const {
  internal::FactorWorkspace workspace;
  double sum = 0.0;
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    if (factors_[f].alive() && !is_removed_[f]) sum += workspace.Objective(variables_, factors_[f]);
  }
  return sum;
}

IncrementalSmoother::IncrementalSmoother(const IncrementalSmootherConfig& config)
    : impl_(std::make_unique<Impl>(config)) {}
IncrementalSmoother::~IncrementalSmoother() = default;
IncrementalSmoother::IncrementalSmoother(IncrementalSmoother&&) noexcept = default;
IncrementalSmoother& IncrementalSmoother::operator=(IncrementalSmoother&&) noexcept = default;

VariableId IncrementalSmoother::AddVariable(std::span<const double> value,
                                            std::shared_ptr<const Manifold> manifold,
                                            std::span<const double> scale) {
  return impl_->AddVariable(value, std::move(manifold), scale);
}
FactorId IncrementalSmoother::AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                                        std::shared_ptr<const ceres::LossFunction> loss,
                                        std::span<const VariableId> variables) {
  return impl_->AddFactor(std::move(cost), std::move(loss), variables);
}
void IncrementalSmoother::RemoveFactor(FactorId factor) { impl_->RemoveFactor(factor); }
Expected<IncrementalSmootherSummary> IncrementalSmoother::Update() { return impl_->Update(); }
void IncrementalSmoother::DiscardPending() { impl_->DiscardPending(); }
std::span<const double> IncrementalSmoother::Estimate(VariableId variable) const {
  const int v = impl_->CheckedIndex(variable);
  return {impl_->variables().estimate(v),
          static_cast<std::size_t>(impl_->variables().ambient_size(v))};
}
Eigen::MatrixXd IncrementalSmoother::MarginalCovariance(VariableId variable) const {
  return impl_->Covariance(std::span(&variable, 1));
}
Eigen::MatrixXd IncrementalSmoother::MarginalCovariance(
    std::span<const VariableId> variables) const {
  return impl_->Covariance(variables);
}
double IncrementalSmoother::Objective() const { return impl_->Objective(); }
double IncrementalSmoother::FactorObjective(FactorId factor) const {
  return impl_->FactorObjective(factor);
}
int IncrementalSmoother::variable_count() const { return impl_->variables().size(); }
int IncrementalSmoother::factor_count() const { return impl_->factor_count(); }
bool IncrementalSmoother::Contains(FactorId factor) const { return impl_->Contains(factor); }

}  // namespace mlvi
