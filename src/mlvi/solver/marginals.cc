// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Marginal covariances from the Bayes tree. The columns of H^-1 that belong to a variable need the
// Cholesky factor only between its clique and the root: L y = e stays zero elsewhere, and L^T x = y
// is wanted only there.
#include <Eigen/Cholesky>
#include <algorithm>

#include "mlvi/solver/bayes_tree.h"

namespace mlvi::internal {

// Cliques on the paths from `variables` to the roots, children before parents.
std::vector<int> BayesTree::PathsToRoots(const std::vector<int>& variables) const {
  std::vector<std::pair<int, int>> by_depth;  // (-depth, clique)
  for (const int v : variables) {
    int depth = 0;
    for (int c = clique_of_[v]; c >= 0; c = cliques_[c].parent) ++depth;
    for (int c = clique_of_[v]; c >= 0; c = cliques_[c].parent) by_depth.emplace_back(-depth--, c);
  }
  std::ranges::sort(by_depth);
  by_depth.erase(std::unique(by_depth.begin(), by_depth.end()), by_depth.end());
  std::vector<int> cliques;
  for (const auto& [depth, c] : by_depth) cliques.push_back(c);
  return cliques;
}

Eigen::MatrixXd BayesTree::Covariance(const std::vector<int>& variables) const {
  using Eigen::MatrixXd;
  const std::vector<int> cliques = PathsToRoots(variables);
  std::vector<int> row(variables_.size(), -1);  // of the frontal variables of the paths
  int rows = 0, columns = 0;
  for (const int c : cliques) {
    for (int i = 0; i < cliques_[c].frontal_count; ++i) {
      row[cliques_[c].variables[i]] = rows;
      rows += variables_.tangent_size(cliques_[c].variables[i]);
    }
  }
  for (const int v : variables) columns += variables_.tangent_size(v);
  MatrixXd X = MatrixXd::Zero(rows, columns);
  int column = 0;
  for (const int v : variables) {
    const int size = variables_.tangent_size(v);
    X.block(row[v], column, size, size).setIdentity();
    column += size;
  }

  const auto panel = [&](const Clique& clique) {
    const int below = PadRows(clique.frontal);
    return Eigen::Map<const MatrixXd>(clique.panel.data(), below + PadRows(clique.separator + 1),
                                      clique.frontal);
  };
  // Forward, L y = e, then backward, L^T x = y; the separator of a path's clique is frontal in
  // cliques of the path.
  for (const int c : cliques) {
    const Clique& clique = cliques_[c];
    const auto L = panel(clique);
    auto y = X.middleRows(row[clique.variables.front()], clique.frontal);
    L.topRows(clique.frontal).triangularView<Eigen::Lower>().solveInPlace(y);
    int offset = PadRows(clique.frontal);
    for (std::size_t i = clique.frontal_count; i < clique.variables.size(); ++i) {
      const int v = clique.variables[i], size = variables_.tangent_size(v);
      X.middleRows(row[v], size).noalias() -= L.middleRows(offset, size) * y;
      offset += size;
    }
  }
  for (auto it = cliques.rbegin(); it != cliques.rend(); ++it) {
    const Clique& clique = cliques_[*it];
    const auto L = panel(clique);
    auto x = X.middleRows(row[clique.variables.front()], clique.frontal);
    int offset = PadRows(clique.frontal);
    for (std::size_t i = clique.frontal_count; i < clique.variables.size(); ++i) {
      const int v = clique.variables[i], size = variables_.tangent_size(v);
      x.noalias() -= L.middleRows(offset, size).transpose() * X.middleRows(row[v], size);
      offset += size;
    }
    L.topRows(clique.frontal).triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  }

  MatrixXd covariance(columns, columns);
  int next = 0;
  for (const int v : variables) {
    const int size = variables_.tangent_size(v);
    covariance.middleRows(next, size) = X.middleRows(row[v], size);
    next += size;
  }
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace mlvi::internal
