// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/base/stage_times.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/camera_rays.h"
#include "mlvi/sim/camera_sensor.h"
#include "mlvi/sim/scene_renderer.h"

namespace mlvi {

// Images of a camera on a moving body, ray-traced through its exact lens model. Every pixel gets
// one ray at the middle of the exposure; textures are filtered to the pixel, and along the way that
// they move during the exposure. Pixels that an edge lies in or sweeps over get 4, 8 or 16 rays,
// spread over the pixel and the exposure; those that meet the same surface share one computation of
// its light.
class CameraSimulator {
 public:
  CameraSimulator(const CameraSpec& spec, const CameraPhysics& physics, RandomStream random);

  const CameraSensor& sensor() const { return sensor_; }

  // What a coarse grid over the image sees, for exposure control: luminances after vignetting,
  // cd/m^2.
  using Metering = std::vector<float>;
  Metering Meter(const SceneRenderer& renderer, const PoseSpline& motion, Time time) const;

  // Exposures of images metered `interval` s apart: towards the target grey value with a lag and
  // one image of delay, settled at the first one.
  std::vector<Exposure> ControlExposure(const std::vector<Metering>& meterings,
                                        double interval) const;

  // The image whose exposure has its middle at `time` (of the first row, if rolling). `motion` must
  // cover the exposure. The noise depends on `index` alone, not on earlier calls or threads. Stamp
  // and camera number are left to the caller. `times`, if any, gets the stages look, edges, shade.
  Image Render(const SceneRenderer& renderer, const PoseSpline& motion, Time time,
               std::uint64_t index, const Exposure& exposure, StageTimes* times = nullptr) const;

 private:
  using Sights = std::vector<Sight>;        // by pixel, in rows
  using Marks = std::vector<std::uint8_t>;  // by pixel, bits: where edges are, how they move
  struct Shot;                              // everything that the rows of one image share
  struct Instants;                          // poses of the camera during the exposure of a row
  class Band;                               // rows that are drawn together
  Shot MakeShot(const SceneRenderer& renderer, const PoseSpline& motion, Time time,
                const Exposure& exposure) const;
  Instants InstantsOf(const Shot& shot, int row) const;
  void FindInstants(Shot& shot) const;
  void FindBorders(int row, const Sights& sights, Marks& borders) const;
  bool IsEdge(const Marks& borders, int column, int row) const;
  void MarkEdges(const Shot& shot, int row, const Sights& sights, const Marks& borders,
                 Marks& marks) const;
  void ExposeRow(std::span<const Eigen::Vector3f> line, const Exposure& exposure,
                 RandomStream random, std::uint8_t* out) const;
  std::size_t IndexOf(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(rays_.width()) +
           static_cast<std::size_t>(column);
  }

  CameraSpec spec_;
  CameraRays rays_;
  CameraSensor sensor_;
  RandomStream random_;
  std::vector<float> vignette_;  // by pixel
};

}  // namespace mlvi
