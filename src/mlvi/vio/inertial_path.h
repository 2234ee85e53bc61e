// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the IMU alone says that the body went, as a function of the few quantities that it cannot
// know (its first velocity, gravity and its biases) and of what its noise did on the way.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/imu/preintegration.h"

namespace mlvi {

// Frame `first`: the body at the first instant.
struct InertialUnknowns {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, at the first instant
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();   // m/s^2, pointing down
  ImuBias bias;                                        // constant over the path
};

// Order of their perturbations: velocity (3), gravity (2), accelerometer bias (3),
// gyroscope bias (3).
namespace inertial_index {
inline constexpr int kVelocity = 0, kGravity = 3, kAccelerometerBias = 5, kGyroscopeBias = 8;
inline constexpr int kSize = 11;
}  // namespace inertial_index

using InertialDelta = Eigen::Matrix<double, inertial_index::kSize, 1>;
using InertialMatrix = Eigen::Matrix<double, inertial_index::kSize, inertial_index::kSize>;

// What the IMU's white noise has made of the body's position (m, frame `first`), velocity (m/s,
// frame `first`) and rotation (right perturbation, rad) at one instant: the first nine of
// nav_index.
inline constexpr int kDisturbanceSize = 9;
using Disturbance = Eigen::Matrix<double, kDisturbanceSize, 1>;
using DisturbanceMatrix = Eigen::Matrix<double, kDisturbanceSize, kDisturbanceSize>;

// Derivative of gravity by its two perturbations, which turn it on its sphere.
Eigen::Matrix<double, 3, 2> GravityTangent(const Eigen::Vector3d& gravity);

// Velocity and biases add; gravity keeps its length.
InertialUnknowns BoxPlus(const InertialUnknowns& unknowns, const InertialDelta& delta);

class InertialPath {
 public:
  // Preintegrates from the first of `instants` (strictly ascending, at least one) to each, with the
  // biases at `bias`; others are reached to first order.
  InertialPath(std::span<const Time> instants, std::span<const ImuSample> samples,
               const ImuBias& bias, const ImuSpec& imu);

  std::size_t size() const { return motions_.size() + 1; }
  // s, since the first instant.
  double Elapsed(std::size_t k) const { return k == 0 ? 0.0 : motions_[k - 1].dt(); }

  // The body at instant k, with derivatives by the unknowns and by the disturbance there.
  struct Step {
    Pose3 T_first_body;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       // m/s, frame `first`
    Eigen::Matrix<double, 6, inertial_index::kSize> d_pose =  // in the pose chart
        Eigen::Matrix<double, 6, inertial_index::kSize>::Zero();
    Eigen::Matrix<double, 3, inertial_index::kSize> d_velocity =
        Eigen::Matrix<double, 3, inertial_index::kSize>::Zero();
    Eigen::Matrix<double, 6, kDisturbanceSize> d_disturbance =  // in the pose chart
        Eigen::Matrix<double, 6, kDisturbanceSize>::Zero();
  };
  // Nothing disturbs the first instant. Contract: a disturbance of zero at k = 0.
  Step At(std::size_t k, const InertialUnknowns& unknowns,
          const Disturbance& disturbance = Disturbance::Zero()) const;
  // At every instant. `disturbances`: one per instant, or none at all.
  std::vector<Step> Steps(const InertialUnknowns& unknowns,
                          std::span<const Disturbance> disturbances = {}) const;

  // How the disturbance of the instant before becomes that of instant k > 0, to first order:
  // d(k) = transition d(k-1) + w, w of the given covariance.
  struct Disturbing {
    DisturbanceMatrix transition = DisturbanceMatrix::Identity();
    DisturbanceMatrix covariance = DisturbanceMatrix::Zero();
  };
  const Disturbing& DisturbingBefore(std::size_t k) const { return disturbing_[k - 1]; }

  // How badly the IMU's noise could be mistaken for the motion that shows scale: of the positions
  // that the IMU knows, what no constant velocity and acceleration explain, and the same of noise
  // alone (white acceleration, and tilt by white rates), both as rms over instants. Their ratio
  // bounds the relative error of the scale from below; without three instants both are zero.
  struct Excitation {
    double path = 0.0;   // m
    double noise = 0.0;  // m

    double ScaleSigma() const { return path > 0.0 ? noise / path : kNoScale; }
    static constexpr double kNoScale = 1e3;
  };
  Excitation FindExcitation(const ImuNoise& noise, double gravity) const;

 private:
  std::vector<PreintegratedImu> motions_;  // from the first instant to the second, third, ...
  std::vector<Disturbing> disturbing_;     // on the way to the second, third, ...
};

}  // namespace mlvi
