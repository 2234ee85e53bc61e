// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The camera entries of a rig file, and values as YAML text.
#pragma once

#include <Eigen/Core>
#include <string>

#include "mlvi/io/yaml_section.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// Reads one entry of `cameras`; errors go to the section.
CameraSpec ReadCamera(YamlSection& section);
// The parameters of a model in the two lists that MakeCameraModel takes.
struct CameraParameterLists {
  std::vector<double> intrinsics;
  std::vector<double> distortion;
};
CameraParameterLists SplitCameraParameters(const CameraModel& model);
// The entry as text, indented as an item of the list.
std::string CameraYaml(const CameraSpec& camera);

// Numbers are written so that they read back to the same bits.
std::string QuoteYaml(const std::string& text);
std::string VectorYaml(const Eigen::Vector3d& v);
std::string PoseYaml(const Pose3& pose);
// Exact to the nanosecond.
std::string SecondsText(Duration duration);

}  // namespace mlvi
