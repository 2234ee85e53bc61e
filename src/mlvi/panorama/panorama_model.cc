// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/panorama_model.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

Eigen::Vector3d MeanCameraCenter(const Rig& rig) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const CameraSpec& camera : rig.cameras) sum += camera.T_body_camera.translation();
  return sum / static_cast<double>(rig.cameras.size());
}

}  // namespace

Eigen::Vector3d PointOnSphere(const Eigen::Vector3d& center, const Eigen::Vector3d& bearing,
                              double radius) {
  // lambda^2 + 2 lambda (b . t) + |t|^2 - r^2 = 0; the product of the roots is negative, so one is
  // positive.
  const double half = bearing.dot(center);
  const double missing = radius * radius - center.squaredNorm();
  const double root = std::sqrt(half * half + missing);
  const double lambda = half > 0.0 ? missing / (half + root) : root - half;
  return lambda * bearing + center;
}

Expected<PanoramaModel> PanoramaModel::FromRig(const Rig& rig, const PanoramaOptions& options) {
  if (rig.cameras.empty()) {
    return MakeError(kKind, "rig '{}' has no cameras: a panorama needs one", rig.name);
  }
  PanoramaModel model;
  model.border_px_ = options.border_px;
  model.T_body_pano_ = Pose3::FromTranslation(rig.p_body_pano.value_or(MeanCameraCenter(rig)));
  for (const CameraSpec& spec : rig.cameras) {
    Camera camera;
    camera.model = spec.model;
    camera.T_pano_camera = model.T_body_pano_.inverse() * spec.T_body_camera;
    camera.R_pano_camera = camera.T_pano_camera.R();
    camera.valid_radius_px = spec.valid_radius_px;
    camera.mask = spec.mask;
    MLVI_CHECK(!spec.mask || (spec.mask->width == spec.model->width() &&
                              spec.mask->height == spec.model->height()),
               "mask of {}: {} x {} px", spec.name, spec.mask->width, spec.mask->height);
    model.cameras_.push_back(std::move(camera));
  }
  if (!(options.radius > model.largest_offset())) {
    return MakeError(kKind,
                     "panorama radius {} m, but a camera of rig '{}' is {:.3f} m from the centre: "
                     "enlarge the radius or move p_body_pano",
                     options.radius, rig.name, model.largest_offset());
  }
  model.radius_ = options.radius;
  return model;
}

double PanoramaModel::largest_offset() const {
  double largest = 0.0;
  for (const Camera& camera : cameras_) {
    largest = std::max(largest, camera.T_pano_camera.translation().norm());
  }
  return largest;
}

void PanoramaModel::set_radius(double radius) {
  MLVI_CHECK(radius > largest_offset(), "radius {} m, largest offset {} m", radius,
             largest_offset());
  radius_ = radius;
}

void PanoramaModel::set_T_pano_camera(int i, const Pose3& T_pano_camera) {
  const double offset = T_pano_camera.translation().norm();
  MLVI_CHECK(offset < radius_, "camera {} at {} m from the centre of a sphere of {} m", i, offset,
             radius_);
  cameras_[i].T_pano_camera = T_pano_camera;
  cameras_[i].R_pano_camera = T_pano_camera.R();
}

bool PanoramaModel::Usable(int i, const Eigen::Vector2d& pixel) const {
  const Camera& camera = cameras_[i];
  if (!camera.model->InImage(pixel, border_px_)) return false;
  if (camera.valid_radius_px > 0.0 &&
      (pixel - camera.model->principal_point()).norm() > camera.valid_radius_px) {
    return false;
  }
  if (!camera.mask) return true;
  const auto column = std::lround(pixel.x()), row = std::lround(pixel.y());
  return camera.mask->pixels[static_cast<std::size_t>(row * camera.mask->width + column)] != 0;
}

std::optional<PanoramicObservation> PanoramaModel::Lift(int i, const Eigen::Vector2d& pixel) const {
  if (!Usable(i, pixel)) return std::nullopt;
  const Camera& camera = cameras_[i];
  const auto bearing = camera.model->Unproject(pixel);
  if (!bearing) return std::nullopt;
  CameraModel::PointJacobian d_bearing;
  if (!camera.model->Project(*bearing, &d_bearing)) return std::nullopt;
  PanoramicObservation observation;
  observation.camera = i;
  observation.pixel = pixel;
  observation.bearing_camera = *bearing;
  observation.center = camera.T_pano_camera.translation();
  observation.bearing = camera.R_pano_camera * *bearing;
  observation.point = PointOnSphere(observation.center, observation.bearing, radius_);
  observation.pixel_per_bearing = d_bearing * camera.R_pano_camera.transpose();
  return observation;
}

std::optional<Eigen::Vector2d> PanoramaModel::ProjectBearing(
    int i, const Eigen::Vector3d& p_camera) const {
  const auto pixel = cameras_[i].model->Project(p_camera);
  if (!pixel || !Usable(i, *pixel)) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector2d> PanoramaModel::ProjectPoint(int i,
                                                           const Eigen::Vector3d& p_pano) const {
  const Camera& camera = cameras_[i];
  return ProjectBearing(
      i, camera.R_pano_camera.transpose() * (p_pano - camera.T_pano_camera.translation()));
}

std::optional<Eigen::Vector2d> PanoramaModel::ProjectDirection(
    int i, const Eigen::Vector3d& d_pano) const {
  return ProjectBearing(i, cameras_[i].R_pano_camera.transpose() * d_pano);
}

std::vector<CameraView> PanoramaModel::Views(const Eigen::Vector3d& p_pano, double weight) const {
  std::vector<CameraView> views;
  for (int i = 0; i < cameras(); ++i) {
    const Camera& camera = cameras_[i];
    const Eigen::Vector3d p_camera =
        camera.R_pano_camera.transpose() * (p_pano - weight * camera.T_pano_camera.translation());
    const auto pixel = ProjectBearing(i, p_camera);
    if (!pixel) continue;
    views.push_back({i, *pixel, std::atan2(p_camera.head<2>().norm(), p_camera.z())});
  }
  std::stable_sort(views.begin(), views.end(), [](const CameraView& a, const CameraView& b) {
    return a.off_axis < b.off_axis;
  });
  return views;
}

std::vector<CameraView> PanoramaModel::ViewsOfPoint(const Eigen::Vector3d& p_pano) const {
  return Views(p_pano, 1.0);
}

std::vector<CameraView> PanoramaModel::ViewsOfDirection(const Eigen::Vector3d& d_pano) const {
  return Views(d_pano, 0.0);
}

}  // namespace mlvi
