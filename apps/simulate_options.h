// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fault_options.h"
#include "mlvi/io/bag_writer.h"
#include "mlvi/sim/scene_import.h"

namespace mlvi {

// `mlvi simulate` as typed; numbers and names still to be given a meaning.
struct SimulateOptions {
  std::string sequence;
  std::string output;
  std::string rig;  // empty: the sequence's own
  std::string trajectory, imu, scene;
  std::vector<double> start;  // x, y, z, heading in deg
  std::vector<std::string> waypoints;
  SceneImportOptions scene_import;
  std::string cameras = "all";
  double image_rate = 0.0;
  double rolling_shutter = 0.0;  // s, from the first row to the last; 0: global
  bool contact_sheet = false;
  int jpeg_quality = 80;
  double seconds = 0.0;
  double rest = 2.0;
  std::uint64_t seed = 1;
  bool list = false;
  bool wrong_extrinsics = false, exact_extrinsics = false, ideal_lidar = false, ideal_imu = false;
  bool plane_surfaces = false, no_operator = false, exact_clocks = false;
  FaultArguments faults;
  BagCompression compression = BagCompression::kNone;
  VelodyneStamp velodyne_stamp = VelodyneStamp::kFirstPacket;
  int threads = 0;
};

}  // namespace mlvi
