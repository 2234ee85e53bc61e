// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/imu/initialization.h"
#include "mlvi/lio/registration.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// The first states of the odometry: those at the ends of all sweeps kept back, with their sweeps.
struct StartResult {
  std::vector<NavState> states;
  Matrix15d covariance;  // of the last state
  // For every state k, of its pose as seen from the last one, T_last_k (pose chart; zero for the
  // last).
  std::vector<Matrix6d> relative;
  std::vector<LidarSweep> sweeps;
  // What the registration of each sweep told, no better than StartInformation(). The first one is
  // where the others are registered to.
  std::vector<Degeneracy> degeneracies;
  std::string method;  // "static" or "moving"
  // In the world of the states: the body at the end of the first sweep that was given, which may
  // have been dropped since.
  Pose3 T_world_first;
};

// The start seen from another level world.
StartResult InWorld(const Pose3& T_world_level, StartResult start);

// Finds the first states. At rest: gravity and gyroscope bias from the IMU, once the registered
// sweeps agree that nothing moves. Moving: sweeps are registered one after the other against a
// growing map in the frame of the first, with the gyroscopes as rotation prior and the last speed
// as translation prior; gravity, velocities and biases then follow from making these poses agree
// with the IMU (imu/initialization.h).
class Start {
 public:
  Start(const LioConfig& config, const Rig& rig);

  // Takes the next sweep and the samples up to its end. Empty while more is needed; why() tells
  // what for. After a pause of more than max_span all begins anew.
  std::optional<StartResult> Add(const LidarSweep& sweep, std::span<const ImuSample> imu);
  const std::string& why() const { return why_; }
  // The end of the newest sweep; invalid before the first.
  Time newest_end() const { return kept_.empty() ? Time() : kept_.back().sweep.end(); }

 private:
  struct Kept {
    LidarSweep sweep;
    Pose3 T_start_body;   // at the end of the sweep
    Matrix6d covariance;  // of its registration, pose chart
    SweepFeatures features;
    Degeneracy degeneracy;  // of its registration, axes in the start frame
  };

  void BeginAnew();
  Kept Registered(const LidarSweep& sweep) const;
  void RebuildMap();
  void DropOldest();
  bool AtRest() const;
  bool TellsTurn() const;
  bool TellsPlace() const;
  double Span() const;                   // s
  Eigen::Vector3d LastVelocity() const;  // m/s, of the last step, in the start frame
  Eigen::Vector3d TurnRate() const;      // rad/s, mean, body frame, by the registered sweeps
  double TurnRateSigma() const;          // rad/s, of TurnRate() at rest
  std::optional<Initialization> LevelAtRest();
  void AddSlowMotion(NavState& last, Matrix15d& covariance) const;
  void AddSweeps(const Eigen::Matrix3d& R_world_start, StartResult& result) const;
  Matrix6d RegisteredAtRest(const Kept& kept) const;
  std::vector<Matrix6d> RelativeAtRest() const;
  std::optional<StartResult> TryStatic();
  std::optional<StartResult> TryMoving();

  const LioConfig& config_;
  const Rig& rig_;
  std::deque<Kept> kept_;
  std::vector<ImuSample> imu_;
  LocalMap map_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // in the start frame
  std::string why_;
};

// What a registration of the start tells of a pose at best (pose chart).
Matrix6d StartInformation();

// States through `samples` with rotation by the gyroscopes and the constant velocity of `anchor`,
// which is one of them: the state at anchor.stamp, within the span of the samples. For deskewing
// and guessing before gravity and biases are known.
std::vector<NavState> GyroTrajectory(const NavState& anchor, std::span<const ImuSample> samples);

}  // namespace mlvi
