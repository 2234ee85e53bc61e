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
#include "mlvi/sim/camera_samples.h"

namespace mlvi {
namespace {

constexpr int kMeterColumns = 12, kMeterRows = 9;
constexpr int kBlock = 4;         // px; a block of as many rows and columns is one packet of rays
constexpr float kLongWay = 6.0F;  // px; edges that move farther get many rays
constexpr std::uint8_t kEdge = 1, kFastEdge = 2;                   // marks
constexpr std::uint8_t kUnlikeNextColumn = 1, kUnlikeNextRow = 2;  // borders
constexpr float kFar = 1000.0F;                                    // m

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
  std::vector<internal::PixelSample> few, many;
  // Moving objects and lamps; of the first row if rolling.
  SceneRenderer::Moment begin, middle, end;
  std::vector<SceneRenderer::Moment> few_moments, many_moments;
  std::vector<Instants> instants;  // by row; one for all unless rolling

  const Instants& At(int row) const {
    return instants.size() == 1 ? instants.front() : instants[static_cast<std::size_t>(row)];
  }
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
  for (const internal::PixelSample& sample : shot.few) instants.few.push_back(at(sample.time));
  for (const internal::PixelSample& sample : shot.many) instants.many.push_back(at(sample.time));
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
            .few = internal::FewSamples(),
            .many = internal::ManySamples(),
            .begin = moment(-0.5),
            .middle = middle,
            .end = moment(0.5)};
  for (const internal::PixelSample& sample : shot.few)
    shot.few_moments.push_back(moment(sample.time));
  for (const internal::PixelSample& sample : shot.many)
    shot.many_moments.push_back(moment(sample.time));
  return shot;
}

void CameraSimulator::FindInstants(Shot& shot) const {
  const bool rolling = sensor_.physics().row_time != Duration();
  shot.instants.resize(rolling ? static_cast<std::size_t>(rays_.height()) : 1);
  ParallelFor(shot.instants.size(), 64, [&](std::size_t row) {
    shot.instants[row] = InstantsOf(shot, static_cast<int>(row));
  });
}

void CameraSimulator::FindBorders(int row, const Sights& sights, Marks& borders) const {
  for (int column = 0; column < rays_.width(); ++column) {
    const std::size_t here = IndexOf(column, row);
    const auto unlike = [&](int c, int r) {
      return c < rays_.width() && r < rays_.height() &&
             !SameSurface(sights[here], sights[IndexOf(c, r)]);
    };
    borders[here] = static_cast<std::uint8_t>((unlike(column + 1, row) ? kUnlikeNextColumn : 0) |
                                              (unlike(column, row + 1) ? kUnlikeNextRow : 0));
  }
}

bool CameraSimulator::IsEdge(const Marks& borders, int column, int row) const {
  if (borders[IndexOf(column, row)] != 0) return true;
  if (column > 0 && (borders[IndexOf(column - 1, row)] & kUnlikeNextColumn) != 0) return true;
  return row > 0 && (borders[IndexOf(column, row - 1)] & kUnlikeNextRow) != 0;
}

// Marks the pixels that the edges of a row sweep over during the exposure: both surfaces at an edge
// mark their own way, so that the one in front does.
void CameraSimulator::MarkEdges(const Shot& shot, int row, const Sights& sights,
                                const Marks& borders, Marks& marks) const {
  const auto& motion = shot.At(row).motion;
  for (int column = 0; column < rays_.width(); ++column) {
    if (!IsEdge(borders, column, row)) continue;
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

// kBlock rows of one image.
class CameraSimulator::Band {
 public:
  Band(const CameraSimulator& camera, const Shot& shot, int index)
      : camera_(&camera), shot_(&shot), first_row_(kBlock * index) {}

  int first_row() const { return first_row_; }
  int rows() const { return std::min(kBlock, camera_->rays_.height() - first_row_); }

  // What the middles of its pixels meet at the middle of the exposure.
  void Look(Sights& sights) const;
  // The light of its pixels, in rows.
  std::vector<Eigen::Vector3f> Shade(const Sights& sights, const Marks& marks);

 private:
  // A pixel that an edge may lie in, and what its samples met.
  struct EdgePixel {
    int column = 0, row = 0;
    std::array<Sight, internal::kManySamples> sights;
  };
  // A few of them, without the cost of making and copying what is not yet known.
  struct EdgePixels {
    std::array<EdgePixel, 8> pixels;
    std::size_t size = 0;
    std::span<EdgePixel> Last(std::size_t count) { return {pixels.data() + size - count, count}; }
    EdgePixel& Add(int column, int row) {
      EdgePixel& pixel = pixels[size++];
      pixel.column = column, pixel.row = row;
      return pixel;
    }
  };
  template <typename Visit>
  void VisitBlock(int first_column, const Visit& visit) const;
  std::size_t PixelOf(int column, int row) const {
    return camera_->IndexOf(column, row - first_row_);
  }
  void AddMiddle(int column, int row, const Sight& sight);
  void AddEdge(int column, int row, bool fast, const Sights& sights);
  void LookAgain(std::span<EdgePixel> pixels, bool many, std::size_t first, std::size_t count);
  void LookAtFirst(const Sights& sights);
  void LookAtRest(std::size_t count);
  void AddSamples(const EdgePixel& pixel, bool many);

  const CameraSimulator* camera_;
  const Shot* shot_;
  int first_row_;
  std::vector<SceneRenderer::LightRay> rays_;
  // Four of either share a packet.
  EdgePixels fresh_;  // to look at along the first of few samples
  EdgePixels mixed_;  // and along the others
  std::vector<internal::SampleGroup> groups_;
};

// Calls visit(lane of a packet, column, row) for the pixels of a block that have a bearing.
template <typename Visit>
void CameraSimulator::Band::VisitBlock(int first_column, const Visit& visit) const {
  const int columns = std::min(kBlock, camera_->rays_.width() - first_column);
  for (int i = 0; i < rows(); ++i) {
    for (int k = 0; k < columns; ++k) {
      const int column = first_column + k, row = first_row_ + i;
      if (!camera_->rays_.Bearing(column, row).isZero()) visit(kBlock * i + k, column, row);
    }
  }
}

void CameraSimulator::Band::Look(Sights& sights) const {
  static_assert(WideRayPacket::kSize == kBlock * kBlock);
  SceneRenderer::Moments moments;
  moments.fill(&shot_->middle);
  for (int first = 0; first < camera_->rays_.width(); first += kBlock) {
    WideRayPacket packet;
    VisitBlock(first, [&](int lane, int column, int row) {
      const CameraInstant& middle = shot_->At(row).middle;
      packet.Set(lane, middle.position, middle.R * camera_->rays_.Bearing(column, row), kFar);
    });
    if (packet.active == 0) continue;
    const auto seen = shot_->renderer->Look(packet, moments);
    VisitBlock(first, [&](int lane, int column, int row) {
      sights[camera_->IndexOf(column, row)] = seen[static_cast<std::size_t>(lane)];
    });
  }
}

std::vector<Eigen::Vector3f> CameraSimulator::Band::Shade(const Sights& sights,
                                                          const Marks& marks) {
  const auto pixels = static_cast<std::size_t>(rows() * camera_->rays_.width());
  rays_.reserve(pixels + pixels / 4);
  for (int first = 0; first < camera_->rays_.width(); first += kBlock) {
    VisitBlock(first, [&](int, int column, int row) {
      const std::size_t index = camera_->IndexOf(column, row);
      if (marks[index] == 0)
        AddMiddle(column, row, sights[index]);
      else
        AddEdge(column, row, (marks[index] & kFastEdge) != 0, sights);
    });
  }
  LookAtFirst(sights);
  LookAtRest(mixed_.size);
  std::vector<Eigen::Vector3f> light(pixels, Eigen::Vector3f::Zero());
  shot_->renderer->Shade(std::move(rays_), light);
  return light;
}

void CameraSimulator::Band::AddMiddle(int column, int row, const Sight& sight) {
  const Instants& instants = shot_->At(row);
  rays_.push_back({.moment = &shot_->middle,
                   .view = {.origin = instants.middle.T_world_camera.translation(),
                            .direction = instants.middle.R * camera_->rays_.Bearing(column, row),
                            .pixel_angle = camera_->rays_.PixelAngle(column, row),
                            .motion = &instants.motion},
                   .sight = sight,
                   .pixel = PixelOf(column, row)});
}

void CameraSimulator::Band::AddEdge(int column, int row, bool fast, const Sights& sights) {
  const EdgePixel& pixel = fresh_.Add(column, row);
  if (fast) {
    LookAgain(fresh_.Last(1), true, 0, internal::kManySamples);
    AddSamples(pixel, true);
    --fresh_.size;
  } else if (fresh_.size * internal::kFirstSamples == WideRayPacket::kSize) {
    LookAtFirst(sights);
  }
}

// Fills in `count` samples of every pixel, from `first` on; all of them make one packet.
void CameraSimulator::Band::LookAgain(std::span<EdgePixel> pixels, bool many, std::size_t first,
                                      std::size_t count) {
  const auto& samples = many ? shot_->many : shot_->few;
  const auto& at = many ? shot_->many_moments : shot_->few_moments;
  WideRayPacket packet;
  SceneRenderer::Moments moments;
  moments.fill(&shot_->middle);
  for (std::size_t lane = 0; lane < pixels.size() * count; ++lane) {
    const EdgePixel& pixel = pixels[lane / count];
    const std::size_t k = first + lane % count;
    const Instants& instants = shot_->At(pixel.row);
    const CameraInstant& camera = (many ? instants.many : instants.few)[k];
    const Eigen::Vector3f bearing =
        camera_->rays_.Bearing(pixel.column, pixel.row, samples[k].dx, samples[k].dy);
    packet.Set(static_cast<int>(lane), camera.position, camera.R * bearing, kFar);
    moments[lane] = &at[k];
  }
  const auto seen = shot_->renderer->Look(packet, moments);
  for (std::size_t lane = 0; lane < pixels.size() * count; ++lane)
    pixels[lane / count].sights[first + lane % count] = seen[lane];
}

// Where the first samples and the middle met one surface, no edge lies in the pixel.
void CameraSimulator::Band::LookAtFirst(const Sights& sights) {
  if (fresh_.size == 0) return;
  const std::span<EdgePixel> fresh = fresh_.Last(fresh_.size);
  LookAgain(fresh, false, 0, internal::kFirstSamples);
  for (const EdgePixel& pixel : fresh) {
    const Sight& middle = sights[camera_->IndexOf(pixel.column, pixel.row)];
    const auto first = std::span(pixel.sights).first(internal::kFirstSamples);
    if (std::ranges::all_of(first, [&](const Sight& s) { return SameSurface(s, middle); }))
      AddMiddle(pixel.column, pixel.row, middle);
    else
      std::ranges::copy(first, mixed_.Add(pixel.column, pixel.row).sights.begin());
  }
  fresh_.size = 0;
  constexpr std::size_t kTogether =
      WideRayPacket::kSize / (internal::kFewSamples - internal::kFirstSamples);
  if (mixed_.size >= kTogether) LookAtRest(kTogether);
}

// Of the last so many of the mixed pixels.
void CameraSimulator::Band::LookAtRest(std::size_t count) {
  if (count == 0) return;
  const std::span<EdgePixel> pixels = mixed_.Last(count);
  LookAgain(pixels, false, internal::kFirstSamples,
            internal::kFewSamples - internal::kFirstSamples);
  for (const EdgePixel& pixel : pixels) AddSamples(pixel, false);
  mixed_.size -= count;
}

// The light of a pixel from all its samples; those that met the same surface share one shade.
void CameraSimulator::Band::AddSamples(const EdgePixel& pixel, bool many) {
  const auto& samples = many ? shot_->many : shot_->few;
  const Instants& instants = shot_->At(pixel.row);
  internal::GroupBySurface(std::span(pixel.sights).first(samples.size()), samples, groups_);
  for (const internal::SampleGroup& group : groups_) {
    const std::size_t k = group.sample;
    const CameraInstant& camera = (many ? instants.many : instants.few)[k];
    rays_.push_back(
        {.moment = &(many ? shot_->many_moments : shot_->few_moments)[k],
         .view = {.origin = camera.T_world_camera.translation(),
                  .direction = camera.R * camera_->rays_.Bearing(pixel.column, pixel.row,
                                                                 samples[k].dx, samples[k].dy),
                  .pixel_angle = camera_->rays_.PixelAngle(pixel.column, pixel.row),
                  .motion = &instants.motion,
                  .share = group.share},
         .sight = pixel.sights[k],
         .pixel = PixelOf(pixel.column, pixel.row),
         .weight = group.share});
  }
}

void CameraSimulator::ExposeRow(std::span<const Eigen::Vector3f> line, const Exposure& exposure,
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
  FindInstants(shot);
  const auto width = static_cast<std::size_t>(rays_.width());
  const auto height = static_cast<std::size_t>(rays_.height());
  const std::size_t bands = (height + kBlock - 1) / kBlock;
  const auto band = [&](std::size_t i) { return Band(*this, shot, static_cast<int>(i)); };
  Sights sights(width * height);
  ParallelFor(bands, 1, [&](std::size_t i) { band(i).Look(sights); });
  begin_stage("edges");
  Marks borders(width * height), marks(width * height);
  ParallelFor(height, 4,
              [&](std::size_t row) { FindBorders(static_cast<int>(row), sights, borders); });
  ParallelFor(height, 4, [&](std::size_t row) {
    MarkEdges(shot, static_cast<int>(row), sights, borders, marks);
  });

  begin_stage("shade");
  const std::size_t channels = sensor_.physics().colour ? 3 : 1;
  Image image{
      .width = rays_.width(), .height = rays_.height(), .channels = static_cast<int>(channels)};
  image.pixels.resize(width * height * channels);
  const RandomStream stream = random_.Fork(index);
  ParallelFor(bands, 1, [&](std::size_t i) {
    Band rows = band(i);
    std::vector<Eigen::Vector3f> light = rows.Shade(sights, marks);
    const auto first = static_cast<std::size_t>(rows.first_row());
    for (std::size_t k = 0; k < light.size(); ++k) light[k] *= vignette_[first * width + k];
    for (std::size_t row = 0; row < light.size() / width; ++row) {
      ExposeRow(std::span(light).subspan(row * width, width), exposure, stream.Fork(first + row),
                image.pixels.data() + (first + row) * width * channels);
    }
  });
  return image;
}

}  // namespace mlvi
