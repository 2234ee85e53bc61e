// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Feeds a pose graph to IncrementalSmoother one pose at a time, as an odometry would: pose i
// arrives with all its edges to earlier poses, its first guess is an odometry edge on the current
// estimate. Reads all poses after every update.
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>

#include "mlvi/base/parallel.h"
#include "mlvi/factors/between_factor.h"
#include "mlvi/factors/prior_factor.h"
#include "mlvi/io/g2o.h"
#include "mlvi/solver/ceres_problem.h"
#include "mlvi/solver/incremental_smoother.h"
#include "quantile.h"

namespace mlvi {
namespace {

constexpr double kPriorSigma = 1e-4;

struct Options {
  std::string path;
  bool json = false, batch = true;
  int batch_every = 0, threads = 0, print_every = 0;
  IncrementalSmootherConfig smoother;
};

using Clock = std::chrono::steady_clock;

// Processor time of the whole program: what remains comparable when other programs run, too.
double CpuMilliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The graph in the order of its vertices: edges as factors, by the later of their two poses.
class Sequence {
 public:
  explicit Sequence(const PoseGraph& graph) {
    std::map<std::int64_t, int> index;
    for (const auto& [id, pose] : graph.poses) index.emplace(id, static_cast<int>(index.size()));
    arriving_.resize(index.size());
    for (const PoseGraph::Edge& edge : graph.edges) {
      const int i = index.at(edge.from), j = index.at(edge.to);
      arriving_[std::max(i, j)].push_back(
          {i, j, edge.T_from_to,
           std::make_shared<BetweenFactor>(edge.T_from_to, SqrtInformation(edge.information))});
    }
    first_ = graph.poses.begin()->second;
    prior_ =
        std::make_shared<PosePriorFactor>(first_, Matrix6d(Matrix6d::Identity() / kPriorSigma));
  }

  struct Edge {
    int from, to;
    Pose3 T_from_to;
    std::shared_ptr<BetweenFactor> factor;
  };
  int size() const { return static_cast<int>(arriving_.size()); }
  const std::vector<Edge>& arriving(int pose) const { return arriving_[pose]; }
  const Pose3& first() const { return first_; }
  const std::shared_ptr<PosePriorFactor>& prior() const { return prior_; }

  // Composed from the newest pose that is known and shares one of `edges` with this one; none
  // without such a pose.
  template <typename EstimateOf, typename IsKnown>
  std::optional<Pose3> Guess(int pose, const std::vector<Edge>& edges,
                             const EstimateOf& estimate_of, const IsKnown& is_known) const {
    if (pose == 0) return first_;
    const Edge* best = nullptr;
    int newest = -1;
    for (const Edge& edge : edges) {
      if (edge.from != pose && edge.to != pose) continue;
      const int neighbour = edge.from == pose ? edge.to : edge.from;
      if (neighbour <= newest || !is_known(neighbour)) continue;
      newest = neighbour;
      best = &edge;
    }
    if (best == nullptr) return std::nullopt;
    return best->to == pose ? estimate_of(best->from) * best->T_from_to
                            : estimate_of(best->to) * best->T_from_to.inverse();
  }

 private:
  std::vector<std::vector<Edge>> arriving_;
  Pose3 first_;
  std::shared_ptr<PosePriorFactor> prior_;
};

using Blocks = std::vector<std::array<double, kPoseBlockSize>>;

// Batch optimum of the factors of the first `count` poses from `blocks`.
double SolveBatch(const Sequence& sequence, int count, Blocks* blocks) {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  const auto manifold = std::make_shared<PoseManifold>();
  ceres::Problem problem(ownership);
  for (int i = 0; i < count; ++i) AddParameterBlock(manifold, (*blocks)[i].data(), problem);
  problem.AddResidualBlock(sequence.prior().get(), nullptr, (*blocks)[0].data());
  for (int i = 0; i < count; ++i) {
    for (const Sequence::Edge& edge : sequence.arriving(i)) {
      problem.AddResidualBlock(edge.factor.get(), nullptr, (*blocks)[edge.from].data(),
                               (*blocks)[edge.to].data());
    }
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  options.num_threads = 2;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

Blocks OdometryGuess(const Sequence& sequence) {
  Blocks blocks(sequence.size());
  std::vector<char> known(sequence.size(), 0);
  const auto place = [&](int pose, const std::vector<Sequence::Edge>& edges) {
    const auto guess = sequence.Guess(
        pose, edges, [&](int k) { return LoadPose(blocks[k].data()); },
        [&](int k) { return known[k] != 0; });
    if (!guess) return;
    StorePose(*guess, blocks[pose].data());
    known[pose] = 1;
  };
  for (int i = 0; i < sequence.size(); ++i) {
    place(i, sequence.arriving(i));
    for (int k = 0; k < i; ++k) {
      if (known[k] == 0) place(k, sequence.arriving(i));
    }
  }
  return blocks;
}

class Run {
 public:
  Run(const Options& options, const Sequence& sequence)
      : options_(options),
        sequence_(sequence),
        smoother_(options.smoother),
        ids_(sequence.size()),
        blocks_(sequence.size()) {}

  Expected<nlohmann::json> Execute() {
    for (int i = 0; i < sequence_.size(); ++i) {
      if (auto error = AddPose(i)) return tl::unexpected(*error);
      if (options_.batch_every > 0 && i > 0 && i % options_.batch_every == 0) CompareWithBatch(i);
    }
    return Report();
  }

 private:
  std::optional<Error> AddPose(int i) {
    const auto start = Clock::now();
    const double cpu_start = CpuMilliseconds();
    waiting_.push_back(i);
    std::vector<Sequence::Edge> edges = std::move(postponed_);
    edges.insert(edges.end(), sequence_.arriving(i).begin(), sequence_.arriving(i).end());
    postponed_.clear();
    // The new pose first, then those that had no edge to an earlier one (pose 3307 of cubicle).
    for (auto it = waiting_.rbegin(); it != waiting_.rend(); ++it) TryAddVariable(*it, edges);
    std::erase_if(waiting_, [&](int k) { return ids_[k].valid(); });
    if (i == 0) smoother_.AddFactor(sequence_.prior(), nullptr, {ids_[0]});
    for (const Sequence::Edge& edge : edges) {
      if (ids_[edge.from].valid() && ids_[edge.to].valid()) {
        smoother_.AddFactor(edge.factor, nullptr, {ids_[edge.from], ids_[edge.to]});
      } else {
        postponed_.push_back(edge);
      }
    }
    const auto summary = smoother_.Update();
    if (!summary) return summary.error();
    for (int k = 0; k <= i; ++k) {
      if (ids_[k].valid()) std::ranges::copy(smoother_.Estimate(ids_[k]), blocks_[k].begin());
    }
    times_.push_back(MillisecondsSince(start));
    cpu_times_.push_back(CpuMilliseconds() - cpu_start);
    rounds_ += summary->rounds;
    relinearized_ += summary->relinearized_variables;
    reordered_ += summary->reordered_variables;
    cliques_ += summary->reeliminated_cliques;
    if (options_.print_every > 0 && i % options_.print_every == 0) {
      fmt::print(stderr,
                 "{:6d} objective {:.6g} rounds {} relinearized {} reordered {} cliques {} of {} "
                 "{:.2f} ms\n",
                 i, smoother_.Objective(), summary->rounds, summary->relinearized_variables,
                 summary->reordered_variables, summary->reeliminated_cliques, summary->cliques,
                 times_.back());
    }
    return std::nullopt;
  }

  void TryAddVariable(int pose, const std::vector<Sequence::Edge>& edges) {
    const auto guess = sequence_.Guess(
        pose, edges, [&](int k) { return LoadPose(blocks_[k].data()); },
        [&](int k) { return ids_[k].valid(); });
    if (!guess) return;
    StorePose(*guess, blocks_[pose].data());
    ids_[pose] = smoother_.AddVariable(blocks_[pose], manifold_);
  }

  // The same graph so far, solved in batch from the incremental estimate before the last pose.
  void CompareWithBatch(int i) {
    Blocks blocks = blocks_;
    const auto start = Clock::now();
    const double objective = SolveBatch(sequence_, i + 1, &blocks);
    batch_ms_ += MillisecondsSince(start);
    incremental_ms_ += times_.back();
    worst_excess_ =
        std::max(worst_excess_, smoother_.Objective() / std::max(objective, 1e-12) - 1.0);
    ++batches_;
  }

  nlohmann::json Report() {
    nlohmann::json json;
    const double total = std::accumulate(times_.begin(), times_.end(), 0.0);
    json["poses"] = smoother_.variable_count();
    json["factors"] = smoother_.factor_count();
    json["objective"] = smoother_.Objective();
    if (options_.batch) {
      Blocks odometry = OdometryGuess(sequence_);
      json["batch_objective"] = std::min(SolveBatch(sequence_, sequence_.size(), &blocks_),
                                         SolveBatch(sequence_, sequence_.size(), &odometry));
    }
    json["total_s"] = total * 1e-3;
    json["mean_update_ms"] = total / times_.size();
    json["p99_update_ms"] = Quantile(times_, 0.99);
    json["max_update_ms"] = Quantile(times_, 1.0);
    json["mean_update_cpu_ms"] =
        std::accumulate(cpu_times_.begin(), cpu_times_.end(), 0.0) / cpu_times_.size();
    json["p99_update_cpu_ms"] = Quantile(cpu_times_, 0.99);
    json["mean_rounds"] = static_cast<double>(rounds_) / times_.size();
    json["mean_relinearized"] = static_cast<double>(relinearized_) / times_.size();
    json["mean_reordered"] = static_cast<double>(reordered_) / times_.size();
    json["mean_reeliminated_cliques"] = static_cast<double>(cliques_) / times_.size();
    if (batches_ > 0) {
      json["batch_mean_ms"] = batch_ms_ / batches_;
      json["batch_to_incremental_ratio"] = (batch_ms_ / batches_) / (total / times_.size());
      json["worst_objective_excess"] = worst_excess_;
    }
    return json;
  }

  const Options& options_;
  const Sequence& sequence_;
  IncrementalSmoother smoother_;
  std::shared_ptr<PoseManifold> manifold_ = std::make_shared<PoseManifold>();
  std::vector<VariableId> ids_;
  std::vector<int> waiting_;
  std::vector<Sequence::Edge> postponed_;
  Blocks blocks_;
  std::vector<double> times_, cpu_times_;
  std::int64_t rounds_ = 0, relinearized_ = 0, reordered_ = 0, cliques_ = 0;
  double batch_ms_ = 0.0, incremental_ms_ = 0.0, worst_excess_ = 0.0;
  int batches_ = 0;
};

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Incremental smoothing of a g2o pose graph");
  app.add_option("graph", options.path, "g2o file with SE3:QUAT records")->required();
  app.add_flag("--json", options.json, "print one JSON object");
  app.add_option("--batch-every", options.batch_every,
                 "solve in batch, too, at every Nth pose (0: never)");
  app.add_flag("!--no-batch", options.batch, "leave out the batch optimum at the end");
  app.add_option("--threads", options.threads, "threads of parallel loops (0: all cores)");
  app.add_option("--print-every", options.print_every, "print the state at every Nth pose");
  app.add_option("--relinearize", options.smoother.relinearize_threshold,
                 "relinearisation threshold");
  app.add_option("--model-error", options.smoother.model_error_threshold,
                 "threshold of the model error");
  app.add_option("--wildfire", options.smoother.wildfire_threshold, "wildfire threshold");
  app.add_option("--urgency", options.smoother.urgency,
                 "multiple of a threshold at which rounds repeat at once");
  app.add_option("--rounds", options.smoother.max_rounds, "most rounds per update");
  CLI11_PARSE(app, argc, argv);

  const ThreadLimit limit(options.threads);
  const auto graph = ReadG2o(options.path);
  if (!graph) {
    fmt::print(stderr, "{}\n", graph.error().message);
    return 2;
  }
  const Sequence sequence(*graph);
  const auto report = Run(options, sequence).Execute();
  if (!report) {
    fmt::print(stderr, "{}\n", report.error().message);
    return 3;
  }
  if (options.json) {
    fmt::print("{}\n", report->dump(2));
  } else {
    for (const auto& [key, value] : report->items()) fmt::print("{:28} {}\n", key, value.dump());
  }
  return 0;
}

}  // namespace
}  // namespace mlvi

int main(int argc, char** argv) { return mlvi::Main(argc, argv); }
