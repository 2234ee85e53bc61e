// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/elimination_forest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "mlvi/base/random.h"

namespace mlvi::internal {
namespace {

Hypergraph RandomGraph(RandomStream& random, int columns, int rows) {
  Hypergraph graph;
  graph.columns = columns;
  for (int row = 0; row < rows; ++row) {
    std::set<int> entries;
    const int size = 1 + static_cast<int>(random.Uniform() * 4);
    for (int i = 0; i < size; ++i) entries.insert(static_cast<int>(random.Uniform() * columns));
    graph.entries.insert(graph.entries.end(), entries.begin(), entries.end());
    graph.EndRow();
  }
  return graph;
}

std::set<int> Members(const EliminationForest::Clique& clique) {
  std::set<int> members(clique.frontal.begin(), clique.frontal.end());
  members.insert(clique.separator.begin(), clique.separator.end());
  return members;
}

TEST(EliminationForest, IsAJunctionForestOfTheGraph) {
  RandomStream random(1, "forest");
  for (int trial = 0; trial < 200; ++trial) {
    const int columns = 1 + static_cast<int>(random.Uniform() * 40);
    const Hypergraph graph =
        RandomGraph(random, columns, static_cast<int>(random.Uniform() * 2 * columns));
    std::vector<int> sizes(columns, 1 + trial % 6), group(columns, 0);
    const EliminationForest forest = AnalyzeElimination(graph, group, sizes);
    // Every column is eliminated exactly once.
    std::vector<int> seen(columns, 0);
    for (std::size_t c = 0; c < forest.cliques.size(); ++c) {
      for (const int column : forest.cliques[c].frontal) {
        ++seen[column];
        EXPECT_EQ(forest.clique_of[column], static_cast<int>(c));
      }
    }
    EXPECT_EQ(seen, std::vector<int>(columns, 1));
    // Children come first, and the separator lies within the parent.
    for (std::size_t c = 0; c < forest.cliques.size(); ++c) {
      const EliminationForest::Clique& clique = forest.cliques[c];
      ASSERT_EQ(clique.parent < 0, clique.separator.empty());
      if (clique.parent < 0) continue;
      EXPECT_GT(clique.parent, static_cast<int>(c));
      const std::set<int> parent = Members(forest.cliques[clique.parent]);
      EXPECT_TRUE(std::ranges::all_of(clique.separator, [&](int v) { return parent.contains(v); }));
    }
    // Every row lies within the clique of its first column.
    for (int row = 0; row < graph.rows(); ++row) {
      const auto begin = graph.entries.begin() + graph.row_start[row],
                 end = graph.entries.begin() + graph.row_start[row + 1];
      const int first = *std::min_element(
          begin, end, [&](int a, int b) { return forest.position[a] < forest.position[b]; });
      const std::set<int> members = Members(forest.cliques[forest.clique_of[first]]);
      EXPECT_TRUE(std::all_of(begin, end, [&](int v) { return members.contains(v); }));
    }
  }
}

TEST(EliminationForest, KeepsTheOrderOfGroups) {
  RandomStream random(2, "forest");
  for (const int columns : {1, 2, 3, 30}) {
    const Hypergraph graph = RandomGraph(random, columns, 3 * columns);
    std::vector<int> group(columns, 0);
    for (int i = 0; i < columns; i += 3) group[i] = columns > 1 ? 1 : 0;
    const EliminationForest forest = AnalyzeElimination(graph, group, std::vector<int>(columns, 6));
    for (int a = 0; a < columns; ++a) {
      for (int b = 0; b < columns; ++b) {
        if (group[a] < group[b]) {
          EXPECT_LT(forest.position[a], forest.position[b]);
        }
      }
    }
  }
}

TEST(EliminationForest, AChainNeedsNoFill) {
  Hypergraph graph;
  graph.columns = 200;
  for (int i = 0; i + 1 < graph.columns; ++i) {
    graph.entries.insert(graph.entries.end(), {i, i + 1});
    graph.EndRow();
  }
  std::vector<int> group(graph.columns, 0);
  group.back() = 1;
  const EliminationForest forest =
      AnalyzeElimination(graph, group, std::vector<int>(graph.columns, 6));
  EXPECT_EQ(forest.position.back(), graph.columns - 1);
  for (const EliminationForest::Clique& clique : forest.cliques)
    EXPECT_LE(clique.separator.size(), 2u);
}

}  // namespace
}  // namespace mlvi::internal
