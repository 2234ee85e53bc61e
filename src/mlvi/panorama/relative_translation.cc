// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/relative_translation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mlvi/base/random.h"
#include "mlvi/panorama/outlier_limit.h"

namespace mlvi {
namespace {

// m: a shorter baseline has no direction.
constexpr double kNoBaseline = 1e-6;
// |n_1 x n_2| of unit normals below which two pairs do not tell a line.
constexpr double kNoLine = 1e-3;
constexpr int kRefinementSteps = 4;
// Without a translation both components of a bearing are errors, with one the second is the depth,
// an unknown per point: the better fit is worth this much per point less (Akaike gives 2 for a free
// one; depths are bounded on one side).
constexpr double kRestBonus = 1.0;

// A pair with its second direction turned into the frame of the first: c = t + baseline.
struct Constraint {
  Eigen::Vector3d f_a, f_b, normal, baseline;
  double variance_a, variance_b;  // rad^2
};

Constraint MakeConstraint(const RayPair& pair, const Eigen::Matrix3d& R) {
  Constraint c;
  c.f_a = pair.first.direction;
  c.f_b = R * pair.second.direction;
  c.normal = c.f_a.cross(c.f_b);
  c.baseline = R * pair.second.origin - pair.first.origin;
  c.variance_a = pair.first.sigma * pair.first.sigma;
  c.variance_b = pair.second.sigma * pair.second.sigma;
  return c;
}

// By how much the parallax of the pair, seen in the epipolar plane, leaves the range of depths in
// [min_depth, inf).
double ParallaxViolation(const Constraint& k, const Eigen::Vector3d& c, double min_depth) {
  const double sine_a = c.cross(k.f_a).norm(), cosine_a = c.dot(k.f_a);
  const double parallax =
      std::atan2(c.cross(k.f_b).norm(), c.dot(k.f_b)) - std::atan2(sine_a, cosine_a);
  if (parallax < 0.0) return parallax;
  return std::max(0.0, parallax - std::atan2(sine_a, min_depth - cosine_a));
}

double SquaredError(const Constraint& k, const Eigen::Vector3d& t, double min_depth) {
  const Eigen::Vector3d c = t + k.baseline;
  const double variance = k.variance_a + k.variance_b;
  if (c.squaredNorm() < kNoBaseline * kNoBaseline) return (k.f_a - k.f_b).squaredNorm() / variance;
  const double epipolar = c.dot(k.normal);
  const double weight =
      k.variance_a * c.cross(k.f_b).squaredNorm() + k.variance_b * c.cross(k.f_a).squaredNorm();
  const double violation = ParallaxViolation(k, c, min_depth);
  return epipolar * epipolar / std::max(weight, 1e-300) + violation * violation / variance;
}

class Estimator {
 public:
  Estimator(std::vector<Constraint> constraints, const RelativeTranslationConfig& config)
      : constraints_(std::move(constraints)),
        config_(config),
        limit_(config.inlier_sigmas * config.inlier_sigmas) {}

  RelativeTranslation Run(const std::optional<Eigen::Vector3d>& predicted) {
    Try(Eigen::Vector3d::Zero());
    best_.score -= RestBonus();
    if (predicted) Try(*predicted);
    const double length = predicted && predicted->norm() > kNoBaseline
                              ? predicted->norm()
                              : config_.nominal_translation;
    RandomStream random(static_cast<std::uint64_t>(config_.seed), "relative translation");
    const auto count = static_cast<double>(constraints_.size());
    int needed = constraints_.size() >= 3 ? config_.max_iterations : 0;
    for (; best_.iterations < needed; ++best_.iterations) {
      const auto draw = [&] { return static_cast<std::size_t>(random.Uniform() * count); };
      const std::size_t i = draw(), j = draw(), k = draw();
      if (Hypothesise(constraints_[i], constraints_[j], constraints_[k], length)) {
        needed = std::min(needed, IterationsNeeded());
      }
    }
    Refine();
    Tighten();
    Refine();
    return Finish();
  }

 private:
  double Score(const Eigen::Vector3d& t) const {
    double score = 0.0;
    for (const Constraint& constraint : constraints_) {
      score += std::min(SquaredError(constraint, t, config_.min_depth), limit_);
      if (score >= best_.score) break;
    }
    return score;
  }

  bool Try(const Eigen::Vector3d& t) {
    if (!(t.norm() <= config_.max_translation)) return false;
    const double score = Score(t);
    if (score >= best_.score) return false;
    best_.score = score;
    best_.t_first_second = t;
    return true;
  }

  // t = t_0 + s d from two pairs, s from the third one and from the length.
  bool Hypothesise(const Constraint& first, const Constraint& second, const Constraint& third,
                   double length) {
    const double norm_1 = first.normal.norm(), norm_2 = second.normal.norm();
    if (norm_1 == 0.0 || norm_2 == 0.0) return false;
    const Eigen::Vector3d n_1 = first.normal / norm_1, n_2 = second.normal / norm_2;
    const Eigen::Vector3d cross = n_1.cross(n_2);
    const double sine2 = cross.squaredNorm();
    if (sine2 < kNoLine * kNoLine) return false;
    const double h_1 = -n_1.dot(first.baseline), h_2 = -n_2.dot(second.baseline);
    const Eigen::Vector3d t_0 = (h_1 * n_2.cross(cross) + h_2 * cross.cross(n_1)) / sine2;
    const Eigen::Vector3d d = cross / std::sqrt(sine2);
    const double along = std::sqrt(std::max(0.0, length * length - t_0.squaredNorm()));
    bool better = Try(t_0 + along * d);
    better |= Try(t_0 - along * d);
    const double slope = third.normal.dot(d);
    if (std::abs(slope) > kNoLine * third.normal.norm()) {
      better |= Try(t_0 - third.normal.dot(third.baseline + t_0) / slope * d);
    }
    return better;
  }

  bool IsInlier(const Constraint& constraint) const {
    return SquaredError(constraint, best_.t_first_second, config_.min_depth) < limit_;
  }

  int CountInliers() const {
    return static_cast<int>(
        std::count_if(constraints_.begin(), constraints_.end(),
                      [&](const Constraint& constraint) { return IsInlier(constraint); }));
  }

  // Samples are judged by the limit that serves the worst images; what is an inlier then follows the
  // scatter of these pairs.
  void Tighten() {
    std::vector<double> errors;
    for (const Constraint& constraint : constraints_) {
      errors.push_back(
          std::sqrt(SquaredError(constraint, best_.t_first_second, config_.min_depth)));
    }
    const double limit =
        OutlierLimit(std::move(errors), config_.least_sigmas, config_.scatter_factor);
    limit_ = std::min(limit_, limit * limit);
    best_.score = std::numeric_limits<double>::infinity();
    best_.score = Score(best_.t_first_second) - RestBonus();
  }

  double RestBonus() const {
    return best_.t_first_second.isZero(0.0) ? kRestBonus * CountInliers() : 0.0;
  }

  // So many that one sample of three has been free of outliers with the confidence wanted.
  int IterationsNeeded() const {
    const double share = CountInliers() / static_cast<double>(constraints_.size());
    const double good = std::clamp(share * share * share, 1e-9, 1.0 - 1e-9);
    return static_cast<int>(
        std::min(1e6, std::ceil(std::log(1.0 - config_.confidence) / std::log1p(-good))));
  }

  // Gauss-Newton on the epipolar errors of the inliers; directions that they do not tell stay where
  // they are.
  void Refine() {
    for (int step = 0; step < kRefinementSteps; ++step) {
      Eigen::Vector3d gradient;
      Eigen::Matrix3d hessian = Accumulate(best_.t_first_second, &gradient);
      hessian.diagonal().array() += 1e-3 * hessian.trace() / 3.0 + 1e-12;
      if (!Try(best_.t_first_second - hessian.ldlt().solve(gradient))) return;
    }
  }

  Eigen::Matrix3d Accumulate(const Eigen::Vector3d& t, Eigen::Vector3d* gradient) const {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    gradient->setZero();
    for (const Constraint& k : constraints_) {
      const Eigen::Vector3d c = t + k.baseline;
      if (c.norm() < kNoBaseline || !(SquaredError(k, t, config_.min_depth) < limit_)) continue;
      const double weight =
          k.variance_a * c.cross(k.f_b).squaredNorm() + k.variance_b * c.cross(k.f_a).squaredNorm();
      const double root = std::sqrt(std::max(weight, 1e-300));
      const double error = c.dot(k.normal) / root;
      const Eigen::Vector3d d_weight = 2.0 * (k.variance_a * (c - k.f_b * k.f_b.dot(c)) +
                                              k.variance_b * (c - k.f_a * k.f_a.dot(c)));
      const Eigen::Vector3d jacobian = k.normal / root - 0.5 * error / weight * d_weight;
      hessian += jacobian * jacobian.transpose();
      *gradient += error * jacobian;
    }
    return hessian;
  }

  RelativeTranslation Finish() {
    best_.inliers.reserve(constraints_.size());
    for (const Constraint& constraint : constraints_) {
      const bool in = IsInlier(constraint);
      best_.inliers.push_back(in ? 1 : 0);
      best_.inlier_count += in ? 1 : 0;
    }
    Eigen::Vector3d gradient;
    best_.information = Accumulate(best_.t_first_second, &gradient);
    return std::move(best_);
  }

  std::vector<Constraint> constraints_;
  const RelativeTranslationConfig& config_;
  double limit_;
  RelativeTranslation best_{.score = std::numeric_limits<double>::infinity()};
};

}  // namespace

void RelativeTranslationConfig::Declare(ConfigDeclaration& d) {
  d.Field("inlier_sigmas", inlier_sigmas, "", "Largest error of an inlier, in sigmas of bearings",
          {0.5, 20.0});
  d.Field("scatter_factor", scatter_factor, "",
          "It follows the scatter of the pairs: so many times one sigma of it, within these limits",
          {1.0, 100.0});
  d.Field("least_sigmas", least_sigmas, "", "The least that this limit may be, in sigmas",
          {0.01, 20.0});
  d.Field("min_depth", min_depth, "m", "Nearer points than this do not exist", {0.0, 10.0});
  d.Field("nominal_translation", nominal_translation, "m",
          "Length of the translation where neither prediction nor cameras tell it", {1e-3, 10.0});
  d.Field("max_translation", max_translation, "m", "Longest translation between two frames",
          {1e-2, 1000.0});
  d.Field("confidence", confidence, "", "That a sample without outliers was drawn",
          {0.5, 0.999999});
  d.Field("max_iterations", max_iterations, "", "Samples drawn at most", {1.0, 10000.0});
  d.Field("seed", seed, "", "Of the samples", {0.0, 1e9});
}

double SquaredPairError(const RayPair& pair, const Eigen::Matrix3d& R_first_second,
                        const Eigen::Vector3d& t_first_second, double min_depth) {
  return SquaredError(MakeConstraint(pair, R_first_second), t_first_second, min_depth);
}

RelativeTranslation EstimateRelativeTranslation(std::span<const RayPair> pairs,
                                                const Eigen::Quaterniond& R_first_second,
                                                const std::optional<Eigen::Vector3d>& predicted,
                                                const RelativeTranslationConfig& config) {
  const Eigen::Matrix3d R = R_first_second.toRotationMatrix();
  std::vector<Constraint> constraints;
  constraints.reserve(pairs.size());
  for (const RayPair& pair : pairs) constraints.push_back(MakeConstraint(pair, R));
  return Estimator(std::move(constraints), config).Run(predicted);
}

}  // namespace mlvi
