// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "depth_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "mlvi/io/image_encoder.h"
#include "mlvi/vio/depth_picture.h"
#include "range_colours.h"

using namespace mlvi;

namespace {

PanoramaModel MakeModel(const Rig& rig, double radius) {
  auto model = PanoramaModel::FromRig(rig, {.radius = radius});
  MLVI_CHECK(model.has_value(), "{}", model.error().message);
  return std::move(*model);
}

constexpr double kLongestStep = 0.5;  // s between poses: a longer one is no motion to interpolate

// Between the poses before and after; empty when it is not between two.
std::optional<Pose3> PoseAt(const Trajectory& trajectory, Time stamp) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                                      [](const StampedPose& p, Time t) { return p.stamp < t; });
  if (after == trajectory.begin() || after == trajectory.end()) return std::nullopt;
  const auto before = after - 1;
  const double step = (after->stamp - before->stamp).seconds();
  if (step > kLongestStep) return std::nullopt;
  return Interpolate(before->pose, after->pose, (stamp - before->stamp).seconds() / step);
}

// The nearest depth of a pixel and of those around it: single points are too small to be seen.
float NearestAround(const DepthPicture& picture, int x, int y) {
  float nearest = std::numeric_limits<float>::infinity();
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, picture.height - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, picture.width - 1); ++u) {
      const float depth = picture.At(u, v);
      if (depth > 0.0F) nearest = std::min(nearest, depth);
    }
  }
  return nearest;
}

// World points of the keyframes since `from`, and of the newest one in any case.
std::vector<Eigen::Vector3d> PointsSince(Time from, const Slam& slam) {
  std::vector<Eigen::Vector3d> points;
  const std::vector<Keyframe>& keyframes = slam.graph().keyframes();
  for (auto keyframe = keyframes.rbegin(); keyframe != keyframes.rend(); ++keyframe) {
    if (keyframe->state.stamp < from && keyframe != keyframes.rbegin()) break;
    if (!keyframe->points) continue;
    const Pose3 T_world_body = slam.T_world_odometry() * keyframe->state.T_world_body;
    for (const Eigen::Vector3f& p : *keyframe->points)
      points.push_back(T_world_body * p.cast<double>());
  }
  return points;
}

}  // namespace

DepthPictures::DepthPictures(std::filesystem::path folder, double interval,
                             const SlamConfig& config, const Rig& rig)
    : folder_(std::move(folder)),
      interval_(Duration::FromSeconds(interval)),
      span_(config.visual.vio.depth.span),
      names_(rig.CameraNames()),
      model_(MakeModel(rig, config.visual.vio.radius)),
      last_taken_(names_.size()),
      waiting_(names_.size()) {}

void DepthPictures::Take(const Image& image) {
  const auto camera = static_cast<std::size_t>(image.camera);
  if (last_taken_[camera].valid() && image.stamp - last_taken_[camera] < interval_) return;
  last_taken_[camera] = image.stamp;
  waiting_[camera] = image;
}

void DepthPictures::Write(const Slam& slam) {
  if (slam.odometry().empty()) return;
  const VioCalibration& calibration = slam.visual()->calibration();
  for (std::size_t camera = 0; camera < waiting_.size(); ++camera) {
    model_.set_T_pano_camera(static_cast<int>(camera), calibration.T_pano_camera[camera]);
  }
  for (std::size_t camera = 0; camera < waiting_.size(); ++camera) {
    if (!waiting_[camera]) continue;
    const Image& image = *waiting_[camera];
    const Time taken = image.stamp + Duration::FromSeconds(calibration.time_offsets[camera]);
    if (taken > slam.odometry().back().stamp) continue;
    if (const auto T_world_body = PoseAt(slam.odometry(), taken)) {
      const std::string name = fmt::format("{}_{}.png", names_[camera], ToString(image.stamp));
      const auto saved = WriteImage(Draw(image, *T_world_body, slam), (folder_ / name).string());
      if (saved) ++written_;
      if (!saved && !error_) error_ = saved.error();
    }
    waiting_[camera].reset();
  }
}

Image DepthPictures::Draw(const Image& image, const Pose3& T_world_body, const Slam& slam) const {
  const Pose3 T_pano_world = (T_world_body * model_.T_body_pano()).inverse();
  std::vector<Eigen::Vector3d> points =
      PointsSince(image.stamp - Duration::FromSeconds(span_), slam);
  for (Eigen::Vector3d& point : points) point = T_pano_world * point;
  const DepthPicture depths =
      DrawDepthPictures(model_, points)[static_cast<std::size_t>(image.camera)];
  Image drawn = Coloured(image);
  for (int y = 0; y < depths.height; ++y) {
    for (int x = 0; x < depths.width; ++x) {
      const float depth = NearestAround(depths, x, y);
      if (std::isfinite(depth)) Paint(drawn, x, y, ColourOfRange(depth));
    }
  }
  return drawn;
}
