// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mlvi/state/health.h"
#include "mlvi/vio/vio.h"

namespace mlvi {

// How well each camera agrees with the rig file and with the common motion: how far its estimated
// place is from the file's, the residuals of its features in the window, and the share of its
// tracks that the RANSAC turns down. One camera that stands out has a wrong calibration, most
// likely.
class CameraFit {
 public:
  struct Figures {
    std::int64_t followed = 0;    // observations of tracks, rejected ones included
    std::int64_t rejected = 0;    // of these, against the common motion
    std::int64_t alive = 0;       // sum over the sets
    double squares = 0.0;         // px^2, sum over sets of the mean squared residual per axis
    std::int64_t rated_sets = 0;  // with residuals
    double rms_px() const;
    double rejected_share() const;
  };

  explicit CameraFit(std::vector<std::string> names)
      : names_(std::move(names)), figures_(names_.size()) {}

  void Add(const VioResult& result);
  // Healthy, or degraded with the figures: of its deviation from the rig file, or else of this
  // camera and of the others.
  Health Judge(int camera) const;

  const std::vector<Figures>& figures() const { return figures_; }
  const std::vector<std::string>& names() const { return names_; }
  std::int64_t sets() const { return sets_; }
  // As estimated in the end, or before the failure after which it was not known as well any more.
  const CalibrationDeviation& deviation() const { return deviation_; }

 private:
  void TakeDeviation(const CalibrationDeviation& newest);
  Health JudgeCalibration(std::size_t camera) const;
  std::string PlaceObjection(std::size_t camera, double scale) const;
  std::string TimeObjection(std::size_t camera, double scale) const;
  Health JudgeAmongOthers(std::size_t camera) const;

  std::vector<std::string> names_;
  std::vector<Figures> figures_;
  CalibrationDeviation deviation_;
  bool restarted_ = false;
  std::int64_t sets_ = 0;
};

}  // namespace mlvi
