// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rig files (YAML). One schema, strict: unknown keys, missing fields and impossible values are
// errors that name file, line and field. Transforms T_a_b map b to a and are written as {t: [x, y,
// z], q_xyzw: [..]}, {t: [..], R: [9 numbers, row by row]} or 16 numbers row by row. All keys, with
// those that may be left out in brackets:
//
//   name: newer_college
//   [gravity: 9.81]                      m/s^2
//   imu: {topic, rate_hz, noise: {accelerometer_density, gyroscope_density, accelerometer_random_walk,
//         gyroscope_random_walk}, [initial_accelerometer_bias_sigma], [initial_gyroscope_bias_sigma],
//         [accelerometer_saturation], [gyroscope_saturation], [acceleration_unit: auto | m/s^2 | g], [time_offset_s]}
//   [lidar: {topic, T_body_lidar, rate_hz, [model], [rings], [min_range], [max_range], [range_noise], [beam_noise],
//            [point_timing: auto | instantaneous], [time_offset_s]}]
//   [cameras: list of {name, topic, model, intrinsics, distortion, size: [width, height], T_body_camera, [rate_hz],
//            [time_offset_s], [valid_radius_px], [mask_file]}]
//   [p_body_pano: [x, y, z]]
//   [T_body_groundtruth: transform]
#pragma once

#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// Reads and validates a rig, without its masks. `origin` names the document in messages. Errors are
// of kind kConfiguration.
Expected<Rig> ParseRig(const std::string& yaml, const std::string& origin);
// The rig of a file, or a built-in one by its name ("newer_college"). A path wins over a name.
// Masks are read, too (images, zero = do not use); relative mask files are relative to the rig
// file.
Expected<Rig> LoadRig(const std::string& name_or_path);
// Names of the rigs compiled in (config/rigs/*.yaml), sorted.
std::vector<std::string> BuiltinRigNames();

// The rig as a document that ParseRig reads back to the same values.
std::string RigToYaml(const Rig& rig);
// Writes that document. Masks that were read (LoadRig) are named relative to the new file.
Expected<void> SaveRig(const Rig& rig, const std::string& path);

}  // namespace mlvi
