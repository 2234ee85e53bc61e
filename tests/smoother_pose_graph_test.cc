// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The incremental smoother on public pose graphs, fed one pose at a time, against Ceres over the
// same factors.
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "mlvi/base/parallel.h"
#include "mlvi/base/random.h"
#include "mlvi/factors/between_factor.h"
#include "mlvi/factors/prior_factor.h"
#include "mlvi/io/g2o.h"
#include "mlvi/solver/ceres_problem.h"
#include "mlvi/solver/incremental_smoother.h"

namespace mlvi {
namespace {

std::filesystem::path GraphPath(const std::string& name) {
  return std::filesystem::path(MLVI_SHARED_DATA_DIR) / "pose_graphs" / (name + ".g2o");
}

// A graph whose pose ids count from zero, in the smoother and in Ceres.
class PoseGraphRun {
 public:
  PoseGraphRun(const PoseGraph& graph, const IncrementalSmootherConfig& config)
      : graph_(graph), smoother(config), manifold_(std::make_shared<PoseManifold>()) {
    prior_ =
        std::make_shared<PosePriorFactor>(graph.poses.at(0), Matrix6d(1e4 * Matrix6d::Identity()));
    for (const PoseGraph::Edge& edge : graph.edges) {
      factors_.push_back(
          std::make_shared<BetweenFactor>(edge.T_from_to, SqrtInformation(edge.information)));
      arriving_[std::max(edge.from, edge.to)].push_back(factors_.size() - 1);
    }
  }

  void Feed() {
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(graph_.poses.size()); ++i) {
      Pose3 guess = graph_.poses.at(0);
      for (const std::size_t e : arriving_[i]) {
        const PoseGraph::Edge& edge = graph_.edges[e];
        if (edge.from == i - 1)
          guess = LoadPose(smoother.Estimate(ids.back()).data()) * edge.T_from_to;
      }
      std::array<double, kPoseBlockSize> block;
      StorePose(guess, block.data());
      ids.push_back(smoother.AddVariable(block, manifold_));
      if (i == 0) smoother.AddFactor(prior_, nullptr, {ids[0]});
      for (const std::size_t e : arriving_[i]) {
        smoother.AddFactor(factors_[e], nullptr,
                           {ids[graph_.edges[e].from], ids[graph_.edges[e].to]});
      }
      const auto summary = smoother.Update();
      ASSERT_TRUE(summary) << summary.error().message;
    }
  }

  // From the smoother's estimate. The caller asks `problem` for covariances while this object
  // lives.
  double SolveBatch(ceres::Problem* problem) {
    blocks.resize(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      std::ranges::copy(smoother.Estimate(ids[i]), blocks[i].begin());
      AddParameterBlock(manifold_, blocks[i].data(), *problem);
    }
    problem->AddResidualBlock(prior_.get(), nullptr, blocks[0].data());
    for (std::size_t e = 0; e < factors_.size(); ++e) {
      const PoseGraph::Edge& edge = graph_.edges[e];
      problem->AddResidualBlock(factors_[e].get(), nullptr, blocks[edge.from].data(),
                                blocks[edge.to].data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 100;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-15;
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem, &summary);
    return summary.final_cost;
  }

  static ceres::Problem::Options Borrowing() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

 private:
  const PoseGraph& graph_;

 public:
  IncrementalSmoother smoother;
  std::vector<VariableId> ids;
  std::vector<std::array<double, kPoseBlockSize>> blocks;

 private:
  std::shared_ptr<PoseManifold> manifold_;
  std::shared_ptr<PosePriorFactor> prior_;
  std::vector<std::shared_ptr<BetweenFactor>> factors_;
  std::map<std::int64_t, std::vector<std::size_t>> arriving_;
};

class SmallGraph : public testing::TestWithParam<std::string> {};

// At the optimum, so that both covariances are linearised at the same point.
TEST_P(SmallGraph, ObjectiveAndMarginalsEqualBatch) {
  if (!std::filesystem::exists(GraphPath(GetParam())))
    GTEST_SKIP() << GraphPath(GetParam()) << " is absent";
  const auto graph = ReadG2o(GraphPath(GetParam()));
  ASSERT_TRUE(graph) << graph.error().message;
  PoseGraphRun run(*graph, {.relinearize_threshold = 1e-9,
                            .model_error_threshold = 1e-10,
                            .wildfire_threshold = 0.0,
                            .urgency = 1.0,
                            .max_rounds = 20});
  run.Feed();
  ceres::Problem problem(PoseGraphRun::Borrowing());
  const double optimum = run.SolveBatch(&problem);
  EXPECT_NEAR(run.smoother.Objective(), optimum, 1e-8 * optimum);

  ceres::Covariance covariance({});
  std::vector<std::pair<const double*, const double*>> pairs;
  for (std::size_t i = 2; i < run.blocks.size(); ++i) {
    pairs.emplace_back(run.blocks[i].data(), run.blocks[i].data());
    pairs.emplace_back(run.blocks[1].data(), run.blocks[i].data());
  }
  ASSERT_TRUE(covariance.Compute(pairs, &problem));
  for (std::size_t i = 2; i < run.ids.size(); ++i) {
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> marginal, cross;
    covariance.GetCovarianceBlockInTangentSpace(run.blocks[i].data(), run.blocks[i].data(),
                                                marginal.data());
    covariance.GetCovarianceBlockInTangentSpace(run.blocks[1].data(), run.blocks[i].data(),
                                                cross.data());
    const Eigen::MatrixXd joint =
        run.smoother.MarginalCovariance(std::array{run.ids[1], run.ids[i]});
    EXPECT_LT((run.smoother.MarginalCovariance(run.ids[i]) - marginal).norm(),
              1e-6 * marginal.norm())
        << i;
    EXPECT_LT((joint.bottomRightCorner<6, 6>() - marginal).norm(), 1e-6 * marginal.norm()) << i;
    EXPECT_LT((joint.topRightCorner<6, 6>() - cross).norm(), 1e-6 * marginal.norm()) << i;
  }
}
INSTANTIATE_TEST_SUITE_P(PublicGraphs, SmallGraph, testing::Values("tinyGrid3D", "smallGrid3D"));

// With the default thresholds, within 0.1 % of the optimum.
TEST(PublicGraph, ParkingGarageEndsAtTheOptimum) {
  if (!std::filesystem::exists(GraphPath("parking-garage")))
    GTEST_SKIP() << "parking-garage.g2o is absent";
  const auto graph = ReadG2o(GraphPath("parking-garage"));
  ASSERT_TRUE(graph) << graph.error().message;
  PoseGraphRun run(*graph, {});
  run.Feed();
  ceres::Problem problem(PoseGraphRun::Borrowing());
  const double optimum = run.SolveBatch(&problem);
  EXPECT_NEAR(optimum, 0.6342, 1e-3);
  EXPECT_LT(run.smoother.Objective(), 1.001 * optimum);
}

// A walk in unit steps and quarter turns through a few storeys, which sees every earlier pose
// within 1.5 m. Unlike the public graphs that the thresholds were chosen on, it revisits places
// from the start.
PoseGraph Storeys(int poses, double sigma_position, double sigma_rotation) {
  RandomStream random(11, "storeys");
  Vector6d sigma;
  sigma << sigma_position, sigma_position, sigma_position, sigma_rotation, sigma_rotation,
      sigma_rotation;
  const Matrix6d information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  PoseGraph graph;
  std::vector<Pose3> truth = {Pose3()};
  const auto connect = [&](int from, int to) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise[k] = sigma[k] * random.Normal();
    graph.edges.push_back({.from = from,
                           .to = to,
                           .T_from_to = BoxPlus(truth[from].inverse() * truth[to], noise),
                           .information = information});
  };
  for (int i = 1; i < poses; ++i) {
    Vector6d step = Vector6d::Zero();
    step[0] = 1.0;
    if (random.Uniform() < 0.1) step[2] = random.Uniform() < 0.5 ? 1.0 : -1.0;
    if (random.Uniform() < 0.4) step[5] = random.Uniform() < 0.5 ? 0.5 * M_PI : -0.5 * M_PI;
    truth.push_back(BoxPlus(truth.back(), step));
    connect(i - 1, i);
    for (int j = 0; j < i - 5; ++j) {
      if ((truth[j].translation() - truth[i].translation()).norm() < 1.5 && random.Uniform() < 0.3)
        connect(j, i);
    }
  }
  for (int i = 0; i < poses; ++i) graph.poses[i] = truth[i];
  return graph;
}

class HeldOutGraph : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(HeldOutGraph, EndsAtTheOptimumWithTheSameBitsAtAnyNumberOfThreads) {
  const PoseGraph graph = Storeys(500, GetParam().first, GetParam().second);
  std::vector<double> estimates[2];
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    PoseGraphRun run(graph, {});
    run.Feed();
    for (const VariableId id : run.ids) {
      for (const double x : run.smoother.Estimate(id)) estimates[threads - 1].push_back(x);
    }
    if (threads == 2) continue;
    ceres::Problem problem(PoseGraphRun::Borrowing());
    const double optimum = run.SolveBatch(&problem);
    // Of the six residuals per edge, six per pose are fitted.
    const double expected = 3.0 * (graph.edges.size() - graph.poses.size() + 1.0);
    EXPECT_NEAR(optimum, expected, 5.0 * std::sqrt(expected));
    EXPECT_LT(run.smoother.Objective(), 1.001 * optimum);
  }
  ASSERT_EQ(estimates[0].size(), 500u * kPoseBlockSize);
  EXPECT_EQ(estimates[0], estimates[1]);
}
INSTANTIATE_TEST_SUITE_P(Noise, HeldOutGraph,
                         testing::Values(std::pair{0.05, 0.02}, std::pair{0.001, 0.001},
                                         std::pair{0.2, 0.05}));

}  // namespace
}  // namespace mlvi
