// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/camera_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace mlvi {
namespace {

using ::testing::HasSubstr;

// One set of three cameras with these residuals and outliers.
VioResult Result(std::vector<double> rms, std::vector<int> outliers) {
  VioResult result;
  result.status = VioResult::Status::kTracking;
  result.camera_rms_px = std::move(rms);
  for (const int count : outliers) {
    result.tracking.cameras.push_back(
        {.followed = 50 - count, .lost = 0, .outliers = count, .alive = 50});
  }
  return result;
}

CameraFit After(int sets, const VioResult& result) {
  CameraFit fit({"left", "right", "back"});
  for (int i = 0; i < sets; ++i) fit.Add(result);
  return fit;
}

TEST(CameraFit, CamerasThatAgreeAreHealthy) {
  const CameraFit fit = After(20, Result({0.5, 0.7, 0.9}, {1, 2, 3}));
  for (int camera = 0; camera < 3; ++camera)
    EXPECT_EQ(fit.Judge(camera).level, HealthLevel::kHealthy);
  EXPECT_NEAR(fit.figures()[1].rms_px(), 0.7, 1e-12);
  EXPECT_NEAR(fit.figures()[2].rejected_share(), 0.06, 1e-12);
}

TEST(CameraFit, TheOneWithLargeResidualsIsNamedWithFigures) {
  const CameraFit fit = After(20, Result({0.5, 2.4, 0.6}, {1, 4, 1}));
  EXPECT_EQ(fit.Judge(1).level, HealthLevel::kDegraded);
  EXPECT_THAT(fit.Judge(1).reason,
              HasSubstr("residuals 2.40 px rms (others 0.60), 8 % of its tracks rejected"));
  EXPECT_EQ(fit.Judge(0).level, HealthLevel::kHealthy);
  EXPECT_EQ(fit.Judge(2).level, HealthLevel::kHealthy);
}

TEST(CameraFit, TheOneWhoseTracksAreRejectedIsNamed) {
  const CameraFit fit = After(20, Result({0.5, 0.6, 0.6}, {1, 1, 20}));
  EXPECT_THAT(fit.Judge(2).reason, HasSubstr("40 % of its tracks rejected (others 2 %)"));
}

// What the window estimates of three cameras: the second turned and moved against the rig file.
VioResult Deviating(double rotation_deg, double rotation_sigma_deg, double moved) {
  VioResult result = Result({0.3, 0.3, 0.3}, {1, 1, 1});
  result.deviation.cameras.resize(3);
  constexpr double kRadians = std::numbers::pi / 180.0;
  result.deviation.cameras[1] = {kRadians * rotation_deg, kRadians * rotation_sigma_deg, moved,
                                 0.001};
  return result;
}

TEST(CameraFit, TheOneThatIsNotWhereTheRigFileHasItIsNamed) {
  const CameraFit fit = After(20, Deviating(1.02, 0.03, 0.004));
  EXPECT_THAT(fit.Judge(1).reason,
              HasSubstr("turned by 1.02 deg (sigma 0.03) and moved by 4 mm (sigma 1)"));
  EXPECT_EQ(fit.Judge(1).level, HealthLevel::kDegraded);
  EXPECT_EQ(fit.Judge(0).level, HealthLevel::kHealthy);
  EXPECT_EQ(After(20, Deviating(0.0, 0.1, 0.04)).Judge(1).level, HealthLevel::kDegraded);
}

TEST(CameraFit, WhatIsSmallOrUncertainIsNoDeviation) {
  EXPECT_EQ(After(20, Deviating(0.4, 0.01, 0.008)).Judge(1).level, HealthLevel::kHealthy);
  EXPECT_EQ(After(20, Deviating(1.0, 0.3, 0.0)).Judge(1).level, HealthLevel::kHealthy);
}

TEST(CameraFit, ANewStartThatKnowsLittleTakesNothingBack) {
  CameraFit fit = After(20, Deviating(1.02, 0.03, 0.004));
  VioResult failed;
  failed.status = VioResult::Status::kFailed;
  fit.Add(failed);
  fit.Add(Deviating(0.9, 0.4, 0.0));
  EXPECT_EQ(fit.Judge(1).level, HealthLevel::kDegraded);
  // A better one counts.
  fit.Add(Deviating(0.1, 0.02, 0.0));
  EXPECT_EQ(fit.Judge(1).level, HealthLevel::kHealthy);
}

// Within one window the newest counts: leaving the rig file behind makes an estimate less certain.
TEST(CameraFit, TheNewestCountsAsLongAsNothingFails) {
  CameraFit fit = After(20, Deviating(0.0, 0.05, 0.0));
  fit.Add(Deviating(2.6, 0.2, 0.0));
  EXPECT_EQ(fit.Judge(1).level, HealthLevel::kDegraded);
}

// Sigmas rest on tracks of 0.3 px; where residuals are larger they claim too much.
TEST(CameraFit, LargeResidualsMakeDeviationsLessCertain) {
  VioResult result = Deviating(0.0, 0.01, 0.012);
  result.deviation.cameras[1].translation_sigma = 0.0018;
  EXPECT_EQ(After(20, result).Judge(1).level, HealthLevel::kDegraded);
  result.camera_rms_px = {0.9, 0.9, 0.9};
  EXPECT_EQ(After(20, result).Judge(1).level, HealthLevel::kHealthy);
}

TEST(CameraFit, AWrongTimeOffsetOfAllIsToldOfAllCameras) {
  VioResult result = Deviating(0.0, 0.1, 0.0);
  result.deviation.time_offsets.assign(3, {.seconds = 0.010, .sigma = 0.0002});
  for (int camera = 0; camera < 3; ++camera) {
    EXPECT_THAT(After(20, result).Judge(camera).reason,
                HasSubstr("as those of other cameras, are taken 10.0 ms (sigma 0.2) later"));
  }
  result.deviation.time_offsets.assign(3, {.seconds = -0.010, .sigma = 0.0002});
  EXPECT_THAT(After(20, result).Judge(2).reason, HasSubstr("taken 10.0 ms (sigma 0.2) earlier"));
  // A set without estimate takes nothing back.
  CameraFit fit = After(20, result);
  fit.Add({});
  EXPECT_EQ(fit.Judge(2).level, HealthLevel::kDegraded);
  // It may be all that is estimated.
  result.deviation.cameras.clear();
  EXPECT_EQ(After(20, result).Judge(0).level, HealthLevel::kDegraded);
}

TEST(CameraFit, AClockOfItsOwnIsToldOfThatCameraOnly) {
  VioResult result = Deviating(0.0, 0.1, 0.0);
  result.deviation.time_offsets.assign(3, {.seconds = 0.0003, .sigma = 0.0002});
  result.deviation.time_offsets[1].seconds = -0.010;
  const CameraFit fit = After(20, result);
  EXPECT_THAT(fit.Judge(1).reason,
              HasSubstr("its images are taken 10.0 ms (sigma 0.2) earlier than it says; likely a "
                        "wrong time offset of this camera"));
  EXPECT_EQ(fit.Judge(0).level, HealthLevel::kHealthy);
  EXPECT_EQ(fit.Judge(2).level, HealthLevel::kHealthy);
  // What is uncertain says nothing.
  result.deviation.time_offsets[1].sigma = 0.004;
  EXPECT_EQ(After(20, result).Judge(1).level, HealthLevel::kHealthy);
}

TEST(CameraFit, OneCameraAloneOrTooFewObservationsSayNothing) {
  CameraFit alone({"only"});
  for (int i = 0; i < 20; ++i) alone.Add(Result({5.0}, {30}));
  EXPECT_EQ(alone.Judge(0).level, HealthLevel::kHealthy);
  EXPECT_EQ(After(2, Result({0.5, 9.0, 0.6}, {0, 20, 0})).Judge(1).level, HealthLevel::kHealthy);
}

}  // namespace
}  // namespace mlvi
