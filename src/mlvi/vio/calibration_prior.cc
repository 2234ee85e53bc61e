// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibration_prior.h"

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
  if (layout.has_time()) {
    result.push_back({layout.time(),
                      1,
                      {now.time_offset - nominal.time_offset, 0.0, 0.0},
                      config.time_offset_sigma});
  }
  return result;
}

}  // namespace

double CalibrationPriorCost(const VioWindow& window, const WindowConfig& config) {
  double cost = 0.0;
  for (const Deviation& d : Deviations(window, config)) {
    cost += d.Cost();
  }
  return cost;
}

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
  system.cost += cost;
}

}  // namespace mlvi
