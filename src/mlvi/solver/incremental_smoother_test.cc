// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/incremental_smoother.h"

#include <ceres/ceres.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <limits>

#include "mlvi/base/parallel.h"
#include "mlvi/base/random.h"
#include "mlvi/solver/ceres_problem.h"

namespace mlvi {
namespace {

using testing::HasSubstr;

// Variables of the tests: a rotation in the plane with a position, (x, y, c, s), and Euclidean
// 2-vectors (landmarks).
struct PlanarPlus {
  template <typename T>
  bool Plus(const T* x, const T* d, T* out) const {
    const T c = cos(d[2]), s = sin(d[2]);
    out[0] = x[0] + x[2] * d[0] - x[3] * d[1];
    out[1] = x[1] + x[3] * d[0] + x[2] * d[1];
    out[2] = x[2] * c - x[3] * s;
    out[3] = x[3] * c + x[2] * s;
    return true;
  }
  template <typename T>
  bool Minus(const T* y, const T* x, T* d) const {
    const T dx = y[0] - x[0], dy = y[1] - x[1];
    d[0] = x[2] * dx + x[3] * dy;
    d[1] = x[2] * dy - x[3] * dx;
    d[2] = atan2(x[2] * y[3] - x[3] * y[2], x[2] * y[2] + x[3] * y[3]);
    return true;
  }
};
class PlanarManifold final : public Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  void Plus(const double* x, const double* delta, double* out) const override {
    PlanarPlus().Plus(x, delta, out);
  }
  void PlusJacobian(const double* x, double* jacobian) const override {
    using Jet = ceres::Jet<double, 3>;
    const std::array<Jet, 4> point = {Jet(x[0]), Jet(x[1]), Jet(x[2]), Jet(x[3])};
    const std::array<Jet, 3> zero = {Jet(0.0, 0), Jet(0.0, 1), Jet(0.0, 2)};
    std::array<Jet, 4> moved;
    PlanarPlus().Plus(point.data(), zero.data(), moved.data());
    for (int row = 0; row < 4; ++row)
      Eigen::Map<Eigen::Vector3d>{jacobian + 3 * row} = moved[row].v;
  }
};
using Planar = Eigen::Vector4d;

struct RelativeError {
  Eigen::Vector3d measured, weight;
  template <typename T>
  bool operator()(const T* a, const T* b, T* r) const {
    PlanarPlus().Minus(b, a, r);
    for (int k = 0; k < 3; ++k) r[k] = T(weight[k]) * (r[k] - T(measured[k]));
    return true;
  }
};

struct PriorError {
  Planar prior;
  double weight;
  template <typename T>
  bool operator()(const T* a, T* r) const {
    const Eigen::Matrix<T, 4, 1> p = prior.cast<T>();
    PlanarPlus().Minus(a, p.data(), r);
    for (int k = 0; k < 3; ++k) r[k] *= T(weight);
    return true;
  }
};

// A landmark seen from a pose, in the frame of the pose.
struct SightingError {
  Eigen::Vector2d measured;
  template <typename T>
  bool operator()(const T* a, const T* point, T* r) const {
    const T dx = point[0] - a[0], dy = point[1] - a[1];
    r[0] = T(10.0) * (a[2] * dx + a[3] * dy - T(measured[0]));
    r[1] = T(10.0) * (a[2] * dy - a[3] * dx - T(measured[1]));
    return true;
  }
};

struct ManySightings {
  std::vector<Eigen::Vector2d> measured;
  template <typename T>
  bool operator()(T const* const* x, T* r) const {
    for (std::size_t k = 0; k < measured.size(); ++k)
      SightingError{measured[k]}(x[0], x[1], r + 2 * k);
    return true;
  }
};

template <typename Vector>
std::span<const double> Span(const Vector& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

std::shared_ptr<ceres::CostFunction> Relative(const Eigen::Vector3d& measured) {
  return std::make_shared<ceres::AutoDiffCostFunction<RelativeError, 3, 4, 4>>(
      new RelativeError{measured, Eigen::Vector3d(10.0, 10.0, 30.0)});
}
std::shared_ptr<ceres::CostFunction> Prior(const Planar& prior, double weight = 100.0) {
  return std::make_shared<ceres::AutoDiffCostFunction<PriorError, 3, 4>>(
      new PriorError{prior, weight});
}
std::shared_ptr<ceres::CostFunction> Sighting(const Eigen::Vector2d& measured) {
  return std::make_shared<ceres::AutoDiffCostFunction<SightingError, 2, 4, 2>>(
      new SightingError{measured});
}

// So small that the result is the optimum to the accuracy of the linear algebra.
IncrementalSmootherConfig Exact() {
  return {.relinearize_threshold = 1e-9,
          .model_error_threshold = 1e-12,
          .wildfire_threshold = 0.0,
          .urgency = 1.0,
          .max_rounds = 30};
}

// The same graph in the smoother and, on demand, in Ceres.
class World {
 public:
  explicit World(const IncrementalSmootherConfig& config = Exact()) : smoother(config) {}

  VariableId Add(const Eigen::VectorXd& value) {
    values_.push_back(value);
    ids.push_back(smoother.AddVariable(Span(value), value.size() == 4 ? manifold : nullptr));
    return ids.back();
  }
  FactorId Connect(std::shared_ptr<ceres::CostFunction> cost, std::vector<VariableId> variables,
                   std::shared_ptr<ceres::LossFunction> loss = nullptr) {
    const FactorId id = smoother.AddFactor(cost, loss, variables);
    factors[id.value()] = {cost, loss, variables};
    return id;
  }
  void Remove(FactorId id) {
    smoother.RemoveFactor(id);
    factors.erase(id.value());
  }
  Eigen::VectorXd Estimate(VariableId id) const {
    const std::span<const double> x = smoother.Estimate(id);
    return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  }
  std::vector<double> AllEstimates() const {
    std::vector<double> all;
    for (const VariableId id : ids) {
      for (const double x : smoother.Estimate(id)) all.push_back(x);
    }
    return all;
  }

  // Solves in batch from the smoother's estimate; `covariance_of` adds the joint covariance there.
  struct Batch {
    double objective = 0.0;
    std::vector<Eigen::VectorXd> values;
    Eigen::MatrixXd covariance;
  };
  Batch Solve(const std::vector<VariableId>& covariance_of = {}) const {
    ceres::Problem::Options ownership;
    ownership.cost_function_ownership = ownership.loss_function_ownership =
        ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(ownership);
    Batch batch;
    for (const VariableId id : ids) batch.values.push_back(Estimate(id));
    for (Eigen::VectorXd& x : batch.values) {
      if (x.size() == 4) {
        AddParameterBlock(manifold, x.data(), problem);
      } else {
        problem.AddParameterBlock(x.data(), static_cast<int>(x.size()));
      }
    }
    for (const auto& [id, f] : factors) {
      std::vector<double*> blocks;
      for (const VariableId v : f.variables) blocks.push_back(batch.values[v.value()].data());
      problem.AddResidualBlock(f.cost.get(), f.loss.get(), blocks);
    }
    ceres::Solver::Options options;
    options.max_num_iterations = 200;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    batch.objective = summary.final_cost;
    if (!covariance_of.empty())
      batch.covariance = Covariance(covariance_of, &problem, &batch.values);
    return batch;
  }

  IncrementalSmoother smoother;
  std::shared_ptr<PlanarManifold> manifold = std::make_shared<PlanarManifold>();
  std::vector<VariableId> ids;
  struct FactorCopy {
    std::shared_ptr<ceres::CostFunction> cost;
    std::shared_ptr<ceres::LossFunction> loss;
    std::vector<VariableId> variables;
  };
  std::map<std::int64_t, FactorCopy> factors;

 private:
  static Eigen::MatrixXd Covariance(const std::vector<VariableId>& ids, ceres::Problem* problem,
                                    std::vector<Eigen::VectorXd>* values) {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(options);
    std::vector<const double*> blocks;
    int size = 0;
    for (const VariableId id : ids) {
      blocks.push_back((*values)[id.value()].data());
      size +=
          (*values)[id.value()].size() == 4 ? 3 : static_cast<int>((*values)[id.value()].size());
    }
    EXPECT_TRUE(covariance.Compute(blocks, problem));
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joint(size, size);
    EXPECT_TRUE(covariance.GetCovarianceMatrixInTangentSpace(blocks, joint.data()));
    return joint;
  }
  std::vector<Eigen::VectorXd> values_;
};

// Random walks with loops and landmarks; factors come and go.
class RandomWorld : public World {
 public:
  explicit RandomWorld(std::uint64_t seed, const IncrementalSmootherConfig& config = Exact())
      : World(config), random_(seed, "world") {}

  void Step() {
    if (poses_.empty()) {
      AddPose(Planar(0, 0, 1, 0));
      Connect(Prior(truth_[0]), {poses_[0]});
      return;
    }
    const Planar previous = Estimate(poses_.back());
    const Eigen::Vector3d motion(1.0 + 0.2 * random_.Normal(), 0.2 * random_.Normal(),
                                 0.5 * random_.Normal());
    Planar next, guess;
    PlanarPlus().Plus(truth_.back().data(), motion.data(), next.data());
    const Eigen::Vector3d measured = motion + Noise();
    PlanarPlus().Plus(previous.data(), measured.data(), guess.data());
    AddPose(next, guess);
    Connect(Relative(measured), {poses_[poses_.size() - 2], poses_.back()});
    while (random_.Uniform() < 0.4) Loop();
    if (random_.Uniform() < 0.3) SeeLandmark();
    if (random_.Uniform() < 0.2 && !removable_.empty()) RemoveOne();
  }
  VariableId pose(int k) const { return poses_[k]; }

 private:
  Eigen::Vector3d Noise() {
    return 0.05 * Eigen::Vector3d(random_.Normal(), random_.Normal(), random_.Normal());
  }
  int Pick(std::size_t size) {
    return static_cast<int>(random_.Uniform() * static_cast<double>(size));
  }
  void AddPose(const Planar& truth) { AddPose(truth, truth); }
  void AddPose(const Planar& truth, const Planar& guess) {
    truth_.push_back(truth);
    poses_.push_back(Add(guess));
  }
  void Loop() {
    const int a = Pick(poses_.size()), b = Pick(poses_.size());
    if (a == b) return;
    Eigen::Vector3d d;
    PlanarPlus().Minus(truth_[b].data(), truth_[a].data(), d.data());
    d += Noise();
    removable_.push_back(
        Connect(Relative(d), {poses_[a], poses_[b]}, std::make_shared<ceres::CauchyLoss>(3.0)));
  }
  void SeeLandmark() {
    const Eigen::Vector2d point =
        truth_.back().head<2>() + Eigen::Vector2d(random_.Normal(), random_.Normal());
    const VariableId landmark = Add(point);
    const int count = static_cast<int>(poses_.size());
    for (int i = std::max(0, count - 3); i < count; ++i) {
      const Eigen::Vector2d d = point - truth_[i].head<2>();
      const Eigen::Vector2d local(truth_[i][2] * d.x() + truth_[i][3] * d.y(),
                                  truth_[i][2] * d.y() - truth_[i][3] * d.x());
      Connect(Sighting(local + 0.05 * Eigen::Vector2d(random_.Normal(), random_.Normal())),
              {poses_[i], landmark});
    }
  }
  void RemoveOne() {
    const int k = Pick(removable_.size());
    Remove(removable_[k]);
    removable_.erase(removable_.begin() + k);
  }

  RandomStream random_;
  std::vector<Planar> truth_;
  std::vector<VariableId> poses_;
  std::vector<FactorId> removable_;
};

TEST(IncrementalSmoother, EqualsBatchOnRandomGraphsWithInsertionsAndRemovals) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    RandomWorld world(seed);
    for (int i = 0; i < 40; ++i) {
      world.Step();
      const auto summary = world.smoother.Update();
      ASSERT_TRUE(summary) << summary.error().message;
      if (i % 8 != 7) continue;
      const World::Batch batch = world.Solve();
      EXPECT_NEAR(world.smoother.Objective(), batch.objective, 1e-9 * (1.0 + batch.objective));
      for (const VariableId id : world.ids) {
        EXPECT_LT((world.Estimate(id) - batch.values[id.value()]).norm(), 1e-6)
            << "seed " << seed << " step " << i;
      }
    }
    EXPECT_EQ(world.smoother.factor_count(), static_cast<int>(world.factors.size()));
    EXPECT_GT(world.smoother.variable_count(), 40);
  }
}

// Thresholds trade accuracy for time; the loss must stay of their second order.
TEST(IncrementalSmoother, DefaultThresholdsLoseLittle) {
  for (std::uint64_t seed = 20; seed < 24; ++seed) {
    RandomWorld world(seed, IncrementalSmootherConfig{});
    for (int i = 0; i < 100; ++i) {
      world.Step();
      ASSERT_TRUE(world.smoother.Update());
    }
    const double optimum = world.Solve().objective;
    EXPECT_GT(optimum, 1.0);
    EXPECT_LT(world.smoother.Objective(), 1.01 * optimum);
  }
}

TEST(IncrementalSmoother, SingleAndJointMarginalsEqualBatch) {
  RandomWorld world(3);
  for (int i = 0; i < 25; ++i) {
    world.Step();
    ASSERT_TRUE(world.smoother.Update());
  }
  // Without robust losses, whose second derivative Ceres takes into its covariance and we do not.
  for (auto it = world.factors.begin(); it != world.factors.end();) {
    const auto current = it++;
    if (current->second.loss != nullptr) world.Remove(FactorId(current->first));
  }
  ASSERT_TRUE(world.smoother.Update());
  const std::vector<VariableId> chosen = {world.ids[7], world.ids[0], world.ids.back(),
                                          world.ids[15]};
  const Eigen::MatrixXd expected = world.Solve(chosen).covariance;
  const Eigen::MatrixXd joint = world.smoother.MarginalCovariance(chosen);
  ASSERT_EQ(joint.rows(), expected.rows());
  EXPECT_LT((joint - expected).norm(), 1e-7 * expected.norm());
  EXPECT_GT(expected.norm(), 1e-4);
  const Eigen::MatrixXd single = world.smoother.MarginalCovariance(world.ids[7]);
  EXPECT_LT((single - joint.topLeftCorner(single.rows(), single.cols())).norm(), 1e-12);
}

TEST(IncrementalSmoother, RepeatsToTheBitAtAnyNumberOfThreads) {
  std::vector<std::vector<double>> results;
  for (const int threads : {1, 2, 2}) {
    const ThreadLimit limit(threads);
    RandomWorld world(5, IncrementalSmootherConfig{});
    for (int i = 0; i < 120; ++i) {
      world.Step();
      ASSERT_TRUE(world.smoother.Update());
    }
    results.push_back(world.AllEstimates());
  }
  ASSERT_GT(results[0].size(), 400u);
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(IncrementalSmoother, RemovingAFactorEqualsNeverHavingAddedIt) {
  RandomWorld with(6), without(6);
  for (int i = 0; i < 30; ++i) {
    with.Step();
    without.Step();
    ASSERT_TRUE(with.smoother.Update());
    ASSERT_TRUE(without.smoother.Update());
  }
  const FactorId wrong = with.Connect(Relative({0.3, -0.4, 0.2}), {with.pose(2), with.pose(20)});
  ASSERT_TRUE(with.smoother.Update());
  EXPECT_GT((with.Estimate(with.pose(20)) - without.Estimate(without.pose(20))).norm(), 1e-3);
  with.Remove(wrong);
  EXPECT_FALSE(with.smoother.Contains(wrong));
  ASSERT_TRUE(with.smoother.Update());
  for (const VariableId id : with.ids)
    EXPECT_LT((with.Estimate(id) - without.Estimate(id)).norm(), 1e-7);
}

TEST(IncrementalSmoother, UnconstrainedVariableIsNamedAndTheSmootherGoesOn) {
  RandomWorld world(7);
  for (int i = 0; i < 10; ++i) {
    world.Step();
    ASSERT_TRUE(world.smoother.Update());
  }
  const std::vector<double> before = world.AllEstimates();
  const Eigen::MatrixXd covariance = world.smoother.MarginalCovariance(world.ids[4]);
  const VariableId lonely = world.Add(Planar(0, 0, 1, 0));
  const auto failed = world.smoother.Update();
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr(fmt::format("variable {}", lonely.value())));
  std::vector<double> after = world.AllEstimates();
  after.resize(before.size());
  EXPECT_EQ(after, before);
  EXPECT_LT((world.smoother.MarginalCovariance(world.ids[4]) - covariance).norm(),
            1e-6 * covariance.norm());
  world.Connect(Prior(Planar(5, 5, 1, 0)), {lonely});  // repaired
  ASSERT_TRUE(world.smoother.Update());
  EXPECT_LT((world.Estimate(lonely) - Planar(5, 5, 1, 0)).norm(), 1e-9);
  world.Step();
  ASSERT_TRUE(world.smoother.Update());
  EXPECT_NEAR(world.smoother.Objective(), world.Solve().objective, 1e-9);
}

TEST(IncrementalSmoother, AFloatingGraphIsSingular) {
  World world;
  for (int i = 0; i < 12; ++i) {
    world.Add(Planar(i, 0.3 * i, 1, 0));
    if (i > 0) world.Connect(Relative({1.0, 0.1, 0.0}), {world.ids[i - 1], world.ids[i]});
  }
  const auto failed = world.smoother.Update();
  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("do not determine variable"));
}

TEST(IncrementalSmoother, NotFiniteFactorIsNamedAndCanBeDropped) {
  for (const bool discard : {false, true}) {
    RandomWorld world(8);
    for (int i = 0; i < 10; ++i) {
      world.Step();
      ASSERT_TRUE(world.smoother.Update());
    }
    const std::vector<double> before = world.AllEstimates();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const FactorId bad = world.Connect(Relative({nan, 0, 0}), {world.pose(1), world.pose(9)});
    const auto failed = world.smoother.Update();
    ASSERT_FALSE(failed);
    EXPECT_THAT(failed.error().message,
                HasSubstr(fmt::format("factor {} between variables {}, {} ", bad.value(),
                                      world.pose(1).value(), world.pose(9).value())));
    EXPECT_EQ(world.AllEstimates(), before);
    if (discard) {
      world.smoother.DiscardPending();
      world.factors.erase(bad.value());
    } else {
      world.Remove(bad);
    }
    EXPECT_FALSE(world.smoother.Contains(bad));
    world.Step();
    ASSERT_TRUE(world.smoother.Update());
    EXPECT_NEAR(world.smoother.Objective(), world.Solve().objective, 1e-9);
  }
}

// Pulls strongly to a place where it cannot be evaluated: found out only after the first step.
struct FragileError {
  Eigen::Vector2d place;
  template <typename T>
  bool operator()(const T* a, T* r) const {
    r[0] = T(50.0) * (a[0] - T(place.x()));
    r[1] = T(50.0) * (a[1] - T(place.y()));
    return r[0] * r[0] + r[1] * r[1] > T(50.0 * 50.0);
  }
};

TEST(IncrementalSmoother, FailuresLeaveNoTrace) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    RandomWorld world(seed), spared(seed);
    for (int i = 0; i < 30; ++i) {
      world.Step();
      spared.Step();
      ASSERT_TRUE(world.smoother.Update());
      ASSERT_TRUE(spared.smoother.Update());
      if (i < 5) continue;
      const std::vector<double> before = world.AllEstimates();
      // A variable that nothing holds or a factor that breaks, beside a loop and a removal that are
      // taken back, and factors that were removed before they counted.
      IncrementalSmoother& smoother = world.smoother;
      const VariableId extra = smoother.AddVariable(Span(Planar(1, 2, 1, 0)), world.manifold);
      smoother.AddFactor(Relative({1.0, 0.0, 0.3}), nullptr, {world.pose(1), world.pose(i - 1)});
      if (smoother.Contains(FactorId(i / 2))) smoother.RemoveFactor(FactorId(i / 2));
      for (const VariableId from : {world.pose(0), extra}) {
        smoother.RemoveFactor(
            smoother.AddFactor(Relative({9.0, 0.0, 0.0}), nullptr, {from, world.pose(i)}));
      }
      if (i % 2 == 0) {
        smoother.AddFactor(Relative({1.0, 0.0, 0.0}), nullptr, {world.pose(i), extra});
        const Eigen::Vector2d place(world.Estimate(world.pose(i))[0] + 5.0, 0.0);
        smoother.AddFactor(std::make_shared<ceres::AutoDiffCostFunction<FragileError, 2, 4>>(
                               new FragileError{place}),
                           nullptr, {world.pose(i)});
      }
      ASSERT_FALSE(smoother.Update());
      EXPECT_EQ(world.AllEstimates(), before);
      smoother.DiscardPending();
    }
    EXPECT_NEAR(world.smoother.Objective(), spared.smoother.Objective(), 1e-9);
    for (const VariableId id : world.ids)
      EXPECT_LT((world.Estimate(id) - spared.Estimate(id)).norm(), 1e-7);
    const VariableId any = world.pose(12);
    const Eigen::MatrixXd covariance = spared.smoother.MarginalCovariance(any);
    EXPECT_LT((world.smoother.MarginalCovariance(any) - covariance).norm(),
              1e-6 * covariance.norm());
  }
}

// Counts how often a factor is evaluated.
class Counted final : public ceres::CostFunction {
 public:
  Counted(std::shared_ptr<ceres::CostFunction> cost, std::atomic<int>* count)
      : cost_(std::move(cost)), count_(count) {
    set_num_residuals(cost_->num_residuals());
    *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
  }
  bool Evaluate(const double* const* x, double* r, double** J) const override {
    ++*count_;
    return cost_->Evaluate(x, r, J);
  }

 private:
  std::shared_ptr<ceres::CostFunction> cost_;
  std::atomic<int>* count_;
};

TEST(IncrementalSmoother, AFailureCostsNoMoreInALongGraph) {
  for (const int length : {100, 3000}) {
    World world;
    std::atomic<int> evaluations = 0;
    const auto counted = [&](std::shared_ptr<ceres::CostFunction> cost) {
      return std::make_shared<Counted>(std::move(cost), &evaluations);
    };
    for (int i = 0; i < length; ++i) {
      world.Add(Planar(0.5 * i, 0, 1, 0));
      if (i == 0) world.Connect(counted(Prior(Planar(0, 0, 1, 0))), {world.ids[0]});
      if (i > 0) world.Connect(counted(Relative({0.5, 0, 0})), {world.ids[i - 1], world.ids[i]});
    }
    ASSERT_TRUE(world.smoother.Update());
    EXPECT_GE(evaluations, length);
    evaluations = 0;
    for (int failure = 0; failure < 10; ++failure) {
      world.Add(Planar(0, 0, 1, 0));
      const VariableId near_end = world.ids[length - 2 - failure];
      world.Connect(counted(Relative({0.5, 0, 0})), {near_end, world.ids[length - 1]});
      ASSERT_FALSE(world.smoother.Update());
      world.smoother.DiscardPending();
    }
    EXPECT_LE(evaluations, 20) << "in a graph of " << length;
  }
}

TEST(IncrementalSmoother, DiscardPendingForgetsAdditionsAndRemovals) {
  RandomWorld world(9);
  for (int i = 0; i < 10; ++i) {
    world.Step();
    ASSERT_TRUE(world.smoother.Update());
  }
  const int variables = world.smoother.variable_count(), factors = world.smoother.factor_count();
  const double objective = world.smoother.Objective();
  const VariableId extra = world.smoother.AddVariable(Span(Planar(1, 2, 1, 0)), world.manifold);
  world.smoother.AddFactor(Relative({1, 1, 1}), nullptr, {world.pose(0), extra});
  world.smoother.RemoveFactor(FactorId(1));
  world.smoother.DiscardPending();
  EXPECT_EQ(world.smoother.variable_count(), variables);
  EXPECT_EQ(world.smoother.factor_count(), factors);
  ASSERT_TRUE(world.smoother.Update());
  EXPECT_NEAR(world.smoother.Objective(), objective, 1e-9);
}

// An outlier among the loops: a robust loss leaves it aside, as in batch.
TEST(IncrementalSmoother, RobustLossesEqualBatch) {
  World world;
  for (int i = 0; i < 20; ++i) {
    world.Add(Planar(i, 0, 1, 0));
    if (i == 0) world.Connect(Prior(Planar(0, 0, 1, 0)), {world.ids[0]});
    if (i > 0) world.Connect(Relative({1.0, 0.0, 0.0}), {world.ids[i - 1], world.ids[i]});
    ASSERT_TRUE(world.smoother.Update());
  }
  world.Connect(Relative({3.0, 2.0, 0.5}), {world.ids[2], world.ids[15]},
                std::make_shared<ceres::CauchyLoss>(1.0));
  ASSERT_TRUE(world.smoother.Update());
  const World::Batch batch = world.Solve();
  EXPECT_NEAR(world.smoother.Objective(), batch.objective, 1e-6 * batch.objective);
  EXPECT_LT((world.Estimate(world.ids[19]) - Planar(19, 0, 1, 0)).norm(), 1.0);
}

// More residuals than dimensions: the factor is stored as a triangle.
TEST(IncrementalSmoother, TallFactorsEqualBatch) {
  for (const bool robust : {false, true}) {
    World world;
    world.Add(Planar(0.1, -0.1, 1, 0));
    world.Add(Eigen::Vector2d(1.5, 2.5));
    world.Connect(Prior(Planar(0, 0, 1, 0)), {world.ids[0]});
    RandomStream random(4, "sightings");
    ManySightings sightings;
    for (int k = 0; k < 20; ++k)
      sightings.measured.emplace_back(1.0 + 0.1 * random.Normal(), 2.0 + 0.1 * random.Normal());
    auto cost = std::make_shared<ceres::DynamicAutoDiffCostFunction<ManySightings>>(
        new ManySightings(sightings));
    cost->AddParameterBlock(4);
    cost->AddParameterBlock(2);
    cost->SetNumResiduals(40);
    world.Connect(cost, {world.ids[0], world.ids[1]},
                  robust ? std::make_shared<ceres::CauchyLoss>(3.0) : nullptr);
    ASSERT_TRUE(world.smoother.Update());
    const World::Batch batch = world.Solve();
    EXPECT_GT(batch.objective, 1.0);
    EXPECT_NEAR(world.smoother.Objective(), batch.objective, 1e-9 * batch.objective);
    EXPECT_LT((world.Estimate(world.ids[1]) - batch.values[1]).norm(), 1e-6);
  }
}

TEST(IncrementalSmoother, BrokenContractsThrow) {
  World world;
  const VariableId a = world.Add(Planar(0, 0, 1, 0));
  const VariableId point = world.Add(Eigen::Vector2d(0, 0));
  EXPECT_THROW(world.smoother.AddFactor(Relative({1, 0, 0}), nullptr, {a, a}), ContractViolation);
  EXPECT_THROW(world.smoother.AddFactor(Relative({1, 0, 0}), nullptr, {a, point}),
               ContractViolation);
  EXPECT_THROW(world.smoother.AddFactor(Relative({1, 0, 0}), nullptr, {a}), ContractViolation);
  EXPECT_THROW(world.smoother.RemoveFactor(FactorId(0)), ContractViolation);
  EXPECT_THROW(world.smoother.Estimate(VariableId(2)), ContractViolation);
  const Planar value(0, 0, 1, 0);
  EXPECT_THROW(world.smoother.AddVariable(Span(value), nullptr, Span(Eigen::Vector3d(1, 1, 1))),
               ContractViolation);
}

}  // namespace
}  // namespace mlvi
