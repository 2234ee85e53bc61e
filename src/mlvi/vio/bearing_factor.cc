// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/bearing_factor.h"

#include "mlvi/factors/pose_block.h"

namespace mlvi {
namespace {

using Block = BearingJacobians::Block;

// The parameters in the order of the class comment; absent ones repeat what they coincide with.
struct Parameters {
  const double *anchor_pose, *target_pose, *body_pano, *anchor_camera, *target_camera;
  double inverse_depth, anchor_time, target_time;  // offsets
};

Parameters Unpack(const double* const* p, bool same_frame, bool same_camera) {
  static constexpr double kIdentity[kPoseBlockSize] = {0, 0, 0, 0, 0, 0, 1};
  Parameters result{};
  result.anchor_pose = same_frame ? kIdentity : *p++;
  result.target_pose = same_frame ? kIdentity : *p++;
  result.body_pano = *p++;
  result.anchor_camera = *p++;
  result.target_camera = same_camera ? result.anchor_camera : *p++;
  result.inverse_depth = **p++;
  result.anchor_time = **p++;
  result.target_time = same_camera ? result.anchor_time : **p;
  return result;
}

// Writes local Jacobians one after the other into the blocks that are asked for.
class JacobianWriter {
 public:
  JacobianWriter(double** blocks, double scale) : next_(blocks), scale_(scale) {}
  void Pose(const Block& local, const double* pose) {
    if (double* block = *next_++) StorePoseJacobian<2>(scale_ * local, pose, block);
  }
  void Scalar(const Eigen::Vector2d& local) {
    if (double* block = *next_++) Eigen::Map<Eigen::Vector2d>{block} = scale_ * local;
  }

 private:
  double** next_;
  double scale_;
};

}  // namespace

BearingFactor::BearingFactor(const BearingPair& pair) : pair_(pair) {
  set_num_residuals(2);
  auto& sizes = *mutable_parameter_block_sizes();
  sizes.assign((pair.same_frame ? 0U : 2U) + (same_camera() ? 2U : 3U), kPoseBlockSize);
  sizes.insert(sizes.end(), same_camera() ? 2U : 3U, 1);
}

bool BearingFactor::Evaluate(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const Parameters p = Unpack(parameters, pair_.same_frame, same_camera());
  const ImagePlace anchor(LoadPose(p.anchor_pose), pair_.anchor_image, p.anchor_time);
  const ImagePlace target(LoadPose(p.target_pose), pair_.target_image, p.target_time);
  const PanoramicRay anchor_ray = MakePanoramicRay(pair_.anchor, LoadPose(p.anchor_camera),
                                                   pair_.radius, pair_.mode, RayRole::kAnchor);
  const PanoramicRay target_ray = MakePanoramicRay(pair_.target, LoadPose(p.target_camera),
                                                   pair_.radius, pair_.mode, RayRole::kTarget);
  const BearingGeometry geometry{anchor.T_world_image, target.T_world_image, LoadPose(p.body_pano)};
  BearingJacobians j;
  const auto residual = BearingResidual(anchor_ray, p.inverse_depth, target_ray, geometry, &j);
  if (!residual) return false;
  const double scale = 1.0 / pair_.pixel_sigma;
  Eigen::Map<Eigen::Vector2d>{residuals} = scale * *residual;
  if (jacobians == nullptr) return true;
  JacobianWriter writer(jacobians, scale);
  if (!pair_.same_frame) {
    writer.Pose(j.anchor * anchor.by_pose, p.anchor_pose);
    writer.Pose(j.target * target.by_pose, p.target_pose);
  }
  writer.Pose(j.body_pano, p.body_pano);
  if (same_camera()) {
    writer.Pose(j.anchor_camera + j.target_camera, p.anchor_camera);
  } else {
    writer.Pose(j.anchor_camera, p.anchor_camera);
    writer.Pose(j.target_camera, p.target_camera);
  }
  writer.Scalar(j.inverse_depth);
  const Eigen::Vector2d by_anchor_time = j.anchor * anchor.by_time_offset;
  const Eigen::Vector2d by_target_time = j.target * target.by_time_offset;
  if (same_camera()) {
    writer.Scalar(by_anchor_time + by_target_time);
  } else {
    writer.Scalar(by_anchor_time);
    writer.Scalar(by_target_time);
  }
  return true;
}

}  // namespace mlvi
