// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// LiDAR depths of tracked features against the truth of a simulated sequence: the ray of every track
// from the true pose, traced, and what AssociateDepth says about it from the sweeps of the last
// seconds. Errors of the pose are left out, those of the association stay. Panes and what moves
// count by themselves.
#pragma once

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/panorama/track_store.h"
#include "mlvi/sim/recording.h"
#include "mlvi/vio/depth_accumulator.h"
#include "mlvi/vio/depth_association.h"

namespace mlvi {

class DepthAccuracy {
 public:
  struct Row {
    std::string kind;
    int asked = 0;
    double found = 0.0;                    // share of `asked`
    double median = 0.0;                   // m, of the error's size
    double mean = 0.0;                     // relative, signed, of errors below 5 %
    double beyond = 0.0;                   // share beyond three claimed sigmas
    double mean_square = 0.0;              // in squared sigmas, of those within four
    double common = 0.0;                   // mean in sigmas, over searches, RMS
    double too_far = 0.0, too_near = 0.0;  // shares off by more than 10 %
    double search_ms = 0.0;                // of the processor, per search; of "all" only
  };

  // `recording` and `model`, which holds the true mounts, must outlive this.
  DepthAccuracy(const Recording& recording, const PanoramaModel& model, const DepthConfig& config,
                double pixel_sigma)
      : recording_(&recording),
        model_(&model),
        config_(config),
        pixel_sigma_(pixel_sigma),
        accumulator_(config) {}

  // A deskewed sweep, body frame, and the true pose at its stamp.
  void AddCloud(Time stamp, const Pose3& T_world_body, const PointCloud& points_body) {
    PointCloud points;
    for (const Eigen::Vector3f& p : points_body) {
      points.push_back((T_world_body * p.cast<double>()).cast<float>());
    }
    accumulator_.Add(stamp, points);
  }

  // After each set of images, taken at the true time `stamp`.
  void Observe(Time stamp, std::span<const Track> tracks) {
    if (accumulator_.points().empty()) return;
    if (last_.valid() && (stamp - last_).seconds() < config_.interval) return;
    last_ = stamp;
    FrameId frame;
    for (const Track& track : tracks) frame = std::max(frame, track.last_frame());
    const WorldSnapshot world = recording_->world().At(stamp);
    const Pose3 T_world_pano = recording_->GroundTruth(stamp).T_world_body * model_->T_body_pano();
    const std::clock_t before = std::clock();
    const SphericalDepthMap map(accumulator_.points(), T_world_pano, config_);
    std::vector<std::pair<Ray, FeatureDepth>> depths;
    for (const Track& track : tracks) {
      if (track.last_frame() != frame) continue;
      const PanoramicObservation& o = track.last();
      const Ray ray{o.center, o.bearing, pixel_sigma_ / o.resolution()};
      depths.emplace_back(ray, AssociateDepth(map, ray, config_));
    }
    clocks_ += std::clock() - before;
    ++searches_;
    for (const auto& [ray, depth] : depths) Compare(world, T_world_pano, ray, depth);
  }

  std::vector<Row> Rows() const {
    std::vector<Row> rows;
    for (const auto& [kind, errors] : errors_) rows.push_back(RowOf(kind, errors));
    return rows;
  }

 private:
  struct Error {
    bool found = false;
    double error = 0.0, depth = 0.0, sigma = 1.0;
    int search = 0;
  };

  void Compare(const WorldSnapshot& world, const Pose3& T_world_pano, const Ray& ray,
               const FeatureDepth& depth) {
    const Eigen::Vector3d origin = T_world_pano * ray.origin;
    const Eigen::Vector3d direction = T_world_pano.rotation() * ray.direction;
    const auto hit = world.Cast(origin, direction, 1000.0);
    if (!hit || hit->range > config_.max_depth) return;
    const Error error{.found = depth.status == DepthStatus::kFound,
                      .error = depth.depth - hit->range,
                      .depth = hit->range,
                      .sigma = std::sqrt(depth.variance),
                      .search = searches_};
    if (hit->object >= 0 || hit->material->transmission > 0.0 || hit->material->mirror >= 0.06) {
      errors_["pane or moving"].push_back(error);  // what is followed there is not known
      return;
    }
    errors_["all"].push_back(error);
    errors_[IsRim(world, origin, direction, *hit, 4.0 * ray.sigma / pixel_sigma_) ? "rim"
                                                                                  : "smooth"]
        .push_back(error);
    const double sine = std::abs(direction.dot(hit->normal));
    errors_[sine > 0.7    ? "incidence above 45 deg"
            : sine > 0.35 ? "incidence 20 to 45 deg"
                          : "incidence below 20 deg"]
        .push_back(error);
    errors_[hit->range < 2.0   ? "depth to 2 m"
            : hit->range < 8.0 ? "depth 2 to 8 m"
                               : "depth from 8 m"]
        .push_back(error);
  }

  // Whether another depth lies within `reach` (rad).
  static bool IsRim(const WorldSnapshot& world, const Eigen::Vector3d& origin,
                    const Eigen::Vector3d& direction, const SurfaceHit& hit, double reach) {
    const Eigen::Matrix<double, 3, 2> tangent = TangentBasis(direction);
    for (int i = 0; i < 16; ++i) {
      const double angle = M_PI / 4.0 * i, off = i % 2 == 0 ? reach : 0.5 * reach;
      const Eigen::Vector3d d =
          (direction + off * tangent * Eigen::Vector2d(std::cos(angle), std::sin(angle)))
              .normalized();
      const auto near = world.Cast(origin, d, 1000.0);
      const double plane = hit.range * direction.dot(hit.normal) / d.dot(hit.normal);
      if (!near || std::abs(near->range - plane) > 0.05 * hit.range) return true;
    }
    return false;
  }

  Row RowOf(const std::string& kind, const std::vector<Error>& errors) const {
    Row row{.kind = kind, .asked = static_cast<int>(errors.size())};
    std::vector<double> sizes;
    double relative = 0.0, squares = 0.0;
    int small = 0, within = 0;
    std::map<int, std::pair<double, int>> by_search;
    for (const Error& e : errors) {
      if (!e.found) continue;
      const double share = e.error / e.depth, z = e.error / e.sigma;
      sizes.push_back(std::abs(e.error));
      row.beyond += std::abs(z) > 3.0;
      row.too_far += share > 0.1;
      row.too_near += share < -0.1;
      if (std::abs(share) < 0.05) relative += share, ++small;
      if (std::abs(z) > 4.0) continue;
      squares += z * z, ++within;
      by_search[e.search].first += z;
      ++by_search[e.search].second;
    }
    const double n = std::max<double>(1.0, static_cast<double>(sizes.size()));
    row.found = n / std::max(1, row.asked);
    std::sort(sizes.begin(), sizes.end());
    row.median = sizes.empty() ? 0.0 : sizes[sizes.size() / 2];
    row.mean = relative / std::max(1, small);
    row.beyond /= n, row.too_far /= n, row.too_near /= n;
    row.mean_square = squares / std::max(1, within);
    double common = 0.0;
    for (const auto& [search, sum] : by_search) common += std::pow(sum.first / sum.second, 2);
    row.common = std::sqrt(common / std::max<double>(1.0, static_cast<double>(by_search.size())));
    row.search_ms = 1e3 * static_cast<double>(clocks_) / CLOCKS_PER_SEC / std::max(1, searches_);
    return row;
  }

  const Recording* recording_;
  const PanoramaModel* model_;
  DepthConfig config_;
  double pixel_sigma_;
  DepthAccumulator accumulator_;
  Time last_;
  std::map<std::string, std::vector<Error>> errors_;
  std::clock_t clocks_ = 0;
  int searches_ = 0;
};

}  // namespace mlvi
