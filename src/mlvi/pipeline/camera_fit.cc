// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/camera_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

// A camera stands out when it is worse than the median of the others by this factor and bad by
// itself as well. Cameras that see different things (a near wall, the sky) differ by less than two.
constexpr double kFactor = 2.5;
constexpr double kBadRms = 1.5;         // px
constexpr double kBadRejection = 0.15;  // share
// Fewer observations say nothing.
constexpr std::int64_t kEnough = 200;

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
  const Figures& own = figures_[static_cast<std::size_t>(camera)];
  std::vector<double> rms, rejected;
  for (std::size_t i = 0; i < figures_.size(); ++i) {
    if (i == static_cast<std::size_t>(camera) || figures_[i].followed < kEnough) continue;
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
