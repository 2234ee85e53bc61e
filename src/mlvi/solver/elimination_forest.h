// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace mlvi::internal {

// Which columns occur together: the rows (factors, boundaries of subtrees) over columns
// 0..columns-1, concatenated.
struct Hypergraph {
  int columns = 0;
  std::vector<int> row_start = {0};  // rows + 1 entries
  std::vector<int> entries;

  int rows() const { return static_cast<int>(row_start.size()) - 1; }
  void EndRow() { row_start.push_back(static_cast<int>(entries.size())); }
};

// The cliques that elimination produces, children before parents.
struct EliminationForest {
  struct Clique {
    std::vector<int> frontal;    // columns eliminated here, in order
    std::vector<int> separator;  // columns they are joined to, in order of elimination
    int parent = -1;
  };
  std::vector<Clique> cliques;
  std::vector<int> clique_of;  // per column
  std::vector<int> position;   // per column: its place in the order of elimination
};

// Orders the columns by CCOLAMD (Davis, Gilbert, Larimore and Ng 2004), all columns of a lower
// `group` before those of a higher one (groups count from 0 without gaps), and finds the cliques.
// Small cliques are merged with their parents as long as the zeros so stored (`sizes` = dimensions
// per column) stay few.
EliminationForest AnalyzeElimination(const Hypergraph& graph, const std::vector<int>& group,
                                     const std::vector<int>& sizes);

}  // namespace mlvi::internal
