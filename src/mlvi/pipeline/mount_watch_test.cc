// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/mount_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mlvi/geometry/so3.h"

namespace mlvi {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kStep = 0.1;  // s between sweeps

// Ten seconds of a body that turns at rates(t); a LiDAR whose odometry is turned by `mount` against
// the gyroscopes, i.e. wrongly placed in the rig.
template <typename Rates>
std::vector<std::string> Findings(const Eigen::Quaterniond& mount, const Rates& rates,
                                  const ImuBias& bias = {}, double new_share = 0.03,
                                  double residual = 0.01) {
  Rig rig;
  rig.imu.rate_hz = 100.0;
  rig.imu.noise = {.accelerometer_density = 0.01, .gyroscope_density = 0.001};
  rig.lidar.emplace();
  MountWatch watch(rig, MountLimits{});
  Eigen::Quaterniond R_world_body = Eigen::Quaterniond::Identity();
  for (int k = 0; k < 100; ++k) {
    std::vector<ImuSample> imu;
    for (int i = 0; i <= 10; ++i) {
      const double t = kStep * k + 0.01 * i;
      imu.push_back({.stamp = Time::FromSeconds(100.0 + t),
                     .angular_velocity = rates(t) + bias.gyroscope,
                     .linear_acceleration = {0.0, 0.0, 9.81}});
      if (i < 10) R_world_body = R_world_body * ExpSo3(0.01 * rates(t + 0.005));
    }
    LioResult result;
    result.status = LioResult::Status::kTracking;
    result.new_share = new_share;
    result.rms_residual = residual;
    result.estimates.resize(1);
    NavState& state = result.estimates.back().state;
    state.stamp = imu.back().stamp;
    state.T_world_body = Pose3(mount * R_world_body * mount.conjugate(), Eigen::Vector3d::Zero());
    state.bias = bias;
    watch.Observe(result, imu);
  }
  return watch.Findings();
}

Eigen::Vector3d Swing(double t) { return {0.4 * std::sin(2.0 * t), 0.3 * std::cos(1.3 * t), 0.5}; }
Eigen::Vector3d Level(double t) { return {0.0, 0.0, 0.5 * std::sin(t)}; }
Eigen::Quaterniond About(const Eigen::Vector3d& axis, double degrees) {
  return ExpSo3(axis * degrees * M_PI / 180.0);
}

TEST(MountWatch, ARightMountGivesNoFindings) {
  EXPECT_THAT(Findings(Eigen::Quaterniond::Identity(), Swing), IsEmpty());
}

TEST(MountWatch, AWrongRotationIsMeasured) {
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    EXPECT_THAT(Findings(About(axis, 5.0), Swing), ElementsAre(HasSubstr("turned by 5.0 deg")));
  }
}

TEST(MountWatch, HalfADegreeIsTolerated) {
  EXPECT_THAT(Findings(About({0, 1, 0}, 0.5), Swing), IsEmpty());
}

// Turns about the vertical alone tell nothing of a mount that is turned about it, but of a tilt.
TEST(MountWatch, OnlyWhatTheMotionShowsIsJudged) {
  EXPECT_THAT(Findings(About({0, 0, 1}, 20.0), Level), IsEmpty());
}

TEST(MountWatch, BiasesThatTheImuCannotHave) {
  ImuBias bias;
  EXPECT_THAT(Findings(Eigen::Quaterniond::Identity(), Swing, bias), IsEmpty());
  bias.accelerometer = {0.1, -0.55, 0.0};
  EXPECT_THAT(Findings(Eigen::Quaterniond::Identity(), Swing, bias),
              ElementsAre(HasSubstr("(0.10, -0.55, 0.00) m/s^2")));
  bias.accelerometer.setZero();
  bias.gyroscope = {0.0, 0.0, 0.06};
  EXPECT_THAT(Findings(Eigen::Quaterniond::Identity(), Swing, bias),
              ElementsAre(HasSubstr("0.0600) rad/s")));
}

// Vegetation has large residuals, new land new points: only both together tell of a wrong mount.
TEST(MountWatch, SweepsThatDoNotFitTheMap) {
  const Eigen::Quaterniond right = Eigen::Quaterniond::Identity();
  EXPECT_THAT(Findings(right, Swing, {}, 0.3, 0.01), IsEmpty());
  EXPECT_THAT(Findings(right, Swing, {}, 0.03, 0.08), IsEmpty());
  EXPECT_THAT(Findings(right, Swing, {}, 0.3, 0.08), ElementsAre(HasSubstr("T_body_lidar")));
}

}  // namespace
}  // namespace mlvi
