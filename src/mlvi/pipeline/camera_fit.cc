// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/camera_fit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

// A camera stands out when it is worse than the median of the others by this factor and bad by
// itself as well. Cameras that see different things (a near wall, the sky) differ by less than two.
constexpr double kFactor = 2.5;
constexpr double kBadRms = 1.5;         // px
constexpr double kBadRejection = 0.15;  // share
// Fewer observations say nothing.
constexpr std::int64_t kEnough = 200;

// A deviation from the rig file beyond these is worth the user's attention, provided that it is
// certain.
constexpr double kTurned = 0.5 * std::numbers::pi / 180.0;  // rad
constexpr double kMoved = 0.01;                             // m
constexpr double kLate = 0.005;                             // s
constexpr double kCertain = 5.0;                            // sigmas
// px, per axis: residuals of tracks that follow what they should. Sigmas of the window rest on it.
constexpr double kUsualRms = 0.3;
// After a failure an estimate is given up for a new one that is less certain by this factor at most.
constexpr double kForgetful = 1.5;

bool Stands(double deviation, double sigma, double limit) {
  return deviation > limit && deviation > kCertain * sigma;
}

double Degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double CameraFit::Figures::rms_px() const {
  return rated_sets > 0 ? std::sqrt(squares / static_cast<double>(rated_sets)) : 0.0;
}

double CameraFit::Figures::rejected_share() const {
  return followed > 0 ? static_cast<double>(rejected) / static_cast<double>(followed) : 0.0;
}

void CameraFit::Add(const VioResult& result) {
  ++sets_;
  if (result.status == VioResult::Status::kTracking) TakeDeviation(result.deviation);
  if (result.status == VioResult::Status::kFailed) restarted_ = true;
  for (std::size_t i = 0; i < figures_.size(); ++i) {
    Figures& figures = figures_[i];
    if (i < result.tracking.cameras.size()) {
      const CameraTracking& tracking = result.tracking.cameras[i];
      figures.followed += tracking.followed + tracking.outliers;
      figures.rejected += tracking.outliers;
      figures.alive += tracking.alive;
    }
    if (result.status != VioResult::Status::kTracking || i >= result.camera_rms_px.size()) continue;
    const double rms = result.camera_rms_px[i];
    if (!(rms > 0.0)) continue;
    figures.squares += rms * rms;
    ++figures.rated_sets;
  }
}

Health CameraFit::Judge(int camera) const {
  const auto index = static_cast<std::size_t>(camera);
  if (Health health = JudgeCalibration(index); health.level != HealthLevel::kHealthy) return health;
  return JudgeAmongOthers(index);
}

// The newest, but what was known better before a failure is kept: a window that begins anew knows
// little at first.
void CameraFit::TakeDeviation(const CalibrationDeviation& newest) {
  const auto better = [&](double sigma, double kept) {
    return sigma > 0.0 && (!restarted_ || kept == 0.0 || sigma < kForgetful * kept);
  };
  deviation_.together = newest.together;
  deviation_.cameras.resize(std::max(deviation_.cameras.size(), newest.cameras.size()));
  for (std::size_t i = 0; i < newest.cameras.size(); ++i) {
    CalibrationDeviation::Camera& kept = deviation_.cameras[i];
    if (better(newest.cameras[i].rotation_sigma, kept.rotation_sigma)) kept = newest.cameras[i];
  }
  deviation_.time_offsets.resize(
      std::max(deviation_.time_offsets.size(), newest.time_offsets.size()));
  for (std::size_t i = 0; i < newest.time_offsets.size(); ++i) {
    CalibrationDeviation::TimeOffset& kept = deviation_.time_offsets[i];
    if (better(newest.time_offsets[i].sigma, kept.sigma)) kept = newest.time_offsets[i];
  }
}

Health CameraFit::JudgeCalibration(std::size_t camera) const {
  // Where residuals are larger than tracks should have, sigmas are too small by as much.
  const double scale = std::max(1.0, figures_[camera].rms_px() / kUsualRms);
  std::vector<std::string> reasons = {PlaceObjection(camera, scale), TimeObjection(camera, scale)};
  std::erase(reasons, "");
  if (reasons.empty()) return {};
  return {HealthLevel::kDegraded,
          fmt::format("does not fit the rig file: {}. The estimate uses what it found.",
                      fmt::join(reasons, "; "))};
}

std::string CameraFit::PlaceObjection(std::size_t camera, double scale) const {
  if (camera >= deviation_.cameras.size()) return {};
  const CalibrationDeviation::Camera& d = deviation_.cameras[camera];
  if (!Stands(d.rotation, scale * d.rotation_sigma, kTurned) &&
      !Stands(d.translation, scale * d.translation_sigma, kMoved)) {
    return {};
  }
  return fmt::format(
      "{}turned by {:.2f} deg (sigma {:.2f}) and moved by {:.0f} mm (sigma {:.0f}) against it; "
      "likely wrong extrinsics or intrinsics{}",
      deviation_.together ? "with all others " : "", Degrees(d.rotation), Degrees(d.rotation_sigma),
      1e3 * d.translation, 1e3 * d.translation_sigma, deviation_.together ? "" : " of this camera");
}

// A clock of its own, or one that most cameras share and that differs from the IMU's.
std::string CameraFit::TimeObjection(std::size_t camera, double scale) const {
  if (camera >= deviation_.time_offsets.size()) return {};
  const CalibrationDeviation::TimeOffset& d = deviation_.time_offsets[camera];
  if (!Stands(std::abs(d.seconds), scale * d.sigma, kLate)) return {};
  std::vector<double> others;
  for (std::size_t i = 0; i < deviation_.time_offsets.size(); ++i) {
    if (i != camera) others.push_back(deviation_.time_offsets[i].seconds);
  }
  const bool alone = !others.empty() && std::abs(d.seconds - Median(others)) > kLate;
  return fmt::format(
      "its images{} are taken {:.1f} ms (sigma {:.1f}) {} than it says; likely a "
      "wrong time offset of {}",
      alone || others.empty() ? "" : ", as those of other cameras,", 1e3 * std::abs(d.seconds),
      1e3 * d.sigma, d.seconds > 0.0 ? "later" : "earlier",
      alone ? "this camera" : "cameras or IMU");
}

Health CameraFit::JudgeAmongOthers(std::size_t camera) const {
  const Figures& own = figures_[camera];
  std::vector<double> rms, rejected;
  for (std::size_t i = 0; i < figures_.size(); ++i) {
    if (i == camera || figures_[i].followed < kEnough) continue;
    rms.push_back(figures_[i].rms_px());
    rejected.push_back(figures_[i].rejected_share());
  }
  if (own.followed < kEnough || rms.empty()) return {};
  const double others_rms = Median(rms), others_rejected = Median(rejected);
  const bool residuals = own.rms_px() > std::max(kBadRms, kFactor * others_rms);
  const bool rejections = own.rejected_share() > std::max(kBadRejection, kFactor * others_rejected);
  if (!residuals && !rejections) return {};
  return {
      HealthLevel::kDegraded,
      fmt::format("does not fit the other cameras: residuals {:.2f} px rms (others {:.2f}), {:.0f} "
                  "% of its tracks "
                  "rejected (others {:.0f} %). Likely wrong extrinsics, intrinsics or time offset "
                  "of this camera.",
                  own.rms_px(), others_rms, 100.0 * own.rejected_share(), 100.0 * others_rejected)};
}

}  // namespace mlvi
