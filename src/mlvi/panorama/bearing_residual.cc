// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/bearing_residual.h"

namespace mlvi {
namespace {

constexpr double kAtOrigin = 1e-6;
// m. Rays of a camera that pass S nearer than this span no plane with it, and need none.
constexpr double kThroughCenter = 1e-3;

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

// The plane through S, C and u holds the point wherever it is along the ray: what is compared is
// the component normal to it alone, Eq. (8). The normal is that of the values it was lifted with.
void KeepNormalToPlane(const PanoramicObservation& observation, PanoramicRay& ray) {
  const Eigen::Vector3d normal = observation.center.cross(observation.bearing);
  if (normal.norm() < kThroughCenter) return;
  const Eigen::Vector3d n = normal.normalized();
  ray.weight = (ray.weight * n * n.transpose()).eval();
  ray.freedom = 1;
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

// A feature at inverse depth rho on its way from the anchor's pano frame to the target's; all
// points times rho.
struct Chain {
  Chain(const PanoramicRay& anchor, double rho, const BearingGeometry& g)
      : R_body_pano(g.T_body_pano.R()),
        R_target_anchor((g.T_world_target.rotation().conjugate() * g.T_world_anchor.rotation())
                            .toRotationMatrix()),
        t_target_anchor(g.T_world_target.rotation().conjugate() *
                        (g.T_world_anchor.translation() - g.T_world_target.translation())),
        pano_anchor(rho * anchor.origin + anchor.direction),
        body_anchor(R_body_pano * pano_anchor + rho * g.T_body_pano.translation()),
        body_target(R_target_anchor * body_anchor + rho * t_target_anchor),
        pano_target(R_body_pano.transpose() * (body_target - rho * g.T_body_pano.translation())) {}

  Eigen::Matrix3d R_body_pano, R_target_anchor;
  Eigen::Vector3d t_target_anchor;
  Eigen::Vector3d pano_anchor, body_anchor, body_target, pano_target;
};

// `d_v`: derivative of the residual by the point in the target's pano frame.
BearingJacobians Differentiate(const Chain& c, const PanoramicRay& anchor, double rho,
                               const PanoramicRay& target, const BearingGeometry& g,
                               const Eigen::Matrix<double, 2, 3>& d_v) {
  const Eigen::Matrix<double, 2, 3> d_body_target = d_v * c.R_body_pano.transpose();
  const Eigen::Matrix<double, 2, 3> d_body_anchor = d_body_target * c.R_target_anchor;
  const Eigen::Matrix<double, 2, 3> d_pano_anchor = d_body_anchor * c.R_body_pano;
  BearingJacobians j;
  j.anchor << rho * d_body_anchor, -d_body_anchor * Hat(c.body_anchor);
  j.target << -rho * d_body_target, d_body_target * Hat(c.body_target);
  j.body_pano << rho * (d_pano_anchor - d_v),
      d_v * Hat(c.pano_target) - d_pano_anchor * Hat(c.pano_anchor);
  j.anchor_camera = d_pano_anchor * (rho * anchor.d_origin + anchor.d_direction);
  j.target_camera = -rho * d_v * target.d_origin - target.weight * target.d_direction;
  const Eigen::Vector3d origin =
      c.R_target_anchor * (g.T_body_pano * anchor.origin) + c.t_target_anchor;
  j.inverse_depth = d_v * (g.T_body_pano.inverse() * origin - target.origin);
  return j;
}

}  // namespace

PanoramicRay MakePanoramicRay(const PanoramicObservation& observation, const Pose3& T_pano_camera,
                              double radius, Compensation mode, RayRole role) {
  PanoramicRay ray;
  if (mode == Compensation::kNone) {
    SetSphereRay(observation, T_pano_camera, radius, ray);
    return ray;
  }
  SetCameraRay(observation, T_pano_camera, ray);
  if (mode == Compensation::kPlane && role == RayRole::kTarget) KeepNormalToPlane(observation, ray);
  return ray;
}

std::optional<Eigen::Vector2d> BearingResidual(const PanoramicRay& anchor, double inverse_depth,
                                               const PanoramicRay& target,
                                               const BearingGeometry& geometry,
                                               BearingJacobians* jacobians) {
  const Chain chain(anchor, inverse_depth, geometry);
  const Eigen::Vector3d v = chain.pano_target - inverse_depth * target.origin;
  const double length = v.norm();
  if (!(length > kAtOrigin)) return std::nullopt;
  const Eigen::Vector3d u = v / length;
  if (jacobians != nullptr) {
    const Eigen::Matrix<double, 2, 3> d_v =
        (target.weight - (target.weight * u) * u.transpose()) / length;
    *jacobians = Differentiate(chain, anchor, inverse_depth, target, geometry, d_v);
  }
  return Eigen::Vector2d(target.weight * (u - target.direction));
}

}  // namespace mlvi
