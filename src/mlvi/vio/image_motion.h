// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Images of one set need not be of one instant: cameras run freely, and stamps are off. The state
// of a frame holds at the stamp of its set; an image is compared with the pose at its own instant:
//
//   T_world_image = T_world_body D Exp(time_offset twist),
//
// where D is what the IMU says that the body moved by from the set's stamp to the image's, and the
// second factor leads on by what its stamp is off. D by the IMU, rather than by a constant
// velocity: half a period of 10 Hz is 50 ms, over which a hand that turns by 5 rad/s^2 is 2 px off.
// The time offset has a constant velocity, which is exact to first order; VINS-Mono (Qin and Shen,
// "Online Temporal Calibration for Monocular Visual-Inertial Systems", IROS 2018) moves pixels
// instead, by velocities that carry the noise of tracking.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/imu/preintegration.h"

namespace mlvi {

// How the body moves at the stamp of one image.
struct ImageMotion {
  Pose3 T_body_image;                 // D: the body then, in the body at the frame's stamp
  Vector6d twist = Vector6d::Zero();  // velocity and angular rate then, in the body's axes then
};

// What the IMU knows about one image of a frame.
struct ImageTiming {
  std::optional<PreintegratedImu>
      until_frame;  // from the image's stamp to the frame's; empty: same
  Eigen::Vector3d angular_rate = Eigen::Vector3d::Zero();  // rad/s, at the image, with its bias
};

// `delay`: of the image's stamp against the frame's, <= 0. `samples` cover both.
ImageTiming TimeImage(std::span<const ImuSample> samples, Time frame, Duration delay,
                      const ImuBias& bias, const ImuSpec& imu);

// For a state of the frame.
ImageMotion MotionOfImage(const ImageTiming& timing, const NavState& frame, double gravity);

// The body at the instant of an image, and how that depends on the frame's pose and on the time
// offset, in the pose charts at both ends.
struct ImagePlace {
  ImagePlace(const Pose3& T_world_body, const ImageMotion& motion, double time_offset);

  Pose3 T_world_image;
  bool moved = false;  // false: by_pose is the identity
  Matrix6d by_pose = Matrix6d::Identity();
  Vector6d by_time_offset = Vector6d::Zero();
};

}  // namespace mlvi
