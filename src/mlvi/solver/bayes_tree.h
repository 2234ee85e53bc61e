// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "mlvi/solver/elimination_forest.h"
#include "mlvi/solver/factor_table.h"
#include "mlvi/solver/variable_table.h"

namespace mlvi::internal {

// The Bayes tree of iSAM2 (Kaess et al. 2012, section 3) in information form: every clique holds
// its part of the Cholesky factor and the Schur complement that it hands to its parent, so that any
// top of the tree can be eliminated anew from its own factors and the Schur complements of the
// subtrees that hang below it.
class BayesTree {
 public:
  // Borrows both tables, which the owner may extend between calls.
  BayesTree(VariableTable* variables, std::vector<Factor>* factors)
      : variables_(*variables), factors_(*factors) {}

  // Changes the structure (iSAM2, algorithm 3): takes out all cliques between the variables
  // `touched` and the roots, and orders the variables of those cliques anew, together with the
  // variables of `touched` that were not in the tree, the factors `added`, and without factors that
  // are no longer alive. Variables in `newest` are eliminated last. New cliques are dirty. Returns
  // the number of variables ordered.
  int Restructure(const std::vector<int>& touched, const std::vector<int>& added,
                  const std::vector<int>& newest);
  // Undoes a Restructure of `touched` whose variables from `variable_count` on and factors from
  // `factor_count` on shall not be in the tree after all, while the factors `returned` shall: takes
  // out the same part of the tree and orders it anew without the ones and with the others.
  void Withdraw(const std::vector<int>& touched, const std::vector<int>& returned,
                int variable_count, int factor_count);
  // The clique must be eliminated again, and so must all above it.
  void MarkDirty(int clique);

  struct Elimination {
    int cliques = 0;
    // No steps exist then, and what was dirty still is.
    std::optional<int> singular_variable;
  };
  // Eliminates all dirty cliques, children before parents, independent subtrees in parallel.
  Elimination Eliminate();

  // Solves for the steps, from the roots down, in the cliques eliminated since the last call and
  // wherever a step above changed (iSAM2, section 5.2 "partial state updates"). The steps of a
  // clique are left alone when this costs no more than `tolerance` of the linearised objective,
  // which is the sum of such costs over the cliques: the result is above the linear optimum by at
  // most clique_count() * `tolerance`. Returns the variables whose steps changed.
  const std::vector<int>& Solve(double tolerance);

  // Covariance of the steps of `variables` (tangent space at the linearisation points).
  Eigen::MatrixXd Covariance(const std::vector<int>& variables) const;

  int clique_count() const { return static_cast<int>(cliques_.size() - free_.size()); }

 private:
  struct Clique {
    std::vector<int> variables;  // frontal ones first
    int frontal_count = 0;
    int frontal = 0, separator = 0;  // dimensions
    int parent = -1;
    std::vector<int> children, factors;
    std::vector<FrontRun> runs;  // of the separator in the parent's front
    AlignedBuffer panel, remainder;
    // Per dimension of the front: the sum of the diagonals of all factors of this subtree, by which
    // pivots are judged.
    std::vector<double> diagonal;
    bool dirty = false, solve = false, removed = false;

    Front front() {
      return {.frontal = frontal,
              .separator = separator,
              .panel = panel.data(),
              .remainder = remainder.data()};
    }
  };
  // The top of the tree that a Restructure takes out.
  struct Top {
    std::vector<int> variables, factors, orphans;
  };

  void Resize();
  Top Detach(const std::vector<int>& touched);
  int Rebuild(const Top& top, const std::vector<int>& newest);
  Hypergraph BuildHypergraph(const Top& top);
  void Attach(const Top& top, const EliminationForest& forest);
  void AddCliques(const Top& top, const EliminationForest& forest, std::vector<int>* index);
  void PlaceCoordinates(Clique* clique);
  int FirstEliminated(const int* begin, const int* end, const EliminationForest& forest) const;
  int NewClique();

  struct Schedule {
    std::vector<int> order;                  // dirty cliques, parents first
    std::vector<int> waiting;                // per place in `order`: dirty children
    std::vector<std::vector<int>> subtrees;  // cliques of each, parents first
  };
  std::vector<int> DirtyTopDown() const;
  Schedule PlanElimination();
  int EliminateClique(int c, AlignedBuffer* hessian);
  void Assemble(Clique* clique, AlignedBuffer* hessian);

  struct SolveWorkspace {
    AlignedBuffer separator;
    std::vector<double> frontal;  // old steps, then new ones
    std::vector<int> changed;
  };
  bool SolveClique(int c, double tolerance, SolveWorkspace* workspace);
  void SolveSubtree(int root, double tolerance, SolveWorkspace* workspace);
  std::vector<int> PathsToRoots(const std::vector<int>& variables) const;

  VariableTable& variables_;
  std::vector<Factor>& factors_;
  std::vector<Clique> cliques_;
  std::vector<int> free_, roots_, dirty_;
  std::vector<int> clique_of_;  // per variable: where it is frontal
  std::vector<int> local_;      // scratch per variable
  std::vector<int> place_;      // scratch per clique: among the dirty ones
  std::vector<int> changed_;
  std::vector<char> is_changed_;
};

}  // namespace mlvi::internal
