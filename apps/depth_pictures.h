// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/panorama/panorama_model.h"
#include "mlvi/pipeline/slam.h"

// What `mlvi run --depth-pictures` writes: every so often a picture per camera with the depth that
// LiDAR odometry has seen drawn in, by the calibration as estimated then. Where mount, lens and time
// offset are right, colours end at the edges of things.
class DepthPictures {
 public:
  // Of the LiDAR's keyframes those of the last `span` s count, and the newest one always. `rig` must
  // have cameras and be fit for `config` (CheckRig).
  DepthPictures(std::filesystem::path folder, double interval, const mlvi::SlamConfig& config,
                const mlvi::Rig& rig);

  // Takes an image when its camera's turn has come; other images are passed over.
  void Take(const mlvi::Image& image);
  // Writes what is waiting for the pose of its instant. To be called after Slam::Process.
  void Write(const mlvi::Slam& slam);

  int written() const { return written_; }
  // The first file that could not be written.
  const std::optional<mlvi::Error>& error() const { return error_; }

 private:
  mlvi::Image Draw(const mlvi::Image& image, const mlvi::Pose3& T_world_body,
                   const mlvi::Slam& slam) const;

  std::filesystem::path folder_;
  mlvi::Duration interval_;
  double span_;
  std::vector<std::string> names_;
  mlvi::PanoramaModel model_;
  std::vector<mlvi::Time> last_taken_;               // per camera
  std::vector<std::optional<mlvi::Image>> waiting_;  // per camera
  int written_ = 0;
  std::optional<mlvi::Error> error_;
};
