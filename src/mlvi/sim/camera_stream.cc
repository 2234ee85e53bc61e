// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_stream.h"

#include <cmath>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

// From the beginning of the recording to the first image, and from the last one to the end: room
// for any exposure.
constexpr Duration kMargin = Duration::FromMilliseconds(15);

}  // namespace

CameraStream::CameraStream(const CameraSpec& spec, int camera, double rate_hz,
                           const CameraPhysics& physics, const RandomStream& random,
                           const SceneRenderer& renderer, const PoseSpline& motion, Time begin,
                           Time end)
    : simulator_(spec, physics, random),
      camera_(camera),
      renderer_(&renderer),
      motion_(&motion),
      first_(begin + kMargin),
      rate_hz_(rate_hz) {
  const Duration readout = physics.row_time * spec.model->height();
  MLVI_CHECK(rate_hz > 0.0, "camera {}: a rate of {} Hz", camera, rate_hz);
  MLVI_CHECK(physics.max_exposure < 2.0 * kMargin.seconds(), "exposures of up to {} s",
             physics.max_exposure);
  std::size_t count = 0;
  while (TimeOf(count) + readout + kMargin <= end) ++count;
  std::vector<CameraSimulator::Metering> meterings(count);
  ParallelFor(count, 4, [&](std::size_t i) {
    meterings[i] = simulator_.Meter(*renderer_, *motion_, TimeOf(i));
  });
  exposures_ = simulator_.ControlExposure(meterings, 1.0 / rate_hz);
}

Time CameraStream::TimeOf(std::size_t index) const {
  return first_ + Duration::FromSeconds(static_cast<double>(index) / rate_hz_);
}

void CameraStream::MultiplyGain(Time from, Time to, double factor) {
  for (std::size_t i = 0; i < exposures_.size(); ++i) {
    if (TimeOf(i) >= from && TimeOf(i) < to) exposures_[i].gain *= factor;
  }
}

Image CameraStream::Take(std::size_t index, StageTimes* times) const {
  Image image =
      simulator_.Render(*renderer_, *motion_, TimeOf(index), index, exposures_[index], times);
  image.stamp = TimeOf(index);
  image.camera = camera_;
  return image;
}

void MakeGrey(Image& image) {
  if (image.channels == 1) return;
  for (std::size_t i = 0; i < image.pixels.size() / 3; ++i) {
    const auto channel = [&](std::size_t k) -> unsigned { return image.pixels[3 * i + k]; };
    // Weights of blue, green and red in units of 2^-14.
    const unsigned sum = 1868 * channel(0) + 9617 * channel(1) + 4899 * channel(2);
    image.pixels[i] = static_cast<std::uint8_t>((sum + 8192) >> 14);
  }
  image.pixels.resize(image.pixels.size() / 3);
  image.channels = 1;
}

}  // namespace mlvi
