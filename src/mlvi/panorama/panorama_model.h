// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// All cameras of a rig as one: the panoramic visual feature model of Multi-LVI-SAM, section III-B.
// Pixels of every camera are lifted to one sphere; what works on features (tracks, budget, RANSAC,
// depth, loops) sees that sphere only.
//
// Frame `pano`: centre S, axes parallel to the body's. Camera i has its centre C_i at
// T_pano_camera(i).translation().
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/geometry/pose3.h"
#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// One pixel of one camera on the sphere.
struct PanoramicObservation {
  int camera = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector3d bearing_camera = Eigen::Vector3d::UnitZ();  // u_c, unit, camera frame
  Eigen::Vector3d center = Eigen::Vector3d::Zero();           // C_i, pano frame, m
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();         // R_i u_c, unit, pano frame
  Eigen::Vector3d point = Eigen::Vector3d::UnitZ();           // u_s, pano frame, |u_s| = r
  // Maps small differences of unit bearings (pano frame) to pixels (px): the local angular
  // resolution of the lens. pixel_per_bearing * bearing = 0.
  Eigen::Matrix<double, 2, 3> pixel_per_bearing = Eigen::Matrix<double, 2, 3>::Zero();
  // How uncertain the pixel is, in units of the usual, by what was seen when it was found.
  double sigma_scale = 1.0;

  // px/rad, the geometric mean over directions.
  double resolution() const {
    return std::sqrt(std::sqrt((pixel_per_bearing * pixel_per_bearing.transpose()).determinant()));
  }
};

// A camera that sees a point or direction.
struct CameraView {
  int camera = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double off_axis = 0.0;  // rad, from the optical axis
};

// Eq. (2): u_s = lambda R_i u_c + t_i with |u_s| = r and lambda > 0, for a unit `bearing` = R_i u_c
// and `center` = t_i inside of the sphere.
Eigen::Vector3d PointOnSphere(const Eigen::Vector3d& center, const Eigen::Vector3d& bearing,
                              double radius);

struct PanoramaOptions {
  // Of the sphere, m; above the offset of every camera. Exact at depth r, for `none` and `plane`
  // only: see compensation.h. The default suits rooms and yards; adapt it to the median depth with
  // set_radius.
  double radius = 10.0;
  double border_px = 2.0;  // pixels nearer to the image border are not used
};

class PanoramaModel {
 public:
  // Masks must have the size of their images (Rig::Validate). Errors (kConfiguration): no cameras,
  // a camera at or outside of the sphere.
  static Expected<PanoramaModel> FromRig(const Rig& rig, const PanoramaOptions& options = {});

  int cameras() const { return static_cast<int>(cameras_.size()); }
  const CameraModel& camera(int i) const { return *cameras_[i].model; }
  const Pose3& T_body_pano() const { return T_body_pano_; }
  const Pose3& T_pano_camera(int i) const { return cameras_[i].T_pano_camera; }
  double radius() const { return radius_; }
  double largest_offset() const;  // m, of camera centres from S
  // New values of what is estimated online. `radius` must exceed the offset of every camera.
  void set_radius(double radius);
  void set_T_body_pano(const Pose3& T_body_pano) { T_body_pano_ = T_body_pano; }
  void set_T_pano_camera(int i, const Pose3& T_pano_camera);

  // Whether pixels there may be used: image, border, valid radius, mask.
  bool Usable(int camera, const Eigen::Vector2d& pixel) const;
  // Empty where the pixel is not usable or has no bearing in the lens model.
  std::optional<PanoramicObservation> Lift(int camera, const Eigen::Vector2d& pixel) const;
  // The usable pixel at which a camera sees a point (m) or a point at infinity, both in pano.
  std::optional<Eigen::Vector2d> ProjectPoint(int camera, const Eigen::Vector3d& p_pano) const;
  std::optional<Eigen::Vector2d> ProjectDirection(int camera, const Eigen::Vector3d& d_pano) const;
  // Every camera that sees it, the one that holds it nearest to its optical axis first.
  std::vector<CameraView> ViewsOfPoint(const Eigen::Vector3d& p_pano) const;
  std::vector<CameraView> ViewsOfDirection(const Eigen::Vector3d& d_pano) const;

 private:
  struct Camera {
    std::shared_ptr<const CameraModel> model;
    Pose3 T_pano_camera;
    Eigen::Matrix3d R_pano_camera = Eigen::Matrix3d::Identity();
    double valid_radius_px = 0.0;       // 0: no limit
    std::shared_ptr<const Image> mask;  // null: none
  };
  PanoramaModel() = default;

  std::optional<Eigen::Vector2d> ProjectBearing(int camera, const Eigen::Vector3d& p_camera) const;
  std::vector<CameraView> Views(const Eigen::Vector3d& p_pano, double weight) const;

  std::vector<Camera> cameras_;
  Pose3 T_body_pano_;
  double radius_ = 0.0;
  double border_px_ = 0.0;
};

}  // namespace mlvi
