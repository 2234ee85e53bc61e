// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/rig.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/visible_share.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

// Collects the first violation, so that a list of checks reads as a list.
class Checks {
 public:
  void Range(const std::string& field, double value, double min, double max, const char* unit) {
    if (std::isfinite(value) && value >= min && value <= max) return;
    Fail(fmt::format("{} = {}: must be in [{}, {}]{}{}", field, value, min, max, *unit ? " " : "",
                     unit));
  }
  void NotEmpty(const std::string& field, const std::string& value) {
    if (value.empty()) Fail(fmt::format("{}: must not be empty", field));
  }
  void Transform(const std::string& field, const Pose3& pose) {
    if (!pose.translation().allFinite() || !pose.rotation().coeffs().allFinite()) {
      Fail(fmt::format("{}: not finite", field));
    } else if (pose.translation().norm() > 100.0) {
      Fail(fmt::format("{}: a lever arm of {} m is no part of a rig (unit: m)", field,
                       pose.translation().norm()));
    }
  }
  void Fail(std::string message) {
    if (result_) result_ = tl::unexpected(Error{kKind, std::move(message)});
  }
  const Expected<void>& result() const { return result_; }

 private:
  Expected<void> result_;
};

void CheckImu(const ImuSpec& imu, Checks& checks) {
  checks.NotEmpty("imu.topic", imu.topic);
  checks.Range("imu.rate_hz", imu.rate_hz, 1.0, 1e5, "Hz");
  checks.Range("imu.noise.accelerometer_density", imu.noise.accelerometer_density, 1e-7, 10.0,
               "m/s^2/sqrt(Hz)");
  checks.Range("imu.noise.gyroscope_density", imu.noise.gyroscope_density, 1e-8, 10.0,
               "rad/s/sqrt(Hz)");
  checks.Range("imu.noise.accelerometer_random_walk", imu.noise.accelerometer_random_walk, 0.0,
               10.0, "m/s^3/sqrt(Hz)");
  checks.Range("imu.noise.gyroscope_random_walk", imu.noise.gyroscope_random_walk, 0.0, 10.0,
               "rad/s^2/sqrt(Hz)");
  checks.Range("imu.initial_accelerometer_bias_sigma", imu.initial_accelerometer_bias_sigma, 0.0,
               100.0, "m/s^2");
  checks.Range("imu.initial_gyroscope_bias_sigma", imu.initial_gyroscope_bias_sigma, 0.0, 10.0,
               "rad/s");
  checks.Range("imu.accelerometer_saturation", imu.accelerometer_saturation, 1.0, 1e5, "m/s^2");
  checks.Range("imu.gyroscope_saturation", imu.gyroscope_saturation, 0.1, 1e4, "rad/s");
}

void CheckLidar(const LidarSpec& lidar, Checks& checks) {
  checks.NotEmpty("lidar.topic", lidar.topic);
  checks.Transform("lidar.T_body_lidar", lidar.T_body_lidar);
  checks.Range("lidar.rings", lidar.rings, 0, 65535, "");
  checks.Range("lidar.rate_hz", lidar.rate_hz, 0.1, 1000.0, "Hz");
  checks.Range("lidar.min_range", lidar.min_range, 0.0, 1e4, "m");
  checks.Range("lidar.max_range", lidar.max_range, 0.0, 1e5, "m");
  if (lidar.max_range <= lidar.min_range) {
    checks.Fail(fmt::format("lidar.max_range = {} m: must be greater than lidar.min_range = {} m",
                            lidar.max_range, lidar.min_range));
  }
  checks.Range("lidar.range_noise", lidar.range_noise, 0.0, 10.0, "m");
  checks.Range("lidar.beam_noise", lidar.beam_noise, 0.0, 0.1, "rad");
}

// A camera of which nothing is left, almost always by a mask of the other convention.
void CheckVisible(const CameraSpec& camera, const std::string& field, Checks& checks) {
  if (VisibleShare(camera) > 0.0) return;
  if (!camera.mask) {
    checks.Fail(fmt::format(
        "{}.valid_radius_px = {}: leaves nothing visible of the {} x {} px of {}", field,
        camera.valid_radius_px, camera.model->width(), camera.model->height(), camera.name));
    return;
  }
  const auto& pixels = camera.mask->pixels;
  const auto used = pixels.size() - static_cast<std::size_t>(
                                        std::count(pixels.begin(), pixels.end(), std::uint8_t{0}));
  checks.Fail(fmt::format(
      "{}.mask_file: the mask of {} leaves nothing visible: {} of its {} x {} px are not 0{}; zero "
      "is what is not used: invert the mask if it has the other polarity",
      field, camera.name, used, camera.mask->width, camera.mask->height,
      used > 0 ? fmt::format(", none of them within valid_radius_px = {}", camera.valid_radius_px)
               : ""));
}

void CheckCamera(const CameraSpec& camera, const std::string& field, Checks& checks) {
  checks.NotEmpty(field + ".name", camera.name);
  checks.NotEmpty(field + ".topic", camera.topic);
  if (!camera.model) checks.Fail(fmt::format("{}.model: missing", field));
  checks.Transform(field + ".T_body_camera", camera.T_body_camera);
  checks.Range(field + ".rate_hz", camera.rate_hz, 0.0, 1e5, "Hz");
  checks.Range(field + ".valid_radius_px", camera.valid_radius_px, 0.0, 1e5, "px");
  if (camera.mask && camera.model &&
      (camera.mask->width != camera.model->width() ||
       camera.mask->height != camera.model->height())) {
    checks.Fail(fmt::format(
        "{}.mask_file: the mask of {} is {} x {} px, its images are {} x {}: scale the mask", field,
        camera.name, camera.mask->width, camera.mask->height, camera.model->width(),
        camera.model->height()));
  } else if (camera.model) {
    CheckVisible(camera, field, checks);
  }
  checks.Range(field + ".time_offset_s", camera.time_offset.seconds(), -10.0, 10.0, "s");
}

void CheckUnique(const std::vector<CameraSpec>& cameras, Checks& checks) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (cameras[i].name == cameras[j].name) {
        checks.Fail(fmt::format("cameras[{}].name and cameras[{}].name are both '{}'", j, i,
                                cameras[i].name));
      }
      if (cameras[i].topic == cameras[j].topic) {
        checks.Fail(fmt::format("cameras '{}' and '{}' have the same topic '{}'", cameras[j].name,
                                cameras[i].name, cameras[i].topic));
      }
    }
  }
}

}  // namespace

std::vector<std::string> Rig::CameraNames() const {
  std::vector<std::string> names;
  for (const CameraSpec& camera : cameras) names.push_back(camera.name);
  return names;
}

Expected<void> Rig::Validate() const {
  Checks checks;
  checks.NotEmpty("name", name);
  checks.Range("gravity", gravity, 9.7, 9.9, "m/s^2 (the value on earth; write it positive)");
  CheckImu(imu, checks);
  checks.Range("imu.time_offset_s", imu.time_offset.seconds(), -10.0, 10.0, "s");
  if (lidar) {
    CheckLidar(*lidar, checks);
    checks.Range("lidar.time_offset_s", lidar->time_offset.seconds(), -10.0, 10.0, "s");
    if (lidar->topic == imu.topic) checks.Fail("lidar.topic and imu.topic are the same");
  }
  for (const CameraSpec& camera : cameras) {
    CheckCamera(camera, fmt::format("cameras[{}]", &camera - cameras.data()), checks);
  }
  CheckUnique(cameras, checks);
  if (p_body_pano) checks.Transform("p_body_pano", Pose3::FromTranslation(*p_body_pano));
  checks.Transform("T_body_groundtruth", T_body_groundtruth);
  return checks.result();
}

Expected<Eigen::Quaterniond> RotationFromMatrix(const Eigen::Matrix3d& matrix,
                                                const std::string& field) {
  // Calibrations printed with four digits are off by up to a few 1e-4 per element.
  constexpr double kTolerance = 1e-3;
  if (!matrix.allFinite()) return MakeError(kKind, "{}: not finite", field);
  const double deviation =
      (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const double determinant = matrix.determinant();
  if (determinant < 0.0) {
    return MakeError(kKind,
                     "{}: determinant {:.4f}, a mirror image, no rotation: one axis has the wrong "
                     "sign or two are "
                     "swapped (matrices are written row by row)",
                     field, determinant);
  }
  if (deviation > kTolerance) {
    return MakeError(
        kKind,
        "{}: not a rotation: R^T R differs from identity by {:.2g} (allowed {:.2g}), determinant "
        "{:.4f}; "
        "check the digits and that nothing else (a scale, a translation) is among the 9 numbers",
        field, deviation, kTolerance, determinant);
  }
  // The nearest rotation in the Frobenius norm.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()))
      .normalized();
}

}  // namespace mlvi
