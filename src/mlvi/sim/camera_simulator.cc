// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_simulator.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

constexpr int kMeterColumns = 12, kMeterRows = 9;
constexpr std::size_t kFew = 8, kMany = 16;  // rays of a pixel that an edge lies in
constexpr float kLongWay = 6.0F;             // px; edges that move farther get many
constexpr std::uint8_t kEdge = 1, kFastEdge = 2;
constexpr float kFar = 1000.0F;  // m

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

// One of the rays that make a pixel.
struct PixelSample {
  double time = 0.0;           // share of the exposure, in (-0.5, 0.5)
  float dx = 0.0F, dy = 0.0F;  // px
};

// Evenly over the exposure and the pixel.
std::vector<PixelSample> Spread(std::size_t count) {
  std::vector<PixelSample> samples;
  const auto n = static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    samples.push_back({.time = (static_cast<double>(i) + 0.5) / n - 0.5,
                       .dx = static_cast<float>(RadicalInverse(static_cast<int>(i) + 1, 2) - 0.5),
                       .dy = static_cast<float>(RadicalInverse(static_cast<int>(i) + 1, 3) - 0.5)});
  }
  // Their mean is the middle of the pixel: no shift of edges.
  float x = 0.0F, y = 0.0F;
  for (const PixelSample& s : samples) {
    x += s.dx / static_cast<float>(n);
    y += s.dy / static_cast<float>(n);
  }
  for (PixelSample& s : samples) {
    s.dx = std::clamp(s.dx - x, -0.5F, 0.5F);
    s.dy = std::clamp(s.dy - y, -0.5F, 0.5F);
  }
  return samples;
}

// Samples of a pixel that met the same surface.
struct SampleGroup {
  std::size_t sample = 0;  // the one nearest to their middle, in the pixel and the exposure
  float share = 0.0F;      // of all samples
};

std::vector<SampleGroup> GroupBySurface(std::span<const Sight> sights,
                                        const std::vector<PixelSample>& spread) {
  const auto place = [&](std::size_t k) {
    return Eigen::Vector3f(spread[k].dx, spread[k].dy, static_cast<float>(spread[k].time));
  };
  std::vector<SampleGroup> groups;
  std::array<bool, kMany> taken{};
  for (std::size_t g = 0; g < sights.size(); ++g) {
    if (taken[g]) continue;
    std::array<std::size_t, kMany> members;
    std::size_t count = 0;
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    for (std::size_t k = g; k < sights.size(); ++k) {
      if (taken[k] || !SameSurface(sights[g], sights[k])) continue;
      taken[k] = true;
      members[count++] = k;
      middle += place(k);
    }
    middle /= static_cast<float>(count);
    const auto nearer = [&](std::size_t a, std::size_t b) {
      return (place(a) - middle).squaredNorm() < (place(b) - middle).squaredNorm();
    };
    groups.push_back({.sample = *std::min_element(members.begin(), members.begin() + count, nearer),
                      .share = static_cast<float>(count) / static_cast<float>(sights.size())});
  }
  return groups;
}

// cos^4-like in the middle, steeper towards the corners where the lens cuts the beam.
std::vector<float> MakeVignette(const CameraModel& lens, double corner_brightness) {
  const Eigen::Vector2d c = lens.principal_point();
  const double corner2 = std::pow(std::max(c.x(), lens.width() - c.x()), 2) +
                         std::pow(std::max(c.y(), lens.height() - c.y()), 2);
  std::vector<float> vignette;
  for (int row = 0; row < lens.height(); ++row) {
    for (int column = 0; column < lens.width(); ++column) {
      const double r2 = (Eigen::Vector2d(column, row) - c).squaredNorm() / corner2;
      vignette.push_back(
          static_cast<float>(1.0 - (1.0 - corner_brightness) * (0.45 * r2 + 0.55 * r2 * r2 * r2)));
    }
  }
  return vignette;
}

}  // namespace

namespace {

// The pose of the camera at one instant.
struct CameraInstant {
  Pose3 T_world_camera;
  Eigen::Matrix3f R = Eigen::Matrix3f::Identity();
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
};

}  // namespace

struct CameraSimulator::Instants {
  CameraInstant middle;
  std::vector<CameraInstant> few, many;  // of the samples
  SceneRenderer::ExposureMotion motion;
};

struct CameraSimulator::Shot {
  const SceneRenderer* renderer;
  const PoseSpline* spline;
  Time time;
  double exposure = 0.0;  // s
  std::vector<PixelSample> few, many;
  // Moving objects and lamps; of the first row if rolling.
  SceneRenderer::Moment begin, middle, end;
  std::vector<SceneRenderer::Moment> few_moments, many_moments;
  std::optional<Instants> instants;  // of all rows, unless rolling
};

CameraSimulator::CameraSimulator(const CameraSpec& spec, const CameraPhysics& physics,
                                 RandomStream random)
    : spec_(spec),
      rays_(*spec.model),
      sensor_(physics),
      random_(random),
      vignette_(MakeVignette(*spec.model, physics.corner_brightness)) {}

CameraSimulator::Metering CameraSimulator::Meter(const SceneRenderer& renderer,
                                                 const PoseSpline& motion, Time time) const {
  const Pose3 T_world_body = motion.PoseAt(time);
  const Pose3 T_world_camera = T_world_body * spec_.T_body_camera;
  const auto moment = renderer.At(time, T_world_body.translation());
  Metering metering;
  for (int i = 0; i < kMeterRows; ++i) {
    for (int j = 0; j < kMeterColumns; ++j) {
      const int column = (2 * j + 1) * rays_.width() / (2 * kMeterColumns);
      const int row = (2 * i + 1) * rays_.height() / (2 * kMeterRows);
      const Eigen::Vector3f bearing = rays_.Bearing(column, row);
      if (bearing.isZero()) continue;
      // Each ray stands for its whole cell of the grid.
      const float angle = rays_.PixelAngle(column, row) * static_cast<float>(rays_.width()) /
                          static_cast<float>(kMeterColumns);
      const auto light =
          renderer.Trace(moment, {.origin = T_world_camera.translation(),
                                  .direction = T_world_camera.rotation().cast<float>() * bearing,
                                  .pixel_angle = angle});
      metering.push_back(kLuminanceWeights.dot(light.luminance) * vignette_[IndexOf(column, row)]);
    }
  }
  return metering;
}

std::vector<Exposure> CameraSimulator::ControlExposure(const std::vector<Metering>& meterings,
                                                       double interval) const {
  const CameraPhysics& physics = sensor_.physics();
  const double lowest = physics.min_exposure, highest = physics.max_exposure * physics.max_gain;
  double product = 1e-3;  // exposure times gain, s
  const auto correct = [&](const Metering& metering, double share) {
    if (metering.empty()) return;
    double mean = 0.0;
    for (const float luminance : metering)
      mean += sensor_.Expected(luminance, sensor_.Split(product));
    mean = std::max(1.0, mean / static_cast<double>(metering.size()));
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

CameraSimulator::Instants CameraSimulator::InstantsOf(const Shot& shot, int row) const {
  const Time row_time = shot.time + sensor_.physics().row_time * row;
  const auto at = [&](double share) {
    const Pose3 T_world_camera =
        shot.spline->PoseAt(row_time + Duration::FromSeconds(share * shot.exposure)) *
        spec_.T_body_camera;
    return CameraInstant{.T_world_camera = T_world_camera,
                         .R = T_world_camera.R().cast<float>(),
                         .position = T_world_camera.translation().cast<float>()};
  };
  Instants instants{.middle = at(0.0)};
  for (const PixelSample& sample : shot.few) instants.few.push_back(at(sample.time));
  for (const PixelSample& sample : shot.many) instants.many.push_back(at(sample.time));
  instants.motion = SceneRenderer::MakeExposureMotion(
      {&shot.begin, &shot.middle, &shot.end},
      {at(-0.5).T_world_camera, instants.middle.T_world_camera, at(0.5).T_world_camera});
  return instants;
}

CameraSimulator::Shot CameraSimulator::MakeShot(const SceneRenderer& renderer,
                                                const PoseSpline& motion, Time time,
                                                const Exposure& exposure) const {
  const auto carried_lamp = [&](Time t) { return motion.PoseAt(t).translation(); };
  const auto middle = renderer.At(time, carried_lamp(time));
  const auto moment = [&](double share) {
    const Time t = time + Duration::FromSeconds(share * exposure.seconds);
    return renderer.At(t, carried_lamp(t), middle);
  };
  Shot shot{.renderer = &renderer,
            .spline = &motion,
            .time = time,
            .exposure = exposure.seconds,
            .few = Spread(kFew),
            .many = Spread(kMany),
            .begin = moment(-0.5),
            .middle = middle,
            .end = moment(0.5)};
  for (const PixelSample& sample : shot.few) shot.few_moments.push_back(moment(sample.time));
  for (const PixelSample& sample : shot.many) shot.many_moments.push_back(moment(sample.time));
  return shot;
}

// What the middles of a row's pixels meet at the middle of the exposure.
void CameraSimulator::LookAlongRow(const Shot& shot, int row, Sights& sights) const {
  std::optional<Instants> own;
  if (!shot.instants) own = InstantsOf(shot, row);
  const CameraInstant& camera = (own ? *own : *shot.instants).middle;
  SceneRenderer::Moments moments;
  moments.fill(&shot.middle);
  for (int first = 0; first < rays_.width(); first += RayPacket::kSize) {
    RayPacket packet;
    const int count = std::min(RayPacket::kSize, rays_.width() - first);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3f bearing = rays_.Bearing(first + i, row);
      if (!bearing.isZero()) packet.Set(i, camera.position, camera.R * bearing, kFar);
    }
    if (packet.active == 0) continue;
    const auto seen = shot.renderer->Look(packet, moments);
    std::copy_n(seen.begin(), count,
                sights.begin() + static_cast<std::ptrdiff_t>(IndexOf(first, row)));
  }
}

bool CameraSimulator::IsEdge(const Sights& sights, int column, int row) const {
  const Sight& here = sights[IndexOf(column, row)];
  const auto differs = [&](int c, int r) {
    if (c < 0 || r < 0 || c >= rays_.width() || r >= rays_.height()) return false;
    return !SameSurface(here, sights[IndexOf(c, r)]);
  };
  return differs(column - 1, row) || differs(column + 1, row) || differs(column, row - 1) ||
         differs(column, row + 1);
}

// Marks the pixels that the edges of a row sweep over during the exposure: both surfaces at an edge
// mark their own way, so that the one in front does.
void CameraSimulator::MarkEdges(const Shot& shot, int row, const Sights& sights,
                                Marks& marks) const {
  std::optional<Instants> own;
  if (!shot.instants) own = InstantsOf(shot, row);
  const auto& motion = (own ? *own : *shot.instants).motion;
  for (int column = 0; column < rays_.width(); ++column) {
    if (!IsEdge(sights, column, row)) continue;
    const Sight& sight = sights[IndexOf(column, row)];
    const Eigen::Vector3f bearing = rays_.Bearing(column, row);
    if (bearing.isZero()) continue;
    const float range = sight.hit.range > 0.0F ? sight.hit.range : 1.0F;
    const Eigen::Vector3f moved =
        shot.renderer->Displacement(motion, sight.hit, range * (motion.R_world_camera * bearing));
    const Eigen::Vector2f way =
        rays_.ToPixels(column, row, motion.R_world_camera.transpose() * (moved / range));
    const float length = way.norm();
    const std::uint8_t mark = length > kLongWay ? kFastEdge : kEdge;
    // Half a pixel farther at both ends.
    const int steps = static_cast<int>(std::ceil(length + 0.5F));
    for (int i = -steps; i <= steps; ++i) {
      const float share = length < 0.5F ? 0.0F
                                        : 0.5F * static_cast<float>(i) / static_cast<float>(steps) *
                                              (1.0F + 1.0F / length);
      const int c = column + static_cast<int>(std::lround(share * way.x()));
      const int r = row + static_cast<int>(std::lround(share * way.y()));
      if (c < 0 || r < 0 || c >= rays_.width() || r >= rays_.height()) continue;
      std::atomic_ref(marks[IndexOf(c, r)]).fetch_or(mark, std::memory_order_relaxed);
    }
  }
}

// The light of a pixel from all its samples; those that met the same surface share one shade.
Eigen::Vector3f CameraSimulator::Refined(const Shot& shot, const Instants& instants, int column,
                                         int row, std::size_t samples) const {
  const bool many = samples == kMany;
  const auto& spread = many ? shot.many : shot.few;
  const auto& moments = many ? shot.many_moments : shot.few_moments;
  const auto& cameras = many ? instants.many : instants.few;
  std::array<Sight, kMany> sights;
  std::array<Eigen::Vector3f, kMany> directions;
  for (std::size_t first = 0; first < samples; first += RayPacket::kSize) {
    RayPacket packet;
    SceneRenderer::Moments at;
    for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
      const std::size_t k = first + i;
      at[i] = &moments[k];
      const Eigen::Vector3f bearing = rays_.Bearing(column, row, spread[k].dx, spread[k].dy);
      if (bearing.isZero()) return bearing;
      directions[k] = cameras[k].R * bearing;
      packet.Set(static_cast<int>(i), cameras[k].position, directions[k], kFar);
    }
    const auto seen = shot.renderer->Look(packet, at);
    std::ranges::copy(seen, sights.begin() + static_cast<std::ptrdiff_t>(first));
  }
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const SampleGroup& group : GroupBySurface(std::span(sights).first(samples), spread)) {
    const std::size_t k = group.sample;
    sum += group.share * shot.renderer->Shade(moments[k],
                                              {.origin = cameras[k].T_world_camera.translation(),
                                               .direction = directions[k],
                                               .pixel_angle = rays_.PixelAngle(column, row),
                                               .motion = &instants.motion,
                                               .share = group.share},
                                              sights[k]);
  }
  return sum;
}

void CameraSimulator::ShadeRow(const Shot& shot, int row, const Sights& sights, const Marks& marks,
                               std::vector<Eigen::Vector3f>& line) const {
  std::optional<Instants> own;
  if (!shot.instants) own = InstantsOf(shot, row);
  const Instants& instants = own ? *own : *shot.instants;
  for (int column = 0; column < rays_.width(); ++column) {
    const std::size_t index = IndexOf(column, row);
    Eigen::Vector3f light = Eigen::Vector3f::Zero();
    if (marks[index] != 0) {
      light = Refined(shot, instants, column, row, (marks[index] & kFastEdge) != 0 ? kMany : kFew);
    } else if (const Eigen::Vector3f bearing = rays_.Bearing(column, row); !bearing.isZero()) {
      light = shot.renderer->Shade(shot.middle,
                                   {.origin = instants.middle.T_world_camera.translation(),
                                    .direction = instants.middle.R * bearing,
                                    .pixel_angle = rays_.PixelAngle(column, row),
                                    .motion = &instants.motion},
                                   sights[index]);
    }
    line[static_cast<std::size_t>(column)] = vignette_[index] * light;
  }
}

void CameraSimulator::ExposeRow(const std::vector<Eigen::Vector3f>& line, const Exposure& exposure,
                                RandomStream random, std::uint8_t* out) const {
  for (const Eigen::Vector3f& light : line) {
    if (sensor_.physics().colour) {
      for (const int channel : {2, 1, 0}) *out++ = sensor_.Expose(light[channel], exposure, random);
    } else {
      *out++ = sensor_.Expose(kLuminanceWeights.dot(light), exposure, random);
    }
  }
}

Image CameraSimulator::Render(const SceneRenderer& renderer, const PoseSpline& motion, Time time,
                              std::uint64_t index, const Exposure& exposure,
                              StageTimes* times) const {
  std::optional<StageTimes::Scope> stage;
  const auto begin_stage = [&](const char* name) {
    stage.reset();
    if (times != nullptr) stage.emplace(*times, name);
  };
  begin_stage("look");
  Shot shot = MakeShot(renderer, motion, time, exposure);
  if (sensor_.physics().row_time == Duration()) shot.instants = InstantsOf(shot, 0);
  const auto width = static_cast<std::size_t>(rays_.width());
  const auto height = static_cast<std::size_t>(rays_.height());
  Sights sights(width * height);
  Marks marks(width * height);
  ParallelFor(height, 4,
              [&](std::size_t row) { LookAlongRow(shot, static_cast<int>(row), sights); });
  begin_stage("edges");
  ParallelFor(height, 4,
              [&](std::size_t row) { MarkEdges(shot, static_cast<int>(row), sights, marks); });

  begin_stage("shade");
  const std::size_t channels = sensor_.physics().colour ? 3 : 1;
  Image image{
      .width = rays_.width(), .height = rays_.height(), .channels = static_cast<int>(channels)};
  image.pixels.resize(width * height * channels);
  const RandomStream stream = random_.Fork(index);
  ParallelFor(height, 4, [&](std::size_t row) {
    std::vector<Eigen::Vector3f> line(width);
    ShadeRow(shot, static_cast<int>(row), sights, marks, line);
    ExposeRow(line, exposure, stream.Fork(row), image.pixels.data() + row * width * channels);
  });
  return image;
}

}  // namespace mlvi
