// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/image_motion.h"

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

// Any: the rate at its end is asked for.
constexpr Duration kMoment = Duration::FromMilliseconds(1);

}  // namespace

ImageTiming TimeImage(std::span<const ImuSample> samples, Time frame, Duration delay,
                      const ImuBias& bias, const ImuSpec& imu) {
  MLVI_CHECK(delay <= Duration(), "an image {} s after its set", delay.seconds());
  const bool same = delay == Duration();
  const Time from = frame + (same ? -kMoment : delay);
  const std::vector<ImuSample> between = SamplesBetween(samples, from, frame);
  MLVI_CHECK(!between.empty(), "no IMU between {} and {}", ToString(from), ToString(frame));
  if (same) return {.until_frame = {}, .angular_rate = between.back().angular_velocity};
  return {.until_frame = Preintegrate(between, bias, imu),
          .angular_rate = between.front().angular_velocity};
}

// The frame's state is the one that preintegration leads to from the image's; solved for the latter.
ImageMotion MotionOfImage(const ImageTiming& timing, const NavState& frame, double gravity) {
  const Eigen::Quaterniond R_body_world = frame.T_world_body.rotation().conjugate();
  const Eigen::Vector3d velocity = R_body_world * frame.v_world_body;
  ImageMotion motion;
  if (!timing.until_frame) {
    motion.twist << velocity, timing.angular_rate - frame.bias.gyroscope;
    return motion;
  }
  const PreintegratedImu between = CorrectedForBias(*timing.until_frame, frame.bias);
  const double dt = between.dt();
  const Eigen::Vector3d g = R_body_world * Eigen::Vector3d(0.0, 0.0, -gravity);
  const Eigen::Quaterniond R_body_image = between.delta_R.conjugate();
  const Eigen::Vector3d dv = R_body_image * between.delta_v, dp = R_body_image * between.delta_p;
  motion.T_body_image = Pose3(R_body_image, -dt * velocity + 0.5 * dt * dt * g + dt * dv - dp);
  motion.twist << between.delta_R * (velocity - dt * g - dv),
      timing.angular_rate - frame.bias.gyroscope;
  return motion;
}

ImagePlace::ImagePlace(const Pose3& T_world_body, const ImageMotion& motion, double time_offset)
    : T_world_image(T_world_body), by_time_offset(motion.twist) {
  Pose3 T_body_image = motion.T_body_image;
  if (time_offset != 0.0) {
    const Vector6d step = time_offset * motion.twist;
    const Eigen::Quaterniond turn = ExpSo3(Eigen::Vector3d(step.tail<3>()));
    T_body_image = T_body_image * Pose3(turn, step.head<3>());
    by_time_offset.head<3>() = turn.conjugate() * motion.twist.head<3>();
  }
  const Eigen::Vector3d t = T_body_image.translation();
  moved = !t.isZero(0.0) || !T_body_image.rotation().vec().isZero(0.0);
  if (!moved) return;
  T_world_image = T_world_body * T_body_image;
  const Eigen::Matrix3d Rt = T_body_image.R().transpose();
  by_pose << Rt, -Rt * Hat(t), Eigen::Matrix3d::Zero(), Rt;
}

}  // namespace mlvi
