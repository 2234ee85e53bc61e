// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibration_prior.h"

#include <cmath>
#include <utility>
#include <vector>

#include "mlvi/geometry/robust_kernels.h"

namespace mlvi {
namespace {

constexpr CauchyKernel kKernel{1.0};

// The deviation of some coordinates of the calibration. Its derivative by their step counts as the
// identity, which gives the exact gradient of its norm.
struct Deviation {
  int start = 0;  // within the calibration
  int size = 0;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  // of which `size` count
  double sigma = 1.0;
  bool heavy_tails = true;

  double squared_sigmas() const { return value.squaredNorm() / (sigma * sigma); }
  double Cost() const {
    return 0.5 * (heavy_tails ? kKernel.Cost(squared_sigmas()) : squared_sigmas());
  }
  double Information() const {
    return (heavy_tails ? kKernel.Weight(squared_sigmas()) : 1.0) / (sigma * sigma);
  }
};

std::vector<Deviation> Deviations(const VioWindow& window, const WindowConfig& config) {
  const WindowLayout layout = window.Layout(config);
  const VioCalibration &now = window.calibration, &nominal = window.nominal;
  std::vector<Deviation> result;
  const auto add_pose = [&](int start, const Pose3& T, const Pose3& T_nominal) {
    const Eigen::Vector3d moved =
        T.rotation().conjugate() * (T.translation() - T_nominal.translation());
    result.push_back({start, 3, moved, config.extrinsics_translation_sigma, false});
    result.push_back(
        {start + 3, 3, BoxMinus(T, T_nominal).tail<3>(), config.extrinsics_rotation_sigma});
  };
  if (layout.has_rig()) add_pose(layout.rig(), now.T_body_pano, nominal.T_body_pano);
  for (int i = 0; layout.has_cameras() && i < static_cast<int>(now.T_pano_camera.size()); ++i) {
    const auto camera = static_cast<std::size_t>(i);
    add_pose(layout.camera(i), now.T_pano_camera[camera], nominal.T_pano_camera[camera]);
  }
  return result;
}

// Deviations of the time offsets of all cameras, and what explains them: a part that all share and
// what each differs by from it.
class TimeOffsets {
 public:
  TimeOffsets(Eigen::VectorXd deviations, const WindowConfig& config)
      : deviations_(std::move(deviations)),
        common_information_(1.0 / (config.time_offset_sigma * config.time_offset_sigma)),
        own_information_(
            1.0 / (config.time_offset_difference_sigma * config.time_offset_difference_sigma)) {
    FindCommon();
  }

  double Cost() const { return CostAt(common_); }
  // Of the least cost over the common part, by the deviations. At the least the common part does
  // not change the cost to first order, so the gradient is that for the common part held.
  Eigen::VectorXd Gradient() const {
    return Weights(common_).cwiseProduct((deviations_.array() - common_).matrix());
  }
  // Reweighted; with the common part eliminated.
  Eigen::MatrixXd Information() const {
    const Eigen::VectorXd w = Weights(common_);
    Eigen::MatrixXd information = w.asDiagonal();
    information -= w * w.transpose() / (CommonWeight(common_) + w.sum());
    return information;
  }

 private:
  double CostAt(double common) const {
    double cost = kKernel.Cost(common_information_ * common * common);
    for (const double d : deviations_) {
      cost += kKernel.Cost(own_information_ * (d - common) * (d - common));
    }
    return 0.5 * cost;
  }
  double CommonWeight(double common) const {
    return common_information_ * kKernel.Weight(common_information_ * common * common);
  }
  Eigen::VectorXd Weights(double common) const {
    return deviations_.unaryExpr([&](double d) {
      return own_information_ * kKernel.Weight(own_information_ * (d - common) * (d - common));
    });
  }
  // Heavy tails have several minima: one near every camera and one near the rig file, at most.
  void FindCommon() {
    const auto descend = [&](double common) {
      for (int i = 0; i < kMaxIterations; ++i) {
        const Eigen::VectorXd w = Weights(common);
        const double next = w.dot(deviations_) / (CommonWeight(common) + w.sum());
        if (std::abs(next - common) < kConverged) return next;
        common = next;
      }
      return common;
    };
    common_ = descend(0.0);
    for (const double start : deviations_) {
      const double found = descend(start);
      if (CostAt(found) < CostAt(common_)) common_ = found;
    }
  }

  static constexpr int kMaxIterations = 200;
  static constexpr double kConverged = 1e-15;  // s

  Eigen::VectorXd deviations_;  // s
  double common_information_, own_information_;
  double common_ = 0.0;  // s
};

TimeOffsets TimeOffsetsOf(const VioWindow& window, const WindowConfig& config) {
  const auto cameras = static_cast<Eigen::Index>(window.calibration.time_offsets.size());
  const Eigen::Map<const Eigen::VectorXd> now(window.calibration.time_offsets.data(), cameras);
  const Eigen::Map<const Eigen::VectorXd> nominal(window.nominal.time_offsets.data(), cameras);
  return {now - nominal, config};
}

}  // namespace

void AddCalibrationPrior(const VioWindow& window, const WindowConfig& config,
                         LinearizedWindow& system) {
  double cost = 0.0;
  for (const Deviation& d : Deviations(window, config)) {
    const double information = d.Information();
    const int start = system.layout.calibration() + d.start;
    system.H.diagonal().segment(start, d.size).array() += information;
    system.b.segment(start, d.size) -= information * d.value.head(d.size);
    cost += d.Cost();
  }
  if (const int times = system.layout.times(); times > 0) {
    const TimeOffsets offsets = TimeOffsetsOf(window, config);
    const int start = system.layout.calibration() + system.layout.time(0);
    system.H.block(start, start, times, times).triangularView<Eigen::Upper>() +=
        offsets.Information();
    system.b.segment(start, times) -= offsets.Gradient();
    cost += offsets.Cost();
  }
  system.cost += cost;
}

}  // namespace mlvi
