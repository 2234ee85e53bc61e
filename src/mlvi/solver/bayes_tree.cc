// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/bayes_tree.h"

#include <algorithm>

namespace mlvi::internal {
int BayesTree::NewClique() {
  if (free_.empty()) {
    cliques_.emplace_back();
    return static_cast<int>(cliques_.size()) - 1;
  }
  const int c = free_.back();
  free_.pop_back();
  return c;
}

BayesTree::Top BayesTree::Detach(const std::vector<int>& touched) {
  Top top;
  std::vector<int> removed;
  for (const int v : touched) {
    if (clique_of_[v] < 0) top.variables.push_back(v);
    for (int c = clique_of_[v]; c >= 0 && !cliques_[c].removed; c = cliques_[c].parent) {
      cliques_[c].removed = true;
      removed.push_back(c);
    }
  }
  for (const int c : removed) {
    const Clique& clique = cliques_[c];
    top.variables.insert(top.variables.end(), clique.variables.begin(),
                         clique.variables.begin() + clique.frontal_count);
    for (const int f : clique.factors) {
      if (factors_[f].alive()) top.factors.push_back(f);
    }
    for (const int child : clique.children) {
      if (!cliques_[child].removed) top.orphans.push_back(child);
    }
  }
  std::erase_if(roots_, [&](int c) { return cliques_[c].removed; });
  std::erase_if(dirty_, [&](int c) { return cliques_[c].removed; });
  for (const int c : removed) {
    Clique& clique = cliques_[c];
    clique.variables.clear();
    clique.children.clear();
    clique.factors.clear();
    clique.runs.clear();
    clique.parent = -1;
    clique.dirty = clique.solve = clique.removed = false;
    free_.push_back(c);
  }
  std::ranges::sort(top.variables);
  top.variables.erase(std::unique(top.variables.begin(), top.variables.end()), top.variables.end());
  return top;
}

Hypergraph BayesTree::BuildHypergraph(const Top& top) {
  Hypergraph graph;
  graph.columns = static_cast<int>(top.variables.size());
  for (int i = 0; i < graph.columns; ++i) local_[top.variables[i]] = i;
  for (const int f : top.factors) {
    for (const int v : factors_[f].variables) graph.entries.push_back(local_[v]);
    graph.EndRow();
  }
  for (const int c : top.orphans) {
    const Clique& clique = cliques_[c];
    for (std::size_t i = clique.frontal_count; i < clique.variables.size(); ++i) {
      graph.entries.push_back(local_[clique.variables[i]]);
    }
    graph.EndRow();
  }
  return graph;
}

void BayesTree::Resize() {
  clique_of_.resize(variables_.size(), -1);
  local_.resize(variables_.size(), -1);
  is_changed_.resize(variables_.size(), 0);
}

int BayesTree::Restructure(const std::vector<int>& touched, const std::vector<int>& added,
                           const std::vector<int>& newest) {
  Resize();
  Top top = Detach(touched);
  top.factors.insert(top.factors.end(), added.begin(), added.end());
  return Rebuild(top, newest);
}

void BayesTree::Withdraw(const std::vector<int>& touched, const std::vector<int>& returned,
                         int variable_count, int factor_count) {
  Resize();
  for (const int v : changed_) is_changed_[v] = 0;
  changed_.clear();
  Top top = Detach(touched);
  std::erase_if(top.variables, [&](int v) {
    if (v >= variable_count) clique_of_[v] = -1;
    return v >= variable_count;
  });
  std::erase_if(top.factors, [&](int f) {
    if (f >= factor_count) factors_[f].clique = -1;
    return f >= factor_count;
  });
  top.factors.insert(top.factors.end(), returned.begin(), returned.end());
  if (!top.variables.empty()) Rebuild(top, {});
}

// Orders and attaches what was taken out; returns the number of variables.
int BayesTree::Rebuild(const Top& top, const std::vector<int>& newest) {
  const Hypergraph graph = BuildHypergraph(top);
  std::vector<int> group(graph.columns, 0), sizes(graph.columns);
  for (int i = 0; i < graph.columns; ++i) sizes[i] = variables_.tangent_size(top.variables[i]);
  // Groups must count from zero: with nothing but newest variables there is one group.
  if (static_cast<int>(newest.size()) < graph.columns) {
    for (const int v : newest) group[local_[v]] = 1;
  }
  Attach(top, AnalyzeElimination(graph, group, sizes));
  return graph.columns;
}

int BayesTree::FirstEliminated(const int* begin, const int* end,
                               const EliminationForest& forest) const {
  return *std::min_element(begin, end, [&](int a, int b) {
    return forest.position[local_[a]] < forest.position[local_[b]];
  });
}

void BayesTree::AddCliques(const Top& top, const EliminationForest& forest,
                           std::vector<int>* index) {
  index->resize(forest.cliques.size());
  for (int& c : *index) c = NewClique();
  for (std::size_t i = 0; i < forest.cliques.size(); ++i) {
    const EliminationForest::Clique& source = forest.cliques[i];
    Clique& clique = cliques_[(*index)[i]];
    clique.frontal_count = static_cast<int>(source.frontal.size());
    clique.frontal = clique.separator = 0;
    for (const int column : source.frontal) {
      const int v = top.variables[column];
      clique.variables.push_back(v);
      clique.frontal += variables_.tangent_size(v);
      clique_of_[v] = (*index)[i];
    }
    for (const int column : source.separator) {
      const int v = top.variables[column];
      clique.variables.push_back(v);
      clique.separator += variables_.tangent_size(v);
    }
    clique.dirty = clique.solve = true;
    dirty_.push_back((*index)[i]);
    if (source.parent < 0) {
      roots_.push_back((*index)[i]);
    } else {
      clique.parent = (*index)[source.parent];
      cliques_[clique.parent].children.push_back((*index)[i]);
    }
  }
}

void BayesTree::Attach(const Top& top, const EliminationForest& forest) {
  std::vector<int> index;
  AddCliques(top, forest, &index);
  for (const int f : top.factors) {
    Factor& factor = factors_[f];
    const int* variables = factor.variables.data();
    factor.clique =
        clique_of_[FirstEliminated(variables, variables + factor.variables.size(), forest)];
    cliques_[factor.clique].factors.push_back(f);
  }
  for (const int c : top.orphans) {
    Clique& orphan = cliques_[c];
    const int* variables = orphan.variables.data();
    orphan.parent = clique_of_[FirstEliminated(variables + orphan.frontal_count,
                                               variables + orphan.variables.size(), forest)];
    cliques_[orphan.parent].children.push_back(c);
  }
  for (const int c : index) PlaceCoordinates(&cliques_[c]);
}

// Where the factors and children of a new clique go in its front.
void BayesTree::PlaceCoordinates(Clique* clique) {
  int next = 0;
  for (const int v : clique->variables) {
    local_[v] = next;
    next += variables_.tangent_size(v);
  }
  for (const int f : clique->factors) {
    Factor& factor = factors_[f];
    factor.coordinate.clear();
    for (const int v : factor.variables) factor.coordinate.push_back(local_[v]);
  }
  for (const int c : clique->children) {
    Clique& child = cliques_[c];
    child.runs.clear();
    int offset = 0;
    for (std::size_t i = child.frontal_count; i < child.variables.size(); ++i) {
      const int v = child.variables[i], size = variables_.tangent_size(v), parent = local_[v];
      FrontRun* last = child.runs.empty() ? nullptr : &child.runs.back();
      // A run must not cross from the frontal to the separator part, which are stored apart.
      if (last != nullptr && last->parent + last->size == parent && parent != clique->frontal) {
        last->size += size;
      } else {
        child.runs.push_back({.child = offset, .parent = parent, .size = size});
      }
      offset += size;
    }
  }
}

void BayesTree::MarkDirty(int clique) {
  for (int c = clique; c >= 0 && !cliques_[c].dirty; c = cliques_[c].parent) {
    cliques_[c].dirty = cliques_[c].solve = true;
    dirty_.push_back(c);
  }
}

}  // namespace mlvi::internal
