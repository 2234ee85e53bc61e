// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Solution for the steps from the roots of the Bayes tree down. Cliques read the steps of their
// ancestors and write their own, so the subtrees below a clique are independent.
#include <algorithm>
#include <deque>

#include "mlvi/base/parallel.h"
#include "mlvi/solver/bayes_tree.h"

namespace mlvi::internal {
namespace {

// The tree is followed breadth first until this many subtrees wait, which are then solved in
// parallel: enough to balance the load of a few threads. It must not depend on their number, as it
// decides the order of the result.
constexpr std::size_t kSubtrees = 32;

}  // namespace

// Returns false if the steps were left alone, and with them the subtree.
bool BayesTree::SolveClique(int c, double tolerance, SolveWorkspace* workspace) {
  Clique& clique = cliques_[c];
  const bool reached = clique.solve || std::any_of(clique.variables.begin() + clique.frontal_count,
                                                   clique.variables.end(),
                                                   [&](int v) { return is_changed_[v] != 0; });
  if (!reached) return false;
  clique.solve = false;
  const Front front = clique.front();
  workspace->separator.Reset(front.remainder_stride());
  workspace->frontal.resize(2 * clique.frontal);
  double *old_step = workspace->frontal.data(), *separator = workspace->separator.data();
  double* const step = old_step + clique.frontal;
  for (std::size_t i = 0; i < clique.variables.size(); ++i) {
    const int v = clique.variables[i];
    double*& next = static_cast<int>(i) < clique.frontal_count ? old_step : separator;
    next = std::copy_n(variables_.delta(v), variables_.tangent_size(v), next);
  }
  if (!SolveFront(front, workspace->separator.data(), tolerance, workspace->frontal.data(), step))
    return true;
  const double* next = step;
  for (int i = 0; i < clique.frontal_count; ++i) {
    const int v = clique.variables[i];
    std::copy_n(next, variables_.tangent_size(v), variables_.delta(v));
    next += variables_.tangent_size(v);
    is_changed_[v] = 1;
    workspace->changed.push_back(v);
  }
  return true;
}

void BayesTree::SolveSubtree(int root, double tolerance, SolveWorkspace* workspace) {
  std::vector<int> stack = {root};
  while (!stack.empty()) {
    const int c = stack.back();
    stack.pop_back();
    if (!SolveClique(c, tolerance, workspace)) continue;
    stack.insert(stack.end(), cliques_[c].children.rbegin(), cliques_[c].children.rend());
  }
}

const std::vector<int>& BayesTree::Solve(double tolerance) {
  for (const int v : changed_) is_changed_[v] = 0;
  SolveWorkspace top;
  std::deque<int> queue(roots_.begin(), roots_.end());
  while (!queue.empty() && queue.size() < kSubtrees) {
    const int c = queue.front();
    queue.pop_front();
    if (!SolveClique(c, tolerance, &top)) continue;
    queue.insert(queue.end(), cliques_[c].children.begin(), cliques_[c].children.end());
  }
  std::vector<SolveWorkspace> workspaces(queue.size());
  ParallelFor(queue.size(), 1,
              [&](std::size_t i) { SolveSubtree(queue[i], tolerance, &workspaces[i]); });
  changed_ = std::move(top.changed);
  for (const SolveWorkspace& workspace : workspaces) {
    changed_.insert(changed_.end(), workspace.changed.begin(), workspace.changed.end());
  }
  return changed_;
}

}  // namespace mlvi::internal
