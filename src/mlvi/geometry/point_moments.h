// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mlvi {

// Number, mean and covariance of points, added one at a time or set by set. Sums are taken relative
// to the first point, so a patch of millimetres far from the origin loses no digits.
class PointMoments {
 public:
  void Add(const Eigen::Vector3d& point) {
    if (count_ == 0) origin_ = point;
    const Eigen::Vector3d d = point - origin_;
    ++count_;
    sum_ += d;
    outer_.noalias() += d * d.transpose();
  }
  void Add(const PointMoments& other) {
    if (other.count_ == 0) return;
    if (count_ == 0) {
      *this = other;
      return;
    }
    const double n = other.count_;
    const Eigen::Vector3d shift = other.origin_ - origin_;
    outer_ += other.outer_ + shift * other.sum_.transpose() + other.sum_ * shift.transpose() +
              n * shift * shift.transpose();
    sum_ += other.sum_ + n * shift;
    count_ += other.count_;
  }

  int count() const { return count_; }
  // The mean; zero when there is no point.
  Eigen::Vector3d centroid() const {
    return count_ > 0 ? Eigen::Vector3d(origin_ + sum_ / count_) : origin_;
  }
  // Mean squared deviation (division by n), m^2; zero when there is no point.
  Eigen::Matrix3d covariance() const {
    if (count_ == 0) return outer_;
    const Eigen::Vector3d mean = sum_ / count_;
    return outer_ / count_ - mean * mean.transpose();
  }

 private:
  int count_ = 0;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d outer_ = Eigen::Matrix3d::Zero();
};

// Shape of a neighbourhood by its eigenvalues l0 <= l1 <= l2 (Weinmann et al. 2015); the three
// measures sum to 1.
inline double Linearity(const Eigen::Vector3d& rising) {
  return (rising[2] - rising[1]) / rising[2];
}
inline double Planarity(const Eigen::Vector3d& rising) {
  return (rising[1] - rising[0]) / rising[2];
}
inline double Scattering(const Eigen::Vector3d& rising) { return rising[0] / rising[2]; }

}  // namespace mlvi
