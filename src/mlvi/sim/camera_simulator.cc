// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_simulator.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

constexpr int kMeterColumns = 12, kMeterRows = 9;
constexpr int kMaxSamples = 10;  // per pixel, for motion blur
constexpr int kEdgeSamples = 8;  // per pixel, at edges

const Eigen::Vector3f kLuminanceWeights(0.3F, 0.5F, 0.2F);  // of red, green, blue in a grey sensor

// Base b digits of i mirrored at the point: evenly spread in [0, 1) (van der Corput).
double RadicalInverse(int i, int base) {
  double result = 0.0, digit = 1.0;
  for (; i > 0; i /= base) {
    digit /= base;
    result += digit * (i % base);
  }
  return result;
}

// Whether two neighbouring rays met the same smooth surface under the same sun.
bool SameSurface(const RayLight& a, const RayLight& b) {
  if (a.surface != b.surface) return false;
  if (a.range == 0.0F) return true;
  if (a.normal.dot(b.normal) < 0.97F) return false;
  // The same on a plane, at any grazing angle.
  return std::abs(a.plane - b.plane) < 0.01F + 0.01F * std::min(a.range, b.range);
}

}  // namespace

struct CameraSimulator::Shot {
  const SceneRenderer* renderer;
  const PoseSpline* motion;
  Time time;
  double exposure = 0.0;  // s
  std::vector<Sample> samples, edge_samples;
  // At the samples' times, then at the edge samples'; of the first row if rolling.
  std::vector<SceneRenderer::Moment> moments;
  std::vector<Pose3> T_world_camera;
  std::vector<Eigen::Matrix3f> R_world_camera;
};

CameraSimulator::CameraSimulator(const CameraSpec& spec, const CameraPhysics& physics,
                                 RandomStream random)
    : spec_(spec), rays_(*spec.model), sensor_(physics), random_(random) {
  const Eigen::Vector2d c = spec.model->principal_point();
  const double x = std::max(c.x(), spec.model->width() - c.x());
  const double y = std::max(c.y(), spec.model->height() - c.y());
  corner_ = std::hypot(x, y);
}

// cos^4-like in the middle, steeper towards the corners where the lens cuts the beam.
float CameraSimulator::Vignette(int column, int row) const {
  const Eigen::Vector2d c = spec_.model->principal_point();
  const double r2 = (Eigen::Vector2d(column, row) - c).squaredNorm() / (corner_ * corner_);
  const double loss = 1.0 - sensor_.physics().corner_brightness;
  return static_cast<float>(1.0 - loss * (0.45 * r2 + 0.55 * r2 * r2 * r2));
}

CameraSimulator::Metering CameraSimulator::Meter(const SceneRenderer& renderer,
                                                 const PoseSpline& motion, Time time) const {
  const Pose3 T_world_body = motion.PoseAt(time);
  const Pose3 T_world_camera = T_world_body * spec_.T_body_camera;
  const auto moment = renderer.At(time, T_world_body.translation());
  Metering metering;
  std::vector<float> ranges;
  for (int i = 0; i < kMeterRows; ++i) {
    for (int j = 0; j < kMeterColumns; ++j) {
      const int column = (2 * j + 1) * rays_.width() / (2 * kMeterColumns);
      const int row = (2 * i + 1) * rays_.height() / (2 * kMeterRows);
      const Eigen::Vector3f bearing = rays_.Bearing(column, row);
      if (bearing.isZero()) continue;
      // Each ray stands for its whole cell of the grid.
      const double angle = rays_.PixelAngle(column, row) * rays_.width() / kMeterColumns;
      const RayLight light =
          renderer.Trace(moment, T_world_camera.translation(),
                         T_world_camera.rotation() * bearing.cast<double>(), angle);
      metering.luminances.push_back(kLuminanceWeights.dot(light.luminance) * Vignette(column, row));
      if (light.range > 0.0F) ranges.push_back(light.range);
    }
  }
  if (!ranges.empty()) {
    const auto tenth = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 10);
    std::nth_element(ranges.begin(), tenth, ranges.end());
    metering.near = *tenth;
  }
  return metering;
}

std::vector<Exposure> CameraSimulator::ControlExposure(const std::vector<Metering>& meterings,
                                                       double interval) const {
  const CameraPhysics& physics = sensor_.physics();
  const double lowest = physics.min_exposure, highest = physics.max_exposure * physics.max_gain;
  double product = 1e-3;  // exposure times gain, s
  const auto correct = [&](const Metering& metering, double share) {
    if (metering.luminances.empty()) return;
    double mean = 0.0;
    for (const float luminance : metering.luminances)
      mean += sensor_.Expected(luminance, sensor_.Split(product));
    mean = std::max(1.0, mean / static_cast<double>(metering.luminances.size()));
    // Grey values follow the exposure to the power of 1 / gamma.
    const double wanted = std::pow(physics.target_grey / mean, physics.gamma);
    product = std::clamp(product * std::pow(wanted, share), lowest, highest);
  };
  std::vector<Exposure> exposures;
  const double share = 1.0 - std::exp(-interval / physics.exposure_lag);
  for (std::size_t i = 0; i < meterings.size(); ++i) {
    if (i == 0) {
      for (int settle = 0; settle < 50; ++settle) correct(meterings[0], 0.5);
    } else {
      correct(meterings[i - 1], share);
    }
    exposures.push_back(sensor_.Split(product));
  }
  return exposures;
}

// Evenly over the exposure and the pixel.
std::vector<CameraSimulator::Sample> CameraSimulator::Spread(int count) {
  std::vector<Sample> samples;
  for (int i = 0; i < count; ++i) {
    samples.push_back({.time = (i + 0.5) / count - 0.5,
                       .dx = static_cast<float>(RadicalInverse(i + 1, 2) - 0.5),
                       .dy = static_cast<float>(RadicalInverse(i + 1, 3) - 0.5)});
  }
  // Their mean is the middle of the pixel: no shift of edges.
  float x = 0.0F, y = 0.0F;
  for (const Sample& s : samples) {
    x += s.dx / static_cast<float>(count);
    y += s.dy / static_cast<float>(count);
  }
  for (Sample& s : samples) {
    s.dx = std::clamp(s.dx - x, -0.5F, 0.5F);
    s.dy = std::clamp(s.dy - y, -0.5F, 0.5F);
  }
  return samples;
}

int CameraSimulator::SamplesFor(const PoseSpline& motion, Time time, const Exposure& exposure,
                                float near) const {
  const MotionSample sample = motion.At(time);
  const double arm = (sample.angular_velocity.cross(spec_.T_body_camera.translation())).norm();
  const double speed = sample.velocity.norm() + arm;
  const double rate = sample.angular_velocity.norm() + (near > 0.0F ? speed / near : 0.0);
  const double blur = rate * exposure.seconds * rays_.max_resolution();
  return blur < 0.8 ? 1 : std::clamp(static_cast<int>(std::ceil(blur)), 2, kMaxSamples);
}

RayLight CameraSimulator::Look(const Shot& shot, const Sample& sample, std::size_t instant,
                               int column, int row) const {
  const Eigen::Vector3f bearing = rays_.Bearing(column, row, sample.dx, sample.dy);
  if (bearing.isZero()) return {};
  const double angle = rays_.PixelAngle(column, row);
  if (sensor_.physics().row_time == Duration()) {
    const Eigen::Vector3d direction =
        (shot.R_world_camera[instant] * bearing).normalized().cast<double>();
    return shot.renderer->Trace(shot.moments[instant], shot.T_world_camera[instant].translation(),
                                direction, angle);
  }
  const Time time = shot.time + sensor_.physics().row_time * row +
                    Duration::FromSeconds(sample.time * shot.exposure);
  const Pose3 T_world_camera = shot.motion->PoseAt(time) * spec_.T_body_camera;
  // Moving objects and lamps are taken at the first row's time.
  return shot.renderer->Trace(shot.moments[instant], T_world_camera.translation(),
                              T_world_camera.rotation() * bearing.cast<double>(), angle);
}

// The mean light of every pixel over the samples that all pixels get; range, normal and surface of
// the one in the middle.
void CameraSimulator::Trace(const Shot& shot, std::vector<RayLight>& lights) const {
  const auto width = static_cast<std::size_t>(rays_.width());
  const std::size_t count = shot.samples.size();
  ParallelFor(static_cast<std::size_t>(rays_.height()), 4, [&](std::size_t row) {
    for (std::size_t column = 0; column < width; ++column) {
      RayLight& light = lights[row * width + column];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (std::size_t k = 0; k < count; ++k) {
        const RayLight one =
            Look(shot, shot.samples[k], k, static_cast<int>(column), static_cast<int>(row));
        sum += one.luminance;
        if (k == count / 2) light = one;
      }
      light.luminance = sum / static_cast<float>(count);
    }
  });
}

bool CameraSimulator::IsEdge(const std::vector<RayLight>& lights, int column, int row) const {
  const auto at = [&](int c, int r) -> const RayLight& {
    return lights[static_cast<std::size_t>(r) * static_cast<std::size_t>(rays_.width()) +
                  static_cast<std::size_t>(c)];
  };
  const RayLight& here = at(column, row);
  const auto differs = [&](int c, int r) {
    if (c < 0 || r < 0 || c >= rays_.width() || r >= rays_.height()) return false;
    return !SameSurface(here, at(c, r));
  };
  return differs(column - 1, row) || differs(column + 1, row) || differs(column, row - 1) ||
         differs(column, row + 1);
}

void CameraSimulator::Refine(const Shot& shot, const std::vector<RayLight>& lights, int row,
                             std::vector<Eigen::Vector3f>& line) const {
  for (int column = 0; column < rays_.width(); ++column) {
    const auto index = static_cast<std::size_t>(row) * static_cast<std::size_t>(rays_.width()) +
                       static_cast<std::size_t>(column);
    Eigen::Vector3f light = lights[index].luminance;
    if (shot.samples.size() < kEdgeSamples && IsEdge(lights, column, row)) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (std::size_t k = 0; k < shot.edge_samples.size(); ++k) {
        sum += Look(shot, shot.edge_samples[k], shot.samples.size() + k, column, row).luminance;
      }
      light = sum / static_cast<float>(shot.edge_samples.size());
    }
    line[static_cast<std::size_t>(column)] = Vignette(column, row) * light;
  }
}

Image CameraSimulator::Render(const SceneRenderer& renderer, const PoseSpline& motion, Time time,
                              std::uint64_t index, const Exposure& exposure, float near) const {
  Shot shot{.renderer = &renderer,
            .motion = &motion,
            .time = time,
            .exposure = exposure.seconds,
            .samples = Spread(SamplesFor(motion, time, exposure, near)),
            .edge_samples = Spread(kEdgeSamples)};
  for (const auto* group : {&shot.samples, &shot.edge_samples}) {
    for (const Sample& sample : *group) {
      const Time instant = time + Duration::FromSeconds(sample.time * exposure.seconds);
      const Pose3 T_world_body = motion.PoseAt(instant);
      shot.T_world_camera.push_back(T_world_body * spec_.T_body_camera);
      shot.R_world_camera.push_back(shot.T_world_camera.back().R().cast<float>());
      shot.moments.push_back(renderer.At(instant, T_world_body.translation()));
    }
  }
  const auto width = static_cast<std::size_t>(rays_.width());
  const auto height = static_cast<std::size_t>(rays_.height());
  std::vector<RayLight> lights(width * height);
  Trace(shot, lights);

  const bool colour = sensor_.physics().colour;
  Image image{.width = rays_.width(), .height = rays_.height(), .channels = colour ? 3 : 1};
  image.pixels.resize(width * height * (colour ? 3U : 1U));
  const RandomStream stream = random_.Fork(index);
  ParallelFor(height, 4, [&](std::size_t row) {
    std::vector<Eigen::Vector3f> line(width);
    Refine(shot, lights, static_cast<int>(row), line);
    RandomStream random = stream.Fork(row);
    std::uint8_t* out = image.pixels.data() + row * width * (colour ? 3U : 1U);
    for (const Eigen::Vector3f& light : line) {
      if (colour) {
        for (const int channel : {2, 1, 0})
          *out++ = sensor_.Expose(light[channel], exposure, random);
      } else {
        *out++ = sensor_.Expose(kLuminanceWeights.dot(light), exposure, random);
      }
    }
  });
  return image;
}

}  // namespace mlvi
