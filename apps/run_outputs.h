// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/pipeline/slam.h"

// The folder that `mlvi run` writes.
class RunOutputs {
 public:
  explicit RunOutputs(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Makes the folder and writes config.yaml, so that an unwritable place is found before the work.
  mlvi::Expected<void> Prepare(const mlvi::SlamConfig& config) const;
  // trajectory.tum, odometry.tum, map.ply, map.png, summary.json.
  mlvi::Expected<void> Write(const mlvi::Slam& slam, const nlohmann::ordered_json& summary) const;

 private:
  mlvi::Expected<void> WriteText(const std::string& name, const std::string& text) const;
  mlvi::Expected<void> WriteMap(const mlvi::Slam& slam) const;

  std::filesystem::path folder_;
};
