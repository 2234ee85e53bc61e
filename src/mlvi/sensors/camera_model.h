// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Camera models: from a point in the camera frame (x right, y down, z forward) to a pixel and back
// to a unit bearing. Fields of view beyond 180 degrees are ordinary: nothing here divides by z
// except the pinhole model.
//
// To add a model:
//   1. Derive from CameraModel in camera_NAME.{h,cc}: formula, valid domain and source in the header's comment. The
//      base class does focal lengths and principal point; a model maps points to the unscaled image plane.
//   2. Add its case to the table of MakeCameraModel in camera_model.cc.
//   3. Add a real calibration of it to camera_test_calibrations.h: the law suite of camera_model_test.cc runs over all
//      of them.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

class CameraModel {
 public:
  static constexpr int kMaxParameters = 12;
  using PointJacobian = Eigen::Matrix<double, 2, 3>;  // d pixel / d point, px/m
  using PixelJacobian = Eigen::Matrix<double, 3, 2>;  // d bearing / d pixel, 1/px
  using ParameterJacobian =
      Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMaxParameters>;

  virtual ~CameraModel() = default;
  CameraModel(const CameraModel&) = delete;
  CameraModel& operator=(const CameraModel&) = delete;

  // The name that MakeCameraModel knows it by.
  virtual std::string_view name() const = 0;
  int width() const { return width_; }
  int height() const { return height_; }
  // fx, fy, cx, cy (px), then the parameters of the model's shape; `parameter_names` has the same
  // order.
  const Eigen::VectorXd& parameters() const { return parameters_; }
  std::vector<std::string> parameter_names() const;
  Eigen::Vector2d principal_point() const { return {parameters_[2], parameters_[3]}; }
  // Angle from the optical axis up to which the projection is one-to-one (rad, below pi): the limit
  // of the valid domain, wherever the image may end.
  double max_angle() const { return max_angle_; }

  // The pixel of a point or bearing (any length > 0) of the camera frame; empty outside of the
  // valid domain. The pixel may lie outside of the image (see InImage). Jacobians are written only
  // for a valid point.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point,
                                         PointJacobian* d_point = nullptr,
                                         ParameterJacobian* d_parameters = nullptr) const;
  // The unit bearing of a pixel, inside the image or not; empty when no bearing of the valid domain
  // projects to it. The Jacobian is tangent to the unit sphere: bearing^T d_pixel = 0. At the limit
  // of a domain where the projection turns over (KB, MEI with xi > 1, double sphere with alpha >
  // 0.5) it grows without bound, as the lens does not tell angles apart there.
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* d_pixel = nullptr) const;

  // Whether the pixel is at least `border` px inside of the image; pixel (0, 0) is the centre of
  // the first pixel.
  bool InImage(const Eigen::Vector2d& pixel, double border = 0.0) const {
    return pixel.x() >= border && pixel.y() >= border && pixel.x() <= width_ - 1.0 - border &&
           pixel.y() <= height_ - 1.0 - border;
  }

 protected:
  // `parameters`: fx, fy, cx, cy, shape.
  CameraModel(int width, int height, const Eigen::VectorXd& parameters)
      : width_(width), height_(height), parameters_(parameters) {}

  void set_max_angle(double angle) { max_angle_ = angle; }
  Eigen::VectorXd shape() const { return parameters_.tail(parameters_.size() - 4); }

 private:
  virtual std::vector<std::string> shape_names() const = 0;
  // The unscaled image plane: pixel = (fx m_x + cx, fy m_y + cy) with m = Flatten(point). False
  // outside of the domain. Jacobians are non-null; `d_shape` has one column per shape parameter.
  virtual bool Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
                       ParameterJacobian* d_shape) const = 0;
  // The inverse: a unit bearing, false when there is none in the domain.
  virtual bool Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const = 0;

  int width_;
  int height_;
  Eigen::VectorXd parameters_;
  double max_angle_ = 0.0;
};

// The one place that lists all models. Values in the order of Kalibr's camchain files:
//   name              intrinsics                     distortion
//   "equidistant"     fx fy cx cy                    k1 k2 k3 k4                 Kannala-Brandt 4, OpenCV fisheye
//   "mei"             xi fx fy cx cy                 k1 k2 p1 p2                 unified omnidirectional (gamma = f)
//   "double_sphere"   xi alpha fx fy cx cy           none
//   "pinhole_radtan"  fx fy cx cy                    k1 k2 p1 p2 [k3]            OpenCV pinhole
// `width`, `height` in px. Errors (kConfiguration) name the model, the field and what was expected.
Expected<std::shared_ptr<const CameraModel>> MakeCameraModel(std::string_view name, int width,
                                                             int height,
                                                             const std::vector<double>& intrinsics,
                                                             const std::vector<double>& distortion);

// The names that MakeCameraModel knows.
std::vector<std::string> CameraModelNames();

}  // namespace mlvi
