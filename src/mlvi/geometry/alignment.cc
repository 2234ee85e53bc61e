// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/alignment.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

// Of the largest singular value of the covariance: below it a direction is rounding.
constexpr double kRankTolerance = 1e-12;

// Weighted first and second moments of the two sets.
struct Moments {
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // of (target - mean) (source - mean)^T
  double source_variance = 0.0;
};

Moments ComputeMoments(std::span<const Eigen::Vector3d> source,
                       std::span<const Eigen::Vector3d> target, std::span<const double> weights) {
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  Moments m;
  double sum = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    sum += weight(i);
    m.source_mean += weight(i) * source[i];
    m.target_mean += weight(i) * target[i];
  }
  m.source_mean /= sum;
  m.target_mean /= sum;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d d = source[i] - m.source_mean;
    m.cross += weight(i) / sum * (target[i] - m.target_mean) * d.transpose();
    m.source_variance += weight(i) / sum * d.squaredNorm();
  }
  return m;
}

Similarity3 Complete(const Moments& m, const Eigen::Quaterniond& rotation, double scale) {
  return {.scale = scale,
          .pose = Pose3(rotation, m.target_mean - scale * (rotation * m.source_mean))};
}

tl::unexpected<Error> Degenerate(std::size_t count, const char* kind, const char* remedy,
                                 double extent) {
  return MakeError(ErrorKind::kInput,
                   "alignment '{}' of {} points is not determined: their extent in the weakest "
                   "needed direction is "
                   "{:.3g} m. {}",
                   kind, count, extent, remedy);
}

Expected<Similarity3> AlignYaw(const Moments& m, std::size_t count) {
  const double cosine = m.cross(0, 0) + m.cross(1, 1), sine = m.cross(1, 0) - m.cross(0, 1);
  const double strength = std::hypot(cosine, sine);
  const double scale = m.cross.norm() + m.source_variance;
  if (!(strength > kRankTolerance * scale)) {
    return Degenerate(count, "yaw", "The motion is vertical or none: use no alignment",
                      std::sqrt(strength));
  }
  const double yaw = std::atan2(sine, cosine);
  return Complete(m, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), 1.0);
}

Expected<Similarity3> AlignFull(const Moments& m, std::size_t count, bool with_scale) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  if (!(d[1] > kRankTolerance * std::max(d[0], m.source_variance))) {
    return Degenerate(count, with_scale ? "sim3" : "se3",
                      "The points lie on one line or in one place: use 'yaw' or no alignment",
                      std::sqrt(d[1]));
  }
  // A reflection is not a rotation: turn the weakest direction (Umeyama, Eq. 43).
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign[2] = -1.0;
  const Eigen::Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const double scale = with_scale ? d.dot(sign) / m.source_variance : 1.0;
  return Complete(m, Eigen::Quaterniond(R), scale);
}

}  // namespace

Expected<Similarity3> AlignPoints(std::span<const Eigen::Vector3d> source,
                                  std::span<const Eigen::Vector3d> target, AlignmentKind kind,
                                  std::span<const double> weights) {
  MLVI_CHECK(source.size() == target.size(), "{} source points, {} target points", source.size(),
             target.size());
  MLVI_CHECK(weights.empty() || weights.size() == source.size(), "{} weights for {} points",
             weights.size(), source.size());
  if (kind == AlignmentKind::kNone) return Similarity3{};
  const bool any_weight = weights.empty() || std::any_of(weights.begin(), weights.end(),
                                                         [](double w) { return w > 0.0; });
  if (source.empty() || !any_weight)
    return MakeError(ErrorKind::kInput, "alignment: no points with weight");
  const Moments moments = ComputeMoments(source, target, weights);
  if (!moments.cross.allFinite())
    return MakeError(ErrorKind::kInput, "alignment: a point is not finite");
  if (kind == AlignmentKind::kYaw) return AlignYaw(moments, source.size());
  return AlignFull(moments, source.size(), kind == AlignmentKind::kSim3);
}

}  // namespace mlvi
