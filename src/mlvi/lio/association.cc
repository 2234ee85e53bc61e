// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/association.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/lio/local_fit.h"

namespace mlvi {
namespace {

constexpr std::size_t kGrain = 256;
constexpr double kGateSigmas = 4.0;

// What all points of one association share.
struct Context {
  const Viewpoint& view;
  const RegistrationConfig& config;
  Eigen::Matrix3d R;
  double position_variance;  // m^2, of the pose, all three directions
  double rotation_variance;  // rad^2
};

// Variance of a measured point along `normal`: range noise along the beam, beam noise across it,
// map noise of the fit at the place of the point (constant part and tilt).
double Variance(const Context& context, const Eigen::Vector3d& beam_world, double range,
                const Eigen::Vector3d& normal, double fit_variance) {
  const double cosine = beam_world.dot(normal);
  const double along = context.view.range_noise * cosine;
  const double across = context.view.beam_noise * range;
  return along * along + across * across * (1.0 - cosine * cosine) + fit_variance;
}

// Half-axes of the uncertainty of direction `axis` of a fit towards its direction `towards`.
Eigen::Vector3d Tilt(const LocalFit& fit, int towards) {
  return fit.axes.col(towards) *
         std::sqrt(fit.point_variance / (fit.count * fit.variances[towards]));
}

// Adds the constraint along `normal`, unless its residual is an outlier even under the uncertainty
// of the pose.
void Add(const Context& context, const Eigen::Vector3d& point, const LocalFit& fit,
         const Eigen::Vector3d& normal, double fit_variance, std::vector<Correspondence>& out) {
  const Eigen::Vector3d offset = point - context.view.p_body_lidar;
  const double range = std::max(offset.norm(), 1e-3);
  Correspondence c{.point = point, .anchor = fit.centroid, .normal = normal};
  c.variance = Variance(context, context.R * (offset / range), range, normal, fit_variance);
  Vector6d h;
  h << normal, point.cross(context.R.transpose() * normal);
  c.gate = h.dot(context.view.pose_covariance * h);
  const double residual =
      normal.dot(context.R * point + context.view.T_world_body.translation() - fit.centroid);
  const double limit = kGateSigmas * context.config.robust_width;
  if (!(residual * residual <= limit * limit * (c.variance + c.gate))) return;
  out.push_back(c);
}

void AddPlane(const Context& context, const Eigen::Vector3f& body, const Neighbors& neighbors,
              std::vector<Correspondence>& out) {
  const auto fit =
      FitPlane(neighbors, context.config.max_plane_thickness, context.config.min_map_noise);
  if (!fit) return;
  const Eigen::Vector3d tilt_a = Tilt(*fit, 1), tilt_b = Tilt(*fit, 2);
  const double max_sigma = context.config.max_normal_sigma;
  if (!(tilt_a.squaredNorm() <= max_sigma * max_sigma)) return;  // spread 1 is the smaller one
  const Eigen::Vector3d point = body.cast<double>();
  const Eigen::Vector3d d =
      context.R * point + context.view.T_world_body.translation() - fit->centroid;
  const Eigen::Vector3d local = fit->axes.transpose() * d;
  const double leverage =
      1.0 + local[1] * local[1] / fit->variances[1] + local[2] * local[2] / fit->variances[2];
  const std::size_t before = out.size();
  Add(context, point, *fit, fit->axes.col(0), fit->point_variance * leverage / fit->count, out);
  if (out.size() == before) return;
  out.back().tilt_a = tilt_a;
  out.back().tilt_b = tilt_b;
}

void AddLine(const Context& context, const Eigen::Vector3f& body, const Neighbors& neighbors,
             std::vector<Correspondence>& out) {
  const auto fit =
      FitLine(neighbors, context.config.max_plane_thickness, context.config.min_map_noise);
  if (!fit) return;
  const Eigen::Vector3d point = body.cast<double>();
  const Eigen::Vector3d d =
      context.R * point + context.view.T_world_body.translation() - fit->centroid;
  const double along = fit->axes.col(2).dot(d);
  const double leverage = 1.0 + along * along / fit->variances[2];
  for (int axis = 0; axis < 2; ++axis) {
    const std::size_t before = out.size();
    Add(context, point, *fit, fit->axes.col(axis), fit->point_variance * leverage / fit->count,
        out);
    if (out.size() > before) out.back().tilt_a = Tilt(*fit, 2);
  }
}

// Neighbours may be as far away as the pose is uncertain at the place of the point.
float SearchDistance(const Context& context, const Eigen::Vector3f& point) {
  const double variance =
      context.position_variance + point.squaredNorm() * context.rotation_variance;
  return static_cast<float>(
      std::max(context.config.max_neighbor_distance,
               std::min(3.0 * std::sqrt(variance), context.config.max_search_distance)));
}

template <typename AddOne>
void AssociateCloud(const Context& context, const PointCloud& cloud, const std::vector<float>& lags,
                    const VoxelMap& map, const AddOne& add, std::vector<Correspondence>& out) {
  MLVI_CHECK(lags.size() == cloud.size(), "{} lags of {} points", lags.size(), cloud.size());
  std::vector<std::vector<Correspondence>> parts((cloud.size() + kGrain - 1) / kGrain);
  ParallelForChunks(cloud.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<Correspondence>& part = parts[begin / kGrain];
    part.reserve(2 * (end - begin));
    Neighbors neighbors;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d world =
          context.R * cloud[i].cast<double>() + context.view.T_world_body.translation();
      map.KNearest(world.cast<float>(), context.config.neighbors, SearchDistance(context, cloud[i]),
                   neighbors);
      if (neighbors.count != context.config.neighbors) continue;
      const std::size_t before = part.size();
      add(context, cloud[i], neighbors, part);
      for (std::size_t k = before; k < part.size(); ++k) part[k].lag = lags[i];
    }
  });
  for (const auto& part : parts) out.insert(out.end(), part.begin(), part.end());
}

// Marks are as wide as the noise of their points.
constexpr double kMarkSpread = 2.0;  // sigmas of the range

}  // namespace

std::vector<Correspondence> Associate(const SweepFeatures& features, const LocalMap& map,
                                      const Viewpoint& view, const RegistrationConfig& config) {
  const Context context{
      .view = view,
      .config = config,
      .R = view.T_world_body.R(),
      .position_variance = view.pose_covariance.topLeftCorner<3, 3>().trace(),
      .rotation_variance = view.pose_covariance.bottomRightCorner<3, 3>().trace()};
  std::vector<Correspondence> result;
  result.reserve(features.planes.size() + 2 * features.edges.size());
  AssociateCloud(context, features.planes, features.plane_lags, map.planes(), AddPlane, result);
  AssociateCloud(context, features.edges, features.edge_lags, map.edges(), AddLine, result);
  return result;
}

std::vector<Correspondence> AssociateMarks(const SweepFeatures& features, const LocalMap& map,
                                           const Viewpoint& view, const Eigen::Vector3d& axis,
                                           const RegistrationConfig& config) {
  const Eigen::Vector3d axis_body = view.T_world_body.rotation().conjugate() * axis;
  std::vector<Correspondence> result;
  for (const Eigen::Vector3f& p : features.marks) {
    const Eigen::Vector3d point = p.cast<double>();
    const Eigen::Vector3d world = view.T_world_body * point;
    const auto mark = map.marks().Find(world, axis, kMarkSpread * view.range_noise);
    if (!mark) continue;
    Correspondence c{.point = point, .anchor = mark->mean, .normal = axis};
    c.variance = view.range_noise * view.range_noise + mark->variance;
    Vector6d h;
    h << axis, point.cross(axis_body);
    c.gate = h.dot(view.pose_covariance * h);
    const double residual = axis.dot(world - mark->mean);
    const double limit = kGateSigmas * config.robust_width;
    if (residual * residual <= limit * limit * (c.variance + c.gate)) result.push_back(c);
  }
  return result;
}

}  // namespace mlvi
