// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/g2o.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace mlvi {
namespace {

using testing::HasSubstr;

constexpr char kVertices[] =
    "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 7 1 2 3 0 0 0.6 0.8\n";
constexpr char kEye[] = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

Expected<PoseGraph> Read(const std::string& text) {
  std::istringstream stream(text);
  return ReadG2o(stream, "test.g2o");
}

TEST(G2o, ReadsVerticesEdgesAndTheUpperTriangleRowByRow) {
  // 21 different numbers on a dominant diagonal.
  const auto graph = Read(std::string("# made by hand\n") + kVertices + "FIX 0\n\n" +
                          "EDGE_SE3:QUAT 0 7 1 2 3 0 0 0.6 0.8 101 2 3 4 5 6 102 8 9 10 11 103 13 "
                          "14 15 104 17 18 105 20 106\n");
  ASSERT_TRUE(graph) << graph.error().message;
  ASSERT_EQ(graph->poses.size(), 2u);
  ASSERT_EQ(graph->edges.size(), 1u);
  EXPECT_EQ(graph->poses.at(7).translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(graph->poses.at(7).rotation().z(), 0.6, 1e-15);
  const PoseGraph::Edge& edge = graph->edges[0];
  EXPECT_EQ(edge.from, 0);
  EXPECT_EQ(edge.to, 7);
  EXPECT_EQ(edge.information(0, 5), 6.0);
  EXPECT_EQ(edge.information(1, 1), 102.0);
  EXPECT_EQ(edge.information(1, 2), 8.0);
  EXPECT_EQ(edge.information(4, 3), 17.0);
  EXPECT_EQ(edge.information(5, 4), 20.0);
  EXPECT_EQ(edge.information(5, 5), 106.0);
}

TEST(G2o, TransposesTheCouplingOfAllEdgesWhenOnlyThatIsPositiveDefinite) {
  // z-rx coupled: indefinite with these diagonals; x-rz coupled, as it was meant: definite.
  const std::string swapped = " 100 0 0 0 0 0 100 0 0 0 0 1 5 0 0 1 0 0 1 0 100";
  const auto graph =
      Read(std::string(kVertices) +
           "EDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1 9 0 0 0 2 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\n" +
           "EDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1" + swapped + "\n");
  ASSERT_TRUE(graph) << graph.error().message;
  EXPECT_TRUE(graph->transposed_coupling);
  EXPECT_EQ(graph->edges[1].information(0, 5), 5.0);
  EXPECT_EQ(graph->edges[1].information(5, 0), 5.0);
  EXPECT_EQ(graph->edges[1].information(2, 3), 0.0);
  EXPECT_EQ(graph->edges[0].information(1, 3), 2.0);
}

TEST(G2o, ErrorsNameTheLineAndTheReason) {
  struct Case {
    std::string line, reason;
  };
  const std::string eye = kEye;
  for (const Case& bad :
       {Case{"VERTEX_SE3:QUAT 8 0 0 0 0 0 0", "seven"},
        Case{"VERTEX_SE3:QUAT 8 0 0 nan 0 0 0 1", "seven"},
        Case{"VERTEX_SE3:QUAT 8 0 0 0 1 1 1 1", "length 2"},
        Case{"VERTEX_SE3:QUAT 7 0 0 0 0 0 0 1", "given before"},
        Case{"VERTEX_SE3:QUAT 8 0 0 0 0 0 0 1 5", "unexpected \"5\""},
        Case{"VERTEX_SE2 8 0 0 0", "VERTEX_SE2"},
        Case{"EDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1 1 0 0", "21"},
        Case{"EDGE_SE3:QUAT 0 0 0 0 0 0 0 0 1" + eye, "itself"},
        Case{"EDGE_SE3:QUAT 0 9 0 0 0 0 0 0 1" + eye, "vertex 9"},
        Case{"EDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1 -" + eye.substr(1), "positive definite"}}) {
    const auto graph = Read(kVertices + bad.line + "\n");
    ASSERT_FALSE(graph) << bad.line;
    EXPECT_THAT(graph.error().message, HasSubstr("test.g2o:3: ")) << bad.line;
    EXPECT_THAT(graph.error().message, HasSubstr(bad.reason)) << bad.line;
  }
  EXPECT_FALSE(Read(""));
  EXPECT_FALSE(ReadG2o("/no/such/file.g2o"));
}

TEST(G2o, ReadsThePublicGraphs) {
  const std::filesystem::path folder = std::filesystem::path(MLVI_SHARED_DATA_DIR) / "pose_graphs";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  struct Case {
    const char* name;
    std::size_t poses, edges;
  };
  for (const Case& c : {Case{"sphere2500", 2500, 4949}, Case{"torus3D", 5000, 9048},
                        Case{"parking-garage", 1661, 6275}, Case{"cubicle", 5750, 16869},
                        Case{"smallGrid3D", 125, 297}, Case{"tinyGrid3D", 9, 11}}) {
    const auto graph = ReadG2o(folder / (std::string(c.name) + ".g2o"));
    ASSERT_TRUE(graph) << graph.error().message;
    EXPECT_EQ(graph->poses.size(), c.poses) << c.name;
    EXPECT_EQ(graph->edges.size(), c.edges) << c.name;
    EXPECT_EQ(graph->transposed_coupling, std::string(c.name) == "cubicle");
  }
}

}  // namespace
}  // namespace mlvi
