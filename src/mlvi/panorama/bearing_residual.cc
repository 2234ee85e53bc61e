// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/bearing_residual.h"

namespace mlvi {
namespace {

constexpr double kAtOrigin = 1e-6;

// C u: the exact ray. C + R dp and R Exp(dtheta) u.
void SetCameraRay(const PanoramicObservation& observation, const Pose3& T_pano_camera,
                  PanoramicRay& ray) {
  const Eigen::Matrix3d R = T_pano_camera.R();
  ray.origin = T_pano_camera.translation();
  ray.direction = R * observation.bearing_camera;
  ray.weight = observation.pixel_per_bearing;
  ray.d_origin.leftCols<3>() = R;
  ray.d_direction.rightCols<3>() = -R * Hat(observation.bearing_camera);
}

// S u_s: from |u_s| = r follows u_s . du_s = 0, and with it the derivative of lambda in Eq. (2).
void SetSphereRay(const PanoramicObservation& observation, const Pose3& T_pano_camera,
                  double radius, PanoramicRay& ray) {
  PanoramicRay camera;
  SetCameraRay(observation, T_pano_camera, camera);
  const Eigen::Vector3d u = PointOnSphere(camera.origin, camera.direction, radius);
  const double lambda = (u - camera.origin).dot(camera.direction);
  ray.direction = u / radius;
  const Eigen::Matrix<double, 3, 6> moved = lambda * camera.d_direction + camera.d_origin;
  ray.d_direction =
      (moved - camera.direction * (u.transpose() * moved) / u.dot(camera.direction)) / radius;
  // The lens resolves at u_s what it resolves at the bearing: turned by the shortest way, by the
  // nominal values.
  ray.weight = observation.pixel_per_bearing *
               Eigen::Quaterniond::FromTwoVectors(observation.point, observation.bearing).matrix();
}

}  // namespace

PanoramicRay MakePanoramicRay(const PanoramicObservation& observation, const Pose3& T_pano_camera,
                              double radius, Compensation mode, RayRole role) {
  PanoramicRay ray;
  if (mode == Compensation::kRay || (mode == Compensation::kPlane && role == RayRole::kAnchor)) {
    SetCameraRay(observation, T_pano_camera, ray);
  } else {
    SetSphereRay(observation, T_pano_camera, radius, ray);
  }
  return ray;
}

std::optional<Eigen::Vector2d> BearingResidual(const PanoramicRay& anchor, double inverse_depth,
                                               const PanoramicRay& target, const BearingGeometry& g,
                                               BearingJacobians* jacobians) {
  const double rho = inverse_depth;
  const Eigen::Matrix3d R_body_pano = g.T_body_pano.R();
  const Eigen::Matrix3d R_target_anchor =
      (g.T_world_target.rotation().conjugate() * g.T_world_anchor.rotation()).toRotationMatrix();
  const Eigen::Vector3d t_target_anchor =
      g.T_world_target.rotation().conjugate() *
      (g.T_world_anchor.translation() - g.T_world_target.translation());
  // All points times rho: anchor pano, anchor body, target body, target pano.
  const Eigen::Vector3d pano_a = rho * anchor.origin + anchor.direction;
  const Eigen::Vector3d body_a = R_body_pano * pano_a + rho * g.T_body_pano.translation();
  const Eigen::Vector3d body_t = R_target_anchor * body_a + rho * t_target_anchor;
  const Eigen::Vector3d pano_t =
      R_body_pano.transpose() * (body_t - rho * g.T_body_pano.translation());
  const Eigen::Vector3d v = pano_t - rho * target.origin;
  const double length = v.norm();
  if (!(length > kAtOrigin)) return std::nullopt;
  const Eigen::Vector3d u = v / length;
  if (jacobians != nullptr) {
    const Eigen::Matrix<double, 2, 3> d_v =
        (target.weight - (target.weight * u) * u.transpose()) / length;
    const Eigen::Matrix<double, 2, 3> d_body_t = d_v * R_body_pano.transpose();
    const Eigen::Matrix<double, 2, 3> d_body_a = d_body_t * R_target_anchor;
    const Eigen::Matrix<double, 2, 3> d_pano_a = d_body_a * R_body_pano;
    jacobians->anchor << rho * d_body_a, -d_body_a * Hat(body_a);
    jacobians->target << -rho * d_body_t, d_body_t * Hat(body_t);
    jacobians->body_pano << rho * (d_pano_a - d_v), d_v * Hat(pano_t) - d_pano_a * Hat(pano_a);
    jacobians->anchor_camera = d_pano_a * (rho * anchor.d_origin + anchor.d_direction);
    jacobians->target_camera = -rho * d_v * target.d_origin - target.weight * target.d_direction;
    const Eigen::Vector3d origin_body =
        R_target_anchor * (g.T_body_pano * anchor.origin) + t_target_anchor;
    jacobians->inverse_depth = d_v * (g.T_body_pano.inverse() * origin_body - target.origin);
  }
  return Eigen::Vector2d(target.weight * (u - target.direction));
}

}  // namespace mlvi
