// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/sim/camera_simulator.h"

namespace mlvi {

// The images of one camera of a recording, triggered at a steady rate. Cameras of equal rate take
// theirs at the same instants.
class CameraStream {
 public:
  // Images whose whole exposure lies in [begin, end]; `motion` must cover that. Meters the scene
  // for the exposures of all of them. `renderer` and `motion` must outlive the stream.
  CameraStream(const CameraSpec& spec, int camera, double rate_hz, const CameraPhysics& physics,
               const RandomStream& random, const SceneRenderer& renderer, const PoseSpline& motion,
               Time begin, Time end);

  int camera() const { return camera_; }
  std::size_t size() const { return exposures_.size(); }
  double rate_hz() const { return rate_hz_; }
  // True instant of the middle of an exposure.
  Time TimeOf(std::size_t index) const;
  const Exposure& ExposureOf(std::size_t index) const { return exposures_[index]; }
  // What exposure control has chosen within [from, to) is multiplied.
  void MultiplyGain(Time from, Time to, double factor);
  // Its stamp is the true instant. `times`: see CameraSimulator::Render.
  Image Take(std::size_t index, StageTimes* times = nullptr) const;

 private:
  CameraSimulator simulator_;
  int camera_;
  const SceneRenderer* renderer_;
  const PoseSpline* motion_;
  Time first_;
  double rate_hz_;
  std::vector<Exposure> exposures_;
};

// As a reader delivers it: one channel, by the weights of BT.601 as OpenCV does.
void MakeGrey(Image& image);

}  // namespace mlvi
