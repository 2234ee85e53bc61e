// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/camera_rays.h"
#include "mlvi/sim/camera_sensor.h"
#include "mlvi/sim/scene_renderer.h"

namespace mlvi {

// Images of a camera on a moving body, ray-traced through its exact lens model. Edges and moving
// objects are sampled several times within the pixel and the exposure, all pixels so when the image
// moves by more than about a pixel during it.
class CameraSimulator {
 public:
  CameraSimulator(const CameraSpec& spec, const CameraPhysics& physics, RandomStream random);

  const CameraSensor& sensor() const { return sensor_; }

  // What a coarse grid over the image sees, for exposure control: luminances after vignetting, and
  // the distance of near surfaces.
  struct Metering {
    std::vector<float> luminances;  // cd/m^2
    float near = 0.0F;              // m, 10th percentile; 0: nothing but sky
  };
  Metering Meter(const SceneRenderer& renderer, const PoseSpline& motion, Time time) const;

  // Exposures of images metered `interval` s apart: towards the target grey value with a lag and
  // one image of delay, settled at the first one.
  std::vector<Exposure> ControlExposure(const std::vector<Metering>& meterings,
                                        double interval) const;

  // The image whose exposure has its middle at `time` (of the first row, if rolling). `motion` must
  // cover the exposure. The noise depends on `index` alone, not on earlier calls or threads. Stamp
  // and camera number are left to the caller.
  Image Render(const SceneRenderer& renderer, const PoseSpline& motion, Time time,
               std::uint64_t index, const Exposure& exposure, float near) const;

 private:
  // One of the samples that make a pixel.
  struct Sample {
    double time = 0.0;           // share of the exposure, in (-0.5, 0.5)
    float dx = 0.0F, dy = 0.0F;  // px
  };
  struct Shot;  // everything that the rows of one image share
  static std::vector<Sample> Spread(int count);
  int SamplesFor(const PoseSpline& motion, Time time, const Exposure& exposure, float near) const;
  RayLight Look(const Shot& shot, const Sample& sample, std::size_t instant, int column,
                int row) const;
  void Trace(const Shot& shot, std::vector<RayLight>& lights) const;
  void Refine(const Shot& shot, const std::vector<RayLight>& lights, int row,
              std::vector<Eigen::Vector3f>& line) const;
  bool IsEdge(const std::vector<RayLight>& lights, int column, int row) const;
  float Vignette(int column, int row) const;

  CameraSpec spec_;
  CameraRays rays_;
  CameraSensor sensor_;
  RandomStream random_;
  double corner_ = 1.0;  // px, from the principal point to the farthest corner
};

}  // namespace mlvi
