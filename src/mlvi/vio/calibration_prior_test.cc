// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibration_prior.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mlvi {
namespace {

// Two cameras, of which the second is turned by `rotation` and then moved along its own axes.
VioWindow WindowWith(const Eigen::Vector3d& rotation, const Eigen::Vector3d& moved) {
  VioWindow window;
  window.nominal.T_pano_camera = {Pose3(ExpSo3({0.3, -1.2, 0.4}), {0.1, 0.0, 0.05}),
                                  Pose3(ExpSo3({-0.8, 0.2, 2.0}), {-0.1, 0.02, 0.0})};
  window.nominal.time_offsets = {0.0, 0.001};
  window.calibration = window.nominal;
  const Pose3& T = window.nominal.T_pano_camera[1];
  window.calibration.T_pano_camera[1] =
      Pose3(T.rotation() * ExpSo3(rotation), T.translation() + T.R() * moved);
  return window;
}

LinearizedWindow PriorOf(const VioWindow& window, const WindowConfig& config) {
  LinearizedWindow system;
  system.layout = window.Layout(config);
  system.H = Eigen::MatrixXd::Zero(system.layout.size(), system.layout.size());
  system.b = Eigen::VectorXd::Zero(system.layout.size());
  AddCalibrationPrior(window, config, system);
  return system;
}

// A small deviation is held by the full information of the sigmas, one of twenty sigmas by less
// than a hundredth of it: its pull falls with the distance.
TEST(CalibrationPriorTest, LetsGoWhatIsPlainlyWrong) {
  const WindowConfig config;
  const double sigma = config.extrinsics_rotation_sigma;
  const auto at = [&](double sigmas) {
    return PriorOf(WindowWith({0.0, sigmas * sigma, 0.0}, {0.0, 0.0, 0.0}), config);
  };
  const int coordinate = at(0.0).layout.calibration() + at(0.0).layout.camera(1) + 4;
  EXPECT_NEAR(at(0.01).H(coordinate, coordinate) * sigma * sigma, 1.0, 1e-3);
  EXPECT_LT(at(20.0).H(coordinate, coordinate) * sigma * sigma, 0.01);
  EXPECT_LT(at(20.0).b[coordinate], 0.0);  // back to the rig file
  EXPECT_GT(at(20.0).b[coordinate], at(1.0).b[coordinate]);
  // Of positions nothing is given up.
  const auto moved = PriorOf(
      WindowWith({0.0, 0.0, 0.0}, {20.0 * config.extrinsics_translation_sigma, 0.0, 0.0}), config);
  EXPECT_NEAR(
      moved.H(coordinate - 3, coordinate - 3) * std::pow(config.extrinsics_translation_sigma, 2),
      1.0, 1e-9);
  // The other camera and the position of this one are held as before.
  EXPECT_EQ(at(20.0).H(coordinate - 6, coordinate - 6), at(0.0).H(coordinate - 6, coordinate - 6));
  EXPECT_EQ(at(20.0).H(coordinate - 3, coordinate - 3), at(0.0).H(coordinate - 3, coordinate - 3));
}

// What the time offsets of four cameras cost, and how that is linearised.
LinearizedWindow TimesAt(const std::vector<double>& offsets, const WindowConfig& config) {
  VioWindow window;
  window.nominal.T_pano_camera.resize(offsets.size());
  window.nominal.time_offsets.assign(offsets.size(), 0.0);
  window.calibration = window.nominal;
  window.calibration.time_offsets = offsets;
  return PriorOf(window, config);
}

TEST(CalibrationPriorTest, GradientOfTimeOffsetsIsThatOfTheirCost) {
  const WindowConfig config;
  const std::vector<std::vector<double>> cases = {{0.0, 0.0, 0.0, 0.0},
                                                  {0.001, 0.0012, 0.0008, 0.0011},
                                                  {0.010, 0.0101, 0.0097, 0.0099},
                                                  {0.0001, 0.010, -0.0002, 0.0},
                                                  {-0.004, 0.003, 0.006, 0.0065},
                                                  {0.003}};
  for (const std::vector<double>& at : cases) {
    const LinearizedWindow system = TimesAt(at, config);
    for (std::size_t i = 0; i < at.size(); ++i) {
      constexpr double kStep = 1e-7;
      std::vector<double> more = at, less = at;
      more[i] += kStep;
      less[i] -= kStep;
      const double expected =
          (TimesAt(more, config).cost - TimesAt(less, config).cost) / (2.0 * kStep);
      const int coordinate = system.layout.calibration() + system.layout.time(static_cast<int>(i));
      EXPECT_NEAR(-system.b[coordinate] * config.time_offset_difference_sigma,
                  expected * config.time_offset_difference_sigma, 1e-6);
      EXPECT_GT(system.H(coordinate, coordinate), 0.0);
    }
  }
}

// Ten milliseconds of all cameras cost as little as ten of one; four that differ cost more.
TEST(CalibrationPriorTest, TimeOffsetsAreSharedOrRare) {
  const WindowConfig config;
  const double all = TimesAt({0.010, 0.010, 0.010, 0.010}, config).cost;
  const double one = TimesAt({0.0, 0.010, 0.0, 0.0}, config).cost;
  const double each = TimesAt({0.010, -0.010, 0.020, -0.020}, config).cost;
  // Where it can be cheaper to give up one camera than all, that is found.
  EXPECT_NEAR(all, 0.5 * std::log1p(25.0), 0.05);
  EXPECT_NEAR(one, 0.5 * std::log1p(400.0), 0.05);
  EXPECT_GT(each, 2.0 * (all + one));
}

TEST(CalibrationPriorTest, SaysNothingWhereNothingIsEstimated) {
  WindowConfig config;
  config.extrinsics = ExtrinsicsCalibration::kOff;
  config.time_offset = false;
  const VioWindow window = WindowWith({0.1, 0.0, 0.0}, {0.1, 0.0, 0.0});
  EXPECT_EQ(PriorOf(window, config).cost, 0.0);
  EXPECT_EQ(PriorOf(window, config).H.size(), 0);
}

}  // namespace
}  // namespace mlvi
