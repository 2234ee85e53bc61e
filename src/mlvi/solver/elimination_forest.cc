// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/elimination_forest.h"

#include <ccolamd.h>

#include <algorithm>
#include <numeric>

#include "mlvi/base/error.h"

namespace mlvi::internal {
namespace {

// Merging a clique into its parent may add zeros up to this part of the merged panel, and always
// when the zeros are fewer than kFreeZeros: below that the loop overhead of a clique costs more
// than the arithmetic.
constexpr double kZeroPart = 0.15;
constexpr int kFreeZeros = 100;
// Larger cliques would be eliminated anew as a whole whenever one of their variables moves.
constexpr int kMergedFrontal = 48;

std::vector<int> Order(const Hypergraph& graph, std::vector<int> group) {
  std::vector<int> order(graph.columns);
  std::iota(order.begin(), order.end(), 0);
  if (graph.columns < 3) {
    std::ranges::stable_sort(order, {}, [&](int column) { return group[column]; });
    return order;
  }
  // CCOLAMD takes the pattern column-wise.
  std::vector<int> start(graph.columns + 1, 0);
  for (const int column : graph.entries) ++start[column + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  const int entries = start.back();
  std::vector<int> pattern(ccolamd_recommended(entries, graph.rows(), graph.columns));
  std::vector<int> next(start.begin(), start.end() - 1);
  for (int row = 0; row < graph.rows(); ++row) {
    for (int i = graph.row_start[row]; i < graph.row_start[row + 1]; ++i)
      pattern[next[graph.entries[i]]++] = row;
  }
  double knobs[CCOLAMD_KNOBS];
  int statistics[CCOLAMD_STATS];
  ccolamd_set_defaults(knobs);
  // Boundaries are dense rows and must count.
  knobs[CCOLAMD_DENSE_ROW] = knobs[CCOLAMD_DENSE_COL] = -1.0;
  const int ok = ccolamd(graph.rows(), graph.columns, static_cast<int>(pattern.size()),
                         pattern.data(), start.data(), knobs, statistics, group.data());
  MLVI_CHECK(ok == 1, "ccolamd status {} for {} columns", statistics[CCOLAMD_STATUS],
             graph.columns);
  std::copy_n(start.begin(), graph.columns, order.begin());
  return order;
}

int Dimension(const std::vector<int>& columns, const std::vector<int>& sizes) {
  int dimension = 0;
  for (const int column : columns) dimension += sizes[column];
  return dimension;
}

bool ShouldMerge(int child_frontal, int child_separator, int parent_frontal, int parent_separator,
                 int zeros_before) {
  const int zeros =
      child_frontal * (parent_frontal + parent_separator - child_separator) + zeros_before;
  if (zeros == 0) return true;
  const int frontal = child_frontal + parent_frontal;
  if (frontal > kMergedFrontal) return false;
  return zeros <= kFreeZeros || zeros <= kZeroPart * frontal * (0.5 * frontal + parent_separator);
}

// Builds cliques column by column, in order of elimination.
class Builder {
 public:
  Builder(const Hypergraph& graph, const std::vector<int>& order, const std::vector<int>& sizes)
      : graph_(graph),
        order_(order),
        sizes_(sizes),
        mark_(graph.columns, -1),
        children_(graph.columns) {
    position_.resize(graph.columns);
    for (int i = 0; i < graph.columns; ++i) position_[order[i]] = i;
    AssignRows();
  }

  EliminationForest Build() {
    for (int i = 0; i < graph_.columns; ++i) AddColumn(i);
    return Compact();
  }

 private:
  struct Work {
    EliminationForest::Clique clique;
    int frontal_size = 0, separator_size = 0, zeros = 0;
    bool merged = false;
    std::vector<int> children;
  };

  // Every row belongs to the first of its columns that is eliminated; rows_ chains them per column.
  void AssignRows() {
    first_row_.assign(graph_.columns, -1);
    next_row_.assign(graph_.rows(), -1);
    for (int row = graph_.rows() - 1; row >= 0; --row) {
      int first = graph_.columns;
      for (int i = graph_.row_start[row]; i < graph_.row_start[row + 1]; ++i) {
        first = std::min(first, position_[graph_.entries[i]]);
      }
      if (first == graph_.columns) continue;
      next_row_[row] = first_row_[first];
      first_row_[first] = row;
    }
  }

  void AddSeparator(int column, int i, std::vector<int>* separator) {
    if (mark_[column] == i) return;
    mark_[column] = i;
    separator->push_back(column);
  }

  void AddColumn(int i) {
    const int column = order_[i];
    Work work;
    work.clique.frontal = {column};
    mark_[column] = i;
    std::vector<int>& separator = work.clique.separator;
    for (int row = first_row_[i]; row >= 0; row = next_row_[row]) {
      for (int k = graph_.row_start[row]; k < graph_.row_start[row + 1]; ++k) {
        AddSeparator(graph_.entries[k], i, &separator);
      }
    }
    for (const int child : children_[i]) {
      for (const int k : work_[child].clique.separator) AddSeparator(k, i, &separator);
    }
    std::ranges::sort(separator, {}, [&](int k) { return position_[k]; });
    work.frontal_size = sizes_[column];
    work.separator_size = Dimension(separator, sizes_);
    MergeChildren(i, &work);
    if (!separator.empty())
      children_[position_[separator.front()]].push_back(static_cast<int>(work_.size()));
    work_.push_back(std::move(work));
  }

  void MergeChildren(int i, Work* work) {
    for (const int index : children_[i]) {
      Work& child = work_[index];
      const int zeros = work->zeros + child.zeros;
      if (!ShouldMerge(child.frontal_size, child.separator_size, work->frontal_size,
                       work->separator_size, zeros)) {
        work->children.push_back(index);
        continue;
      }
      work->zeros = zeros + child.frontal_size *
                                (work->frontal_size + work->separator_size - child.separator_size);
      work->frontal_size += child.frontal_size;
      std::vector<int>& frontal = work->clique.frontal;
      frontal.insert(frontal.end() - 1, child.clique.frontal.begin(), child.clique.frontal.end());
      work->children.insert(work->children.end(), child.children.begin(), child.children.end());
      child.merged = true;
    }
  }

  EliminationForest Compact() {
    EliminationForest forest;
    forest.position = position_;
    forest.clique_of.assign(graph_.columns, -1);
    std::vector<int> new_index(work_.size(), -1);
    for (std::size_t i = 0; i < work_.size(); ++i) {
      if (work_[i].merged) continue;
      new_index[i] = static_cast<int>(forest.cliques.size());
      for (const int child : work_[i].children)
        forest.cliques[new_index[child]].parent = new_index[i];
      for (const int column : work_[i].clique.frontal) forest.clique_of[column] = new_index[i];
      forest.cliques.push_back(std::move(work_[i].clique));
    }
    return forest;
  }

  const Hypergraph& graph_;
  const std::vector<int>& order_;
  const std::vector<int>& sizes_;
  std::vector<int> position_, mark_, first_row_, next_row_;
  std::vector<std::vector<int>> children_;  // by position of the first separator column
  std::vector<Work> work_;
};

}  // namespace

EliminationForest AnalyzeElimination(const Hypergraph& graph, const std::vector<int>& group,
                                     const std::vector<int>& sizes) {
  const std::vector<int> order = Order(graph, group);
  return Builder(graph, order, sizes).Build();
}

}  // namespace mlvi::internal
