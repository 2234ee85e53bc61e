// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Elimination of the dirty cliques of the Bayes tree. Subtrees do not depend on one another, so
// they are eliminated in parallel; every clique adds its factors and children in the order of its
// lists, so no sum depends on the schedule.
#include <algorithm>
#include <atomic>

#include "mlvi/base/parallel.h"
#include "mlvi/solver/bayes_tree.h"

namespace mlvi::internal {
namespace {

// A pivot below this part of the information that went into its variable is round-off: the variable
// is undetermined.
constexpr double kSingularPivot = 1e-14;
// Arithmetic of a subtree, in multiplications, that is worth a task of its own: some tens of
// microseconds.
constexpr double kTaskCost = 2e5;

double Cost(int frontal, int separator) {
  const double rows = frontal + separator + 1;
  return frontal * rows * rows + 1000.0;  // with the loop overhead of a clique
}

}  // namespace

// The dirty cliques, parents before children.
std::vector<int> BayesTree::DirtyTopDown() const {
  std::vector<int> order;
  for (const int root : roots_) {
    if (cliques_[root].dirty) order.push_back(root);
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (const int child : cliques_[order[i]].children) {
      if (cliques_[child].dirty) order.push_back(child);
    }
  }
  return order;
}

// Splits the dirty cliques into subtrees too small to be worth splitting, and the cliques above
// them.
BayesTree::Schedule BayesTree::PlanElimination() {
  Schedule schedule;
  schedule.order = DirtyTopDown();
  const std::size_t count = schedule.order.size();
  place_.resize(cliques_.size());
  for (std::size_t i = 0; i < count; ++i) place_[schedule.order[i]] = static_cast<int>(i);
  std::vector<double> cost(count, 0.0);
  std::vector<int> waiting(count, 0);
  for (std::size_t i = count; i-- > 0;) {
    const Clique& clique = cliques_[schedule.order[i]];
    cost[i] += Cost(clique.frontal, clique.separator);
    if (clique.parent < 0) continue;
    cost[place_[clique.parent]] += cost[i];
    ++waiting[place_[clique.parent]];
  }
  std::vector<int> subtree_of(count, -1);
  for (std::size_t i = 0; i < count; ++i) {
    const int parent = cliques_[schedule.order[i]].parent;
    const int above = parent < 0 ? -1 : subtree_of[place_[parent]];
    if (above >= 0) {
      subtree_of[i] = above;
      schedule.subtrees[above].push_back(schedule.order[i]);
    } else if (cost[i] <= kTaskCost || waiting[i] == 0) {
      subtree_of[i] = static_cast<int>(schedule.subtrees.size());
      schedule.subtrees.push_back({schedule.order[i]});
    }
  }
  schedule.waiting = std::move(waiting);
  return schedule;
}

BayesTree::Elimination BayesTree::Eliminate() {
  const Schedule schedule = PlanElimination();
  std::vector<int> singular(schedule.order.size(), -1);
  std::vector<std::atomic<int>> waiting(schedule.order.size());
  for (std::size_t i = 0; i < waiting.size(); ++i) waiting[i] = schedule.waiting[i];
  const auto eliminate = [&](int c, AlignedBuffer* hessian) {
    singular[place_[c]] = EliminateClique(c, hessian);
  };
  ParallelFor(schedule.subtrees.size(), 1, [&](std::size_t s) {
    AlignedBuffer hessian;
    const std::vector<int>& subtree = schedule.subtrees[s];
    for (auto it = subtree.rbegin(); it != subtree.rend(); ++it) eliminate(*it, &hessian);
    // Whoever finishes the last child of a clique goes on with the clique.
    for (int c = cliques_[subtree.front()].parent; c >= 0 && --waiting[place_[c]] == 0;
         c = cliques_[c].parent) {
      eliminate(c, &hessian);
    }
  });

  Elimination result{.cliques = static_cast<int>(schedule.order.size()),
                     .singular_variable = std::nullopt};
  // The deepest one: what is above it has been spoilt by it.
  const auto bad = std::find_if(singular.rbegin(), singular.rend(), [](int v) { return v >= 0; });
  if (bad != singular.rend()) {
    result.singular_variable = *bad;
    return result;
  }
  for (const int c : dirty_) cliques_[c].dirty = false;
  dirty_.clear();
  return result;
}

// Sums the factors of the clique and the remainders of its children in its front.
void BayesTree::Assemble(Clique* clique, AlignedBuffer* hessian) {
  clique->panel.Reserve(clique->front().panel_size());
  clique->remainder.Reserve(clique->front().remainder_size());
  clique->diagonal.assign(clique->frontal + clique->separator, 0.0);
  const Front front = clique->front();
  ZeroFront(front);
  for (const int f : clique->factors) {
    const Factor& factor = factors_[f];
    const int count = static_cast<int>(factor.variables.size()), stride = factor.stride();
    hessian->Reserve(static_cast<std::size_t>(factor.dimension()) * stride);
    FormHessian(factor.augmented.data(), factor.rows, factor.dimension(), stride, hessian->data());
    AddSymmetric(hessian->data(), stride, factor.start.data(), factor.coordinate.data(), count,
                 front);
    for (int i = 0; i < count; ++i) {
      double* diagonal = clique->diagonal.data() + factor.coordinate[i];
      for (int k = factor.start[i]; k < factor.start[i + 1]; ++k)
        *diagonal++ += hessian->data()[k * (stride + 1)];
    }
  }
  for (const int c : clique->children) {
    Clique& child = cliques_[c];
    AddChild(child.front(), child.runs.data(), static_cast<int>(child.runs.size()), front);
    for (const FrontRun& run : child.runs) {
      const double* in = child.diagonal.data() + child.frontal + run.child;
      for (int k = 0; k < run.size; ++k) clique->diagonal[run.parent + k] += in[k];
    }
  }
}

// Returns the variable at which the system is singular, or -1.
int BayesTree::EliminateClique(int c, AlignedBuffer* hessian) {
  Clique& clique = cliques_[c];
  Assemble(&clique, hessian);
  const int bad = FactorizeFront(clique.front(), clique.diagonal.data(), kSingularPivot);
  if (bad < 0) return -1;
  int end = 0;
  for (const int v : clique.variables) {
    end += variables_.tangent_size(v);
    if (bad < end) return v;
  }
  return clique.variables.front();
}

}  // namespace mlvi::internal
