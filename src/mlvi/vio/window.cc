// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window.h"

#include "mlvi/base/error.h"
#include "mlvi/imu/imu_residual.h"

namespace mlvi {

NavState MoveState(const NavState& state, const Vector15d& step) {
  NavState moved = state;
  moved.T_world_body = BoxPlus(state.T_world_body, Vector6d(step.head<6>()));
  moved.v_world_body += step.segment<3>(frame_index::kVelocity);
  moved.bias.accelerometer += step.segment<3>(frame_index::kBias);
  moved.bias.gyroscope += step.segment<3>(frame_index::kBias + 3);
  return moved;
}

Vector15d StateStep(const NavState& from, const NavState& state) {
  Vector15d step;
  step << BoxMinus(state.T_world_body, from.T_world_body), state.v_world_body - from.v_world_body,
      state.bias.accelerometer - from.bias.accelerometer,
      state.bias.gyroscope - from.bias.gyroscope;
  return step;
}

ImuConnection Connect(std::span<const ImuSample> samples, Time from, Time to, const ImuBias& bias,
                      const ImuSpec& imu) {
  ImuConnection result;
  result.samples = SamplesBetween(samples, from, to);
  MLVI_CHECK(!result.samples.empty(), "no IMU between {} and {}", ToString(from), ToString(to));
  result.motion = Preintegrate(result.samples, bias, imu);
  result.sqrt_information = SqrtInformation(result.motion);
  return result;
}

int VioWindow::FindFrame(FrameId id) const {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].id == id) return static_cast<int>(i);
  }
  return -1;
}

void MoveWindow(VioWindow& window, const WindowLayout& layout, const Eigen::VectorXd& step) {
  for (int i = 0; i < layout.frames(); ++i) {
    window.frames[static_cast<std::size_t>(i)].Move(
        step.segment<frame_index::kSize>(layout.frame(i)));
  }
  const Eigen::VectorXd d = step.tail(layout.calibration_size());
  VioCalibration& c = window.calibration;
  if (layout.has_rig())
    c.T_body_pano = BoxPlus(c.T_body_pano, Vector6d(d.segment<6>(layout.rig())));
  if (layout.has_cameras()) {
    for (std::size_t i = 0; i < c.T_pano_camera.size(); ++i) {
      Pose3& T = c.T_pano_camera[i];
      T = BoxPlus(T, Vector6d(d.segment<6>(layout.camera(static_cast<int>(i)))));
    }
  }
  for (int i = 0; i < layout.times(); ++i) {
    c.time_offsets[static_cast<std::size_t>(i)] += d[layout.time(i)];
  }
}

Eigen::VectorXd CalibrationStep(const VioCalibration& from, const VioCalibration& to,
                                const WindowLayout& layout) {
  Eigen::VectorXd step(layout.calibration_size());
  if (layout.has_rig()) {
    step.segment<6>(layout.rig()) = BoxMinus(to.T_body_pano, from.T_body_pano);
  }
  if (layout.has_cameras()) {
    for (std::size_t i = 0; i < to.T_pano_camera.size(); ++i) {
      step.segment<6>(layout.camera(static_cast<int>(i))) =
          BoxMinus(to.T_pano_camera[i], from.T_pano_camera[i]);
    }
  }
  for (int i = 0; i < layout.times(); ++i) {
    const auto camera = static_cast<std::size_t>(i);
    step[layout.time(i)] = to.time_offsets[camera] - from.time_offsets[camera];
  }
  return step;
}

}  // namespace mlvi
