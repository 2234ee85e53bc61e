// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/weak_axes.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

using Axes = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;  // up to three, as columns

// The constraints whose surfaces face along one of the axes (columns).
std::vector<Correspondence> Facing(const std::vector<Correspondence>& correspondences,
                                   const Axes& axes, double min_facing) {
  std::vector<Correspondence> facing;
  for (const Correspondence& c : correspondences) {
    bool faces = false;
    for (int i = 0; i < axes.cols(); ++i) faces |= std::abs(axes.col(i).dot(c.normal)) > min_facing;
    if (faces) facing.push_back(c);
  }
  return facing;
}

// The information on a translation along `axis`. When the motion asked for along it leaves larger
// residuals than the constraints claim, their variance is taken to be as much larger (Birge ratio).
double InformationAlong(const PoseNormalEquations& sums, const Eigen::Vector3d& axis,
                        double inflation) {
  const double information = axis.dot(sums.A.topLeftCorner<3, 3>() * axis);
  if (information <= 0.0 || sums.weights <= 1.0) return 0.0;
  const double gradient = inflation * axis.dot(sums.b.head<3>());
  const double unexplained = sums.chi_square - gradient * gradient / information;
  return information / std::max(1.0, unexplained / (sums.weights - 1.0));
}

// Constraints that may tell a weak translation, and the axes that they do tell.
struct Witnesses {
  const std::vector<Correspondence>& constraints;
  int min_count;
  Axes told = Axes(3, 0);
};

// Whether the constraints that face along `axis` tell it well enough by themselves.
bool Tell(const Witnesses& witnesses, const Eigen::Vector3d& axis, const Pose3& T_world_body,
          const RegistrationConfig& config, const DegeneracyConfig& degeneracy) {
  const PoseNormalEquations facing =
      Linearize(Facing(witnesses.constraints, axis, degeneracy.min_facing), T_world_body, config);
  const double least = 1.0 / (degeneracy.max_translation_sigma * degeneracy.max_translation_sigma);
  return facing.inliers >= witnesses.min_count &&
         InformationAlong(facing, axis, config.noise_inflation) >= least;
}

}  // namespace

void LeaveOutFeigned(const std::vector<Correspondence>& correspondences,
                     const std::vector<Correspondence>& marks, const Pose3& T_world_body,
                     const RegistrationConfig& config, const DegeneracyConfig& degeneracy,
                     PoseNormalEquations& sums, DegenerateDirections& directions) {
  if (directions.motions.empty()) return;
  Witnesses surfaces{correspondences, degeneracy.min_facing_count};
  Witnesses marked{marks, degeneracy.min_mark_points};
  const std::vector<Vector6d> weak = directions.motions;
  for (int i = directions.report.translation_directions - 1; i >= 0; --i) {
    const Eigen::Vector3d axis = directions.report.translation_axes.col(i);
    bool told = false;
    for (Witnesses* witnesses : {&surfaces, &marked}) {
      if (!Tell(*witnesses, axis, T_world_body, config, degeneracy)) continue;
      witnesses->told.conservativeResize(3, witnesses->told.cols() + 1);
      witnesses->told.rightCols<1>() = axis;
      told = true;
    }
    if (told) Strike(i, directions);
  }
  const auto facing = [&](const Witnesses& witnesses) {
    if (witnesses.told.cols() == 0) return PoseNormalEquations{};
    return Linearize(Facing(witnesses.constraints, witnesses.told, degeneracy.min_facing),
                     T_world_body, config);
  };
  PoseNormalEquations telling = facing(surfaces);
  sums.A -= telling.A;
  sums.b -= telling.b;
  Deflate(weak, sums.A, sums.b);
  telling += facing(marked);
  Deflate(directions.motions, telling.A, telling.b);
  sums.A += telling.A;
  sums.b += telling.b;
}

}  // namespace mlvi
