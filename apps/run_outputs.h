// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/pipeline/slam.h"
#include "mlvi/sensors/rig.h"

// The folder that `mlvi run` writes.
class RunOutputs {
 public:
  explicit RunOutputs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Makes the folder, that of depth pictures too if wanted, and writes config.yaml, so that an
  // unwritable place is found before the work.
  mlvi::Expected<void> Prepare(const mlvi::SlamConfig& config, bool depth_pictures) const;
  std::filesystem::path depth_pictures() const { return folder_ / "depth_pictures"; }
  // summary.json, trajectory.tum, odometry.tum, calibrated_rig.yaml (`rig`), map.ply, map.png. What
  // cannot be written does not keep the rest from being written; it is named in `not_written` of
  // the summary and in the error.
  mlvi::Expected<void> Write(const mlvi::Slam& slam, const mlvi::Rig& rig,
                             nlohmann::ordered_json summary) const;

 private:
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  mlvi::Expected<void> WriteMap(const mlvi::Slam& slam) const;
  mlvi::Expected<void> WritePicture(const mlvi::Slam& slam) const;

  std::filesystem::path folder_;
};
