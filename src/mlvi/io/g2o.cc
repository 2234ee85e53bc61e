// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/g2o.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <sstream>

#include "mlvi/io/whole_file.h"

namespace mlvi {
namespace {

// What is wrong with a line; empty when nothing is.
using Complaint = std::string;

// Reads exactly `count` finite numbers.
template <typename T>
bool ReadNumbers(std::istringstream& line, T* out, int count) {
  for (int i = 0; i < count; ++i) {
    if (!(line >> out[i]) || !std::isfinite(static_cast<double>(out[i]))) return false;
  }
  return true;
}

// x y z qx qy qz qw.
Complaint ReadPose(std::istringstream& line, Pose3* pose) {
  std::array<double, 7> v;
  if (!ReadNumbers(line, v.data(), 7)) return "expected seven finite numbers x y z qx qy qz qw";
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  // Files are written with few digits, so the length may be off by some 1e-3; a length far from one
  // is no rotation.
  if (std::abs(q.norm() - 1.0) > 0.1) {
    return fmt::format("the quaternion has length {}, not 1: wrong order of columns?", q.norm());
  }
  *pose = Pose3(q, {v[0], v[1], v[2]});
  return {};
}

Complaint ReadInformation(std::istringstream& line, Matrix6d* information) {
  std::array<double, 21> upper;
  if (!ReadNumbers(line, upper.data(), 21))
    return "expected 21 finite numbers, the upper triangle of the information";
  int next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      (*information)(row, column) = (*information)(column, row) = upper[next++];
    }
  }
  return {};
}

bool IsPositiveDefinite(const Matrix6d& m) {
  return Eigen::LLT<Matrix6d>(m).info() == Eigen::Success;
}

Matrix6d WithTransposedCoupling(const Matrix6d& information) {
  Matrix6d transposed = information;
  transposed.topRightCorner<3, 3>() = information.bottomLeftCorner<3, 3>();
  transposed.bottomLeftCorner<3, 3>() = information.topRightCorner<3, 3>();
  return transposed;
}

// Index of the first edge whose information is of no use either way round, or the number of edges.
std::size_t ResolveInformation(PoseGraph* graph) {
  std::vector<PoseGraph::Edge>& edges = graph->edges;
  const auto bad =
      std::ranges::find_if(edges, [](const auto& e) { return !IsPositiveDefinite(e.information); });
  if (bad == edges.end()) return edges.size();
  graph->transposed_coupling = std::ranges::all_of(edges, [](const auto& e) {
    return IsPositiveDefinite(WithTransposedCoupling(e.information));
  });
  if (!graph->transposed_coupling) return bad - edges.begin();
  for (PoseGraph::Edge& edge : edges) edge.information = WithTransposedCoupling(edge.information);
  return edges.size();
}

Complaint ReadVertex(std::istringstream& line, PoseGraph* graph) {
  std::int64_t id = 0;
  if (!ReadNumbers(line, &id, 1)) return "expected the id of the vertex";
  Pose3 pose;
  if (Complaint complaint = ReadPose(line, &pose); !complaint.empty()) return complaint;
  if (!graph->poses.emplace(id, pose).second) return fmt::format("vertex {} was given before", id);
  return {};
}

Complaint ReadEdge(std::istringstream& line, PoseGraph* graph) {
  std::array<std::int64_t, 2> ids;
  if (!ReadNumbers(line, ids.data(), 2)) return "expected the ids of two vertices";
  if (ids[0] == ids[1]) return fmt::format("the edge joins vertex {} to itself", ids[0]);
  PoseGraph::Edge edge{.from = ids[0], .to = ids[1], .T_from_to = {}, .information = {}};
  if (Complaint complaint = ReadPose(line, &edge.T_from_to); !complaint.empty()) return complaint;
  if (Complaint complaint = ReadInformation(line, &edge.information); !complaint.empty())
    return complaint;
  graph->edges.push_back(edge);
  return {};
}

Complaint ReadLine(const std::string& text, PoseGraph* graph) {
  std::istringstream line(text);
  std::string record;
  if (!(line >> record) || record[0] == '#' || record == "FIX") return {};
  Complaint complaint;
  if (record == "VERTEX_SE3:QUAT") {
    complaint = ReadVertex(line, graph);
  } else if (record == "EDGE_SE3:QUAT") {
    complaint = ReadEdge(line, graph);
  } else {
    return fmt::format("record {} is not known; only VERTEX_SE3:QUAT and EDGE_SE3:QUAT are read",
                       record);
  }
  if (std::string rest; complaint.empty() && line >> rest && rest[0] != '#') {
    return fmt::format("unexpected \"{}\" behind the last number of {}", rest, record);
  }
  return complaint.empty() ? complaint : record + ": " + complaint;
}

}  // namespace

Expected<PoseGraph> ReadG2o(std::istream& stream, const std::string& name) {
  PoseGraph graph;
  std::vector<int> edge_lines;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    if (const Complaint complaint = ReadLine(text, &graph); !complaint.empty()) {
      return MakeError(ErrorKind::kInput, "{}:{}: {}", name, number, complaint);
    }
    if (edge_lines.size() < graph.edges.size()) edge_lines.push_back(number);
  }
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    for (const std::int64_t id : {graph.edges[i].from, graph.edges[i].to}) {
      if (graph.poses.contains(id)) continue;
      return MakeError(ErrorKind::kInput,
                       "{}:{}: the edge names vertex {}, which the file does not hold", name,
                       edge_lines[i], id);
    }
  }
  if (const std::size_t bad = ResolveInformation(&graph); bad < graph.edges.size()) {
    return MakeError(ErrorKind::kInput,
                     "{}:{}: EDGE_SE3:QUAT: the information is not positive definite", name,
                     edge_lines[bad]);
  }
  if (graph.poses.empty())
    return MakeError(ErrorKind::kInput, "{}: holds no VERTEX_SE3:QUAT", name);
  return graph;
}

Expected<PoseGraph> ReadG2o(const std::filesystem::path& path) {
  const auto text = ReadWholeFile(path.string(), ErrorKind::kInput);
  if (!text) return tl::unexpected(text.error());
  std::istringstream stream(*text);
  return ReadG2o(stream, path.string());
}

}  // namespace mlvi
