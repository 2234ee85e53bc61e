// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A world of boxes, an analytic motion and the sensors moving in it, for the tests of this module.
// Exact but for the noise that a test asks for.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi::test {

struct Box {
  Eigen::Vector3d low, high;
};

// Rays end at the inside of the room or at the outside of an obstacle.
struct BoxWorld {
  Box room;
  std::vector<Box> obstacles;

  double Range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    double range = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] == 0.0) continue;
      const double wall = direction[axis] > 0.0 ? room.high[axis] : room.low[axis];
      range = std::min(range, (wall - origin[axis]) / direction[axis]);
    }
    for (const Box& box : obstacles) {
      const Eigen::Array3d a = (box.low - origin).array() / direction.array();
      const Eigen::Array3d b = (box.high - origin).array() / direction.array();
      const double enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
      if (enter > 0.0 && enter < leave) range = std::min(range, enter);
    }
    return range;
  }

  // Of a point to the nearest plane that one of the boxes' faces lies in (m).
  double DistanceToFaces(const Eigen::Vector3d& point) const {
    double distance = std::min((point - room.low).cwiseAbs().minCoeff(),
                               (point - room.high).cwiseAbs().minCoeff());
    for (const Box& box : obstacles) {
      distance = std::min({distance, (point - box.low).cwiseAbs().minCoeff(),
                           (point - box.high).cwiseAbs().minCoeff()});
    }
    return distance;
  }
};

// A room of 12 x 8 x 4 m with four pillars and a table.
inline BoxWorld FurnishedRoom() {
  return {{{-6.0, -4.0, -1.2}, {6.0, 4.0, 2.8}},
          {{{2.0, 1.5, -1.2}, {2.6, 2.1, 2.8}},
           {{-3.0, 1.8, -1.2}, {-2.4, 2.4, 2.8}},
           {{2.6, -2.6, -1.2}, {3.2, -2.0, 2.8}},
           {{-3.4, -2.4, -1.2}, {-2.8, -1.8, 2.8}},
           {{-0.8, -3.4, -1.2}, {0.9, -2.5, -0.3}}}};
}

// Nothing but two walls, floor and ceiling, 200 m long.
inline BoxWorld EndlessCorridor() { return {{{-100.0, -1.2, -1.2}, {100.0, 1.2, 1.6}}, {}}; }

// Swinging about the origin; `speed` 0 is rest. Rates up to about speed rad/s.
struct SwingMotion {
  double speed = 1.0;

  Pose3 At(double t) const {
    const double s = speed * t;
    const double a = speed == 0.0 ? 0.0 : 1.0;
    return Pose3(ExpSo3(a * Eigen::Vector3d(0.2 * std::sin(1.3 * s), 0.15 * std::sin(1.7 * s),
                                            0.9 * std::sin(0.8 * s))),
                 a * Eigen::Vector3d(1.2 * std::sin(0.5 * s), 0.7 * std::sin(0.7 * s + 0.4) - 0.272,
                                     0.2 * std::sin(s)));
  }
  NavState StateAt(double t, Time begin) const {
    constexpr double kStep = 1e-4;
    NavState state;
    state.stamp = begin + Duration::FromSeconds(t);
    state.T_world_body = At(t);
    state.v_world_body =
        (At(t + kStep).translation() - At(t - kStep).translation()) / (2.0 * kStep);
    return state;
  }
  ImuSample ImuAt(double t, Time begin, double gravity) const {
    constexpr double kStep = 1e-3;
    const Pose3 before = At(t - kStep), now = At(t), after = At(t + kStep);
    const Eigen::Vector3d acceleration =
        (after.translation() - 2.0 * now.translation() + before.translation()) / (kStep * kStep);
    ImuSample sample;
    sample.stamp = begin + Duration::FromSeconds(t);
    sample.angular_velocity =
        LogSo3(before.rotation().conjugate() * after.rotation()) / (2.0 * kStep);
    sample.linear_acceleration =
        now.rotation().conjugate() * (acceleration + Eigen::Vector3d(0.0, 0.0, gravity));
    return sample;
  }
};

// Constant velocity (world) and constant turn (body) through the origin at time 0.
struct SteadyMotion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();      // rad/s

  Pose3 At(double t) const { return Pose3(ExpSo3(rate * t), velocity * t); }
  ImuSample ImuAt(double t, Time begin, double gravity) const {
    ImuSample sample;
    sample.stamp = begin + Duration::FromSeconds(t);
    sample.angular_velocity = rate;
    sample.linear_acceleration = At(t).rotation().conjugate() * Eigen::Vector3d(0.0, 0.0, gravity);
    return sample;
  }
};

inline Rig MakeTestRig() {
  Rig rig;
  rig.name = "test";
  rig.imu.rate_hz = 200.0;
  rig.imu.noise = {2e-3, 2e-4, 1e-4, 1e-5};
  rig.lidar.emplace();
  rig.lidar->T_body_lidar = Pose3(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), {-0.04, 0.02, -0.03});
  rig.lidar->rings = 32;
  rig.lidar->min_range = 0.3;
  rig.lidar->range_noise = 0.01;
  rig.lidar->beam_noise = 0.0;
  return rig;
}

// One turn of `rings` beams within +-35 degrees and `columns` firings from `t` on, over `span`
// seconds.
struct ScanPattern {
  int rings = 32;
  int columns = 600;
  double span = 0.1;
};

template <typename Motion>
LidarSweep Scan(const BoxWorld& world, const Motion& motion, const LidarSpec& lidar, double t,
                Time begin, RandomStream random, const ScanPattern& pattern = {}) {
  LidarSweep sweep;
  sweep.stamp = begin + Duration::FromSeconds(t);
  sweep.has_times = sweep.has_rings = true;
  for (int column = 0; column < pattern.columns; ++column) {
    const double offset = pattern.span * column / pattern.columns;
    const Pose3 T_world_lidar = motion.At(t + offset) * lidar.T_body_lidar;
    const double azimuth = 2.0 * std::numbers::pi * (column + 0.5) / pattern.columns;
    for (int ring = 0; ring < pattern.rings; ++ring) {
      const double elevation = 0.61 - 1.22 * (ring + 0.5) / pattern.rings;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const double range =
          world.Range(T_world_lidar.translation(), T_world_lidar.rotation() * direction) +
          lidar.range_noise * random.Normal();
      LidarPoint point;
      point.position = (range * direction).cast<float>();
      point.offset_ns = static_cast<std::int32_t>(std::llround(offset * 1e9));
      point.ring = static_cast<std::uint16_t>(ring);
      sweep.points.push_back(point);
    }
  }
  sweep.span = Duration::FromNanoseconds(sweep.points.back().offset_ns);
  return sweep;
}

// Samples at the rig's rate over [from, to], both included, with white noise if the rig's densities
// are wanted.
template <typename Motion>
std::vector<ImuSample> ImuRun(const Motion& motion, const Rig& rig, double from, double to,
                              Time begin, RandomStream random, bool noisy = true) {
  std::vector<ImuSample> samples;
  const double gyroscope =
      noisy ? rig.imu.noise.gyroscope_density * std::sqrt(rig.imu.rate_hz) : 0.0;
  const double accelerometer =
      noisy ? rig.imu.noise.accelerometer_density * std::sqrt(rig.imu.rate_hz) : 0.0;
  const int first = static_cast<int>(std::lround(from * rig.imu.rate_hz));
  const int last = static_cast<int>(std::lround(to * rig.imu.rate_hz));
  for (int k = first; k <= last; ++k) {
    ImuSample sample = motion.ImuAt(k / rig.imu.rate_hz, begin, rig.gravity);
    RandomStream own = random.Fork(static_cast<std::uint64_t>(k));
    for (int axis = 0; axis < 3; ++axis) {
      sample.angular_velocity[axis] += gyroscope * own.Normal();
      sample.linear_acceleration[axis] += accelerometer * own.Normal();
    }
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace mlvi::test
