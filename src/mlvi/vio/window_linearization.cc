// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window_linearization.h"

#include <array>
#include <cmath>

#include "mlvi/base/parallel.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/imu/imu_residual.h"
#include "mlvi/vio/bearing_factor.h"
#include "mlvi/vio/calibration_prior.h"

namespace mlvi {
namespace {

constexpr std::size_t kFeaturesPerChunk = 32;
// m^2. The information of an inverse depth that nothing tells: a parallax of 1e-4 sigmas at 1 m.
constexpr double kNoInformation = 1e-8;

// A depth from behind or in front of an edge is off by many sigmas and must not pull.
constexpr CauchyKernel kLidarKernel{1.0};

double LossCost(const WindowConfig& config, double s) {
  return config.loss == BearingLoss::kHuber ? HuberKernel{config.loss_scale}.Cost(s)
                                            : CauchyKernel{config.loss_scale}.Cost(s);
}

double LossWeight(const WindowConfig& config, double s) {
  return config.loss == BearingLoss::kHuber ? HuberKernel{config.loss_scale}.Weight(s)
                                            : CauchyKernel{config.loss_scale}.Weight(s);
}

// Evaluates bearings of one window.
class BearingEvaluator {
 public:
  BearingEvaluator(const VioWindow& window, const WindowConfig& config)
      : window_(window), config_(config), cameras_(window.calibration.T_pano_camera.size()) {
    for (const WindowFrame& f : window.frames) {
      MLVI_CHECK(f.images.size() == cameras_, "{} images of {} cameras", f.images.size(), cameras_);
      for (std::size_t c = 0; c < cameras_; ++c) {
        places_.emplace_back(f.state.T_world_body, f.images[c], window.calibration.time_offsets[c]);
      }
      ids_.push_back(f.id);
    }
  }

  int Index(FrameId id) const {
    const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
    MLVI_CHECK(found != ids_.end() && *found == id, "frame {} is not in the window", id.value());
    return static_cast<int>(found - ids_.begin());
  }
  // Of the image of one camera in one frame.
  const ImagePlace& place(int frame, int camera) const {
    return places_[static_cast<std::size_t>(frame) * cameras_ + static_cast<std::size_t>(camera)];
  }

  PanoramicRay RayOf(const PanoramicObservation& o, RayRole role) const {
    return MakePanoramicRay(o,
                            window_.calibration.T_pano_camera[static_cast<std::size_t>(o.camera)],
                            window_.calibration.radius, config_.compensation, role);
  }

  // Residual in px.
  std::optional<Eigen::Vector2d> Evaluate(const PanoramicRay& anchor, const ImagePlace& a,
                                          double rho, const PanoramicRay& target,
                                          const ImagePlace& t, BearingJacobians* jacobians) const {
    return BearingResidual(anchor, rho, target,
                           {a.T_world_image, t.T_world_image, window_.calibration.T_body_pano},
                           jacobians);
  }

 private:
  const VioWindow& window_;
  const WindowConfig& config_;
  std::size_t cameras_;
  std::vector<ImagePlace> places_;  // frame by frame
  std::vector<FrameId> ids_;
};

// The sums of some features.
struct VisualSums {
  VisualSums(int size, std::size_t cameras)
      : H(Eigen::MatrixXd::Zero(size, size)), b(Eigen::VectorXd::Zero(size)), per_camera(cameras) {}

  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  double cost = 0.0;
  std::vector<BearingStatistics> per_camera;
};

// One derivative block of a bearing and where it goes among the visual coordinates.
struct VisualBlock {
  int start = 0;
  int size = 0;
  Eigen::Matrix<double, 2, 6> J;
};

// The blocks of one bearing, by rising coordinate: anchor and target pose, calibration.
class VisualBlocks {
 public:
  void Add(int start, const Eigen::Matrix<double, 2, 6>& J) { blocks_[count_++] = {start, 6, J}; }
  void AddColumn(int start, const Eigen::Vector2d& column) {
    blocks_[count_] = {start, 1, {}};
    blocks_[count_++].J.col(0) = column;
  }
  std::span<const VisualBlock> all() const { return {blocks_.data(), count_}; }

 private:
  std::array<VisualBlock, 6> blocks_;
  std::size_t count_ = 0;
};

// One end of a bearing: which frame and camera, and where that image was taken.
struct BearingEnd {
  int frame = 0;
  int camera = 0;
  const ImagePlace* place = nullptr;
};

// The columns of time offsets; within one set they matter between two cameras.
void CollectTimes(const WindowLayout& layout, const BearingJacobians& j, const BearingEnd& anchor,
                  const BearingEnd& target, VisualBlocks& blocks) {
  const int first = 6 * layout.frames();
  const Eigen::Vector2d by_anchor = j.anchor * anchor.place->by_time_offset;
  const Eigen::Vector2d by_target = j.target * target.place->by_time_offset;
  if (anchor.camera == target.camera) {
    if (anchor.frame != target.frame)
      blocks.AddColumn(first + layout.time(anchor.camera), by_anchor + by_target);
    return;
  }
  const bool ascending = anchor.camera < target.camera;
  const int low = ascending ? anchor.camera : target.camera;
  const int high = ascending ? target.camera : anchor.camera;
  blocks.AddColumn(first + layout.time(low), ascending ? by_anchor : by_target);
  blocks.AddColumn(first + layout.time(high), ascending ? by_target : by_anchor);
}

VisualBlocks CollectBlocks(const WindowLayout& layout, const BearingJacobians& j,
                           const BearingEnd& anchor, const BearingEnd& target) {
  VisualBlocks blocks;
  const ImagePlace &a = *anchor.place, &t = *target.place;
  if (anchor.frame != target.frame) {  // within one frame its pose does not matter
    blocks.Add(6 * anchor.frame, a.moved ? (j.anchor * a.by_pose).eval() : j.anchor);
    blocks.Add(6 * target.frame, t.moved ? (j.target * t.by_pose).eval() : j.target);
  }
  const int calibration = 6 * layout.frames();
  if (layout.has_rig()) blocks.Add(calibration + layout.rig(), j.body_pano);
  if (layout.has_cameras()) {
    const int first = calibration + layout.camera(anchor.camera);
    const int second = calibration + layout.camera(target.camera);
    if (first == second) blocks.Add(first, j.anchor_camera + j.target_camera);
    if (first < second) blocks.Add(first, j.anchor_camera);
    if (first != second) blocks.Add(second, j.target_camera);
    if (first > second) blocks.Add(first, j.anchor_camera);
  }
  if (layout.has_times()) CollectTimes(layout, j, anchor, target, blocks);
  return blocks;
}

// Adds weight * J^T J and -weight * J^T r.
void AddBlocks(const VisualBlocks& blocks, const Eigen::Vector2d& residual, double weight,
               VisualSums& sums) {
  const auto all = blocks.all();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const VisualBlock& x = all[i];
    const Eigen::Matrix<double, 2, 6> weighted = weight * x.J;
    if (x.size == 6) {
      sums.b.segment<6>(x.start).noalias() -= weighted.transpose() * residual;
    } else {
      sums.b[x.start] -= weighted.col(0).dot(residual);
    }
    for (std::size_t k = i; k < all.size(); ++k) {
      const VisualBlock& y = all[k];
      if (x.size == 6 && y.size == 6) {
        sums.H.block<6, 6>(x.start, y.start).noalias() += weighted.transpose() * y.J;
      } else {  // columns of time offsets come last
        sums.H.col(y.start).segment(x.start, x.size) +=
            weighted.leftCols(x.size).transpose() * y.J.col(0);
      }
    }
  }
}

// Linearises single features; rows of `system` that belong to them are written, sums are added.
class FeatureLinearizer {
 public:
  FeatureLinearizer(const VioWindow& window, const WindowConfig& config)
      : window_(window),
        config_(config),
        evaluator_(window, config),
        layout_(window.Layout(config)) {}

  void Add(std::size_t f, LinearizedWindow& system, VisualSums& sums) const {
    const WindowFeature& feature = window_.features[f];
    if (!feature.usable()) return;
    const PanoramicObservation& first = feature.observations.front().observation;
    const BearingEnd anchor = EndOf(feature.observations.front());
    const PanoramicRay anchor_ray = evaluator_.RayOf(first, RayRole::kAnchor);
    const auto row = static_cast<Eigen::Index>(f);
    for (std::size_t k = 1; k < feature.observations.size(); ++k) {
      const WindowObservation& o = feature.observations[k];
      const BearingEnd target = EndOf(o);
      BearingJacobians j;
      const PanoramicRay target_ray = evaluator_.RayOf(o.observation, RayRole::kTarget);
      const auto residual = evaluator_.Evaluate(anchor_ray, *anchor.place, feature.inverse_depth,
                                                target_ray, *target.place, &j);
      if (!residual) continue;
      const double inverse_variance =
          1.0 / BearingVariance(feature.observations.front(), o, config_);
      const double s = inverse_variance * residual->squaredNorm();
      const double weight = inverse_variance * LossWeight(config_, s);
      sums.cost += 0.5 * LossCost(config_, s);
      sums.per_camera[static_cast<std::size_t>(o.observation.camera)].Add(residual->squaredNorm(),
                                                                          target_ray.freedom);
      const VisualBlocks blocks = CollectBlocks(layout_, j, anchor, target);
      AddBlocks(blocks, *residual, weight, sums);
      const Eigen::Vector2d weighted = weight * j.inverse_depth;
      system.feature_information[row] += weighted.dot(j.inverse_depth);
      system.feature_gradient[row] -= weighted.dot(*residual);
      for (const VisualBlock& block : blocks.all()) {
        system.coupling.row(row).segment(block.start, block.size) +=
            weighted.transpose() * block.J.leftCols(block.size);
      }
    }
    AddLidar(feature, row, system, sums);
  }

  // The squared residuals of its bearings, in squared sigmas.
  BearingStatistics ErrorOf(const WindowFeature& feature) const {
    BearingStatistics statistics;
    if (!feature.usable()) return statistics;
    const WindowObservation& first = feature.observations.front();
    const PanoramicRay anchor_ray = evaluator_.RayOf(first.observation, RayRole::kAnchor);
    for (std::size_t k = 1; k < feature.observations.size(); ++k) {
      const WindowObservation& o = feature.observations[k];
      const PanoramicRay target_ray = evaluator_.RayOf(o.observation, RayRole::kTarget);
      const auto residual =
          evaluator_.Evaluate(anchor_ray, *EndOf(first).place, feature.inverse_depth, target_ray,
                              *EndOf(o).place, nullptr);
      if (!residual) continue;
      statistics.Add(residual->squaredNorm() / BearingVariance(first, o, config_),
                     target_ray.freedom);
    }
    return statistics;
  }

 private:
  BearingEnd EndOf(const WindowObservation& o) const {
    const int frame = evaluator_.Index(o.frame), camera = o.observation.camera;
    return {frame, camera, &evaluator_.place(frame, camera)};
  }

  void AddLidar(const WindowFeature& feature, Eigen::Index row, LinearizedWindow& system,
                VisualSums& sums) const {
    if (!feature.lidar) return;
    const double inverse_variance = 1.0 / (feature.lidar->sigma * feature.lidar->sigma);
    const double error = feature.inverse_depth - feature.lidar->inverse_depth;
    const double s = error * error * inverse_variance;
    const double weight = inverse_variance * kLidarKernel.Weight(s);
    system.feature_information[row] += weight;
    system.feature_gradient[row] -= weight * error;
    sums.cost += 0.5 * kLidarKernel.Cost(s);
  }

  const VioWindow& window_;
  const WindowConfig& config_;
  BearingEvaluator evaluator_;
  WindowLayout layout_;
};

// From error-state order (position in the world) to the coordinates of a frame.
Matrix15d ByFrameStep(const Matrix15d& by_error, const NavState& state) {
  Matrix15d J;
  J << by_error.middleCols<3>(nav_index::kPosition) * state.T_world_body.R(),
      by_error.middleCols<3>(nav_index::kRotation), by_error.middleCols<3>(nav_index::kVelocity),
      by_error.middleCols<6>(nav_index::kAccelerometerBias);
  return J;
}

void AddImu(const VioWindow& window, std::size_t i, double gravity, LinearizedWindow& system) {
  const WindowFrame &first = window.frames[i - 1], &second = window.frames[i];
  const ImuConnection& imu = *second.imu;
  const ImuResidual at = EvaluateImuResidual(first.state, second.state, imu.motion, gravity);
  const Vector15d residual = imu.sqrt_information * at.value;
  Eigen::Matrix<double, 15, 30> J;
  J << imu.sqrt_information * ByFrameStep(at.by_first, first.state),
      imu.sqrt_information * ByFrameStep(at.by_second, second.state);
  const int start = system.layout.frame(static_cast<int>(i) - 1);
  system.H.block<30, 30>(start, start).noalias() += J.transpose() * J;
  system.b.segment<30>(start).noalias() -= J.transpose() * residual;
  system.cost += 0.5 * residual.squaredNorm();
}

// A velocity of zero was measured.
void AddRest(const VioWindow& window, std::size_t i, LinearizedWindow& system) {
  const WindowFrame& frame = window.frames[i];
  if (frame.rest_sigma == 0.0) return;
  const double information = 1.0 / (frame.rest_sigma * frame.rest_sigma);
  const int start = system.layout.frame(static_cast<int>(i)) + frame_index::kVelocity;
  system.H.diagonal().segment<3>(start).array() += information;
  system.b.segment<3>(start) -= information * frame.state.v_world_body;
  system.cost += 0.5 * information * frame.state.v_world_body.squaredNorm();
}

// The step of a frame from where the prior has it, and how that depends on one of its state.
struct StepFromPrior {
  explicit StepFromPrior(const WindowFrame& frame)
      : value(StateStep(*frame.prior_state, frame.state)) {
    const Eigen::Quaterniond turn = frame.prior_state->T_world_body.rotation().conjugate() *
                                    frame.state.T_world_body.rotation();
    by_state.block<3, 3>(frame_index::kPose, frame_index::kPose) = turn.toRotationMatrix();
    by_state.block<3, 3>(frame_index::kRotation, frame_index::kRotation) =
        RightJacobianInverseSo3(value.segment<3>(frame_index::kRotation));
  }

  Vector15d value;
  Matrix15d by_state = Matrix15d::Identity();
};

// The prior at the present estimate: its residual, and the derivative by `coordinates`.
struct PriorResidual {
  Eigen::VectorXd value;
  Eigen::MatrixXd J;
  std::vector<int> coordinates;
};

PriorResidual EvaluatePrior(const VioWindow& window, const WindowLayout& layout) {
  const WindowPrior& prior = window.prior;
  const Eigen::VectorXd calibration =
      CalibrationStep(prior.calibration, window.calibration, layout);
  PriorResidual result{.value = prior.residual, .J = prior.sqrt_information, .coordinates = {}};
  for (const WindowPrior::Block& block : prior.blocks) {
    const auto column = static_cast<Eigen::Index>(result.coordinates.size());
    const Eigen::MatrixXd by_step = prior.sqrt_information.middleCols(column, block.size);
    int start = layout.calibration();
    if (block.frame.valid()) {
      const int frame = window.FindFrame(block.frame);
      start = layout.frame(frame);
      const StepFromPrior step(window.frames[static_cast<std::size_t>(frame)]);
      result.value += by_step * step.value.segment(block.first, block.size);
      result.J.middleCols(column, block.size) =
          by_step * step.by_state.block(block.first, block.first, block.size, block.size);
    } else {
      result.value += by_step * calibration.segment(block.first, block.size);
    }
    for (int k = 0; k < block.size; ++k) result.coordinates.push_back(start + block.first + k);
  }
  return result;
}

void AddPrior(const VioWindow& window, LinearizedWindow& system) {
  if (window.prior.blocks.empty()) return;
  const PriorResidual prior = EvaluatePrior(window, system.layout);
  const Eigen::MatrixXd information = prior.J.transpose() * prior.J;
  const Eigen::VectorXd gradient = -prior.J.transpose() * prior.value;
  const std::vector<int>& coordinates = prior.coordinates;
  const auto size = static_cast<int>(coordinates.size());
  for (int c = 0; c < size; ++c) {
    for (int r = 0; r < size; ++r) {
      if (coordinates[r] <= coordinates[c])
        system.H(coordinates[r], coordinates[c]) += information(r, c);
    }
    system.b[coordinates[c]] += gradient[c];
  }
  system.cost += 0.5 * prior.value.squaredNorm();
}

// Brings the sums of bearings to their places.
void AddVisual(const VisualSums& sums, LinearizedWindow& system) {
  const int size = system.visual_size();
  for (int c = 0; c < size; ++c) {
    const int column = system.FromVisual(c);
    for (int r = 0; r <= c; ++r) system.H(system.FromVisual(r), column) += sums.H(r, c);
    system.b[column] += sums.b[c];
  }
  system.cost += sums.cost;
}

void AddBearings(const VioWindow& window, const WindowConfig& config, LinearizedWindow& system) {
  const std::size_t count = window.features.size();
  const auto rows = static_cast<Eigen::Index>(count);
  system.coupling = Eigen::MatrixXd::Zero(rows, system.visual_size());
  system.feature_information = Eigen::VectorXd::Zero(rows);
  system.feature_gradient = Eigen::VectorXd::Zero(rows);
  const FeatureLinearizer linearizer(window, config);
  const std::size_t cameras = window.calibration.T_pano_camera.size();
  const std::size_t chunks = (count + kFeaturesPerChunk - 1) / kFeaturesPerChunk;
  std::vector<VisualSums> partial(chunks, VisualSums(system.visual_size(), cameras));
  ParallelForChunks(count, kFeaturesPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      linearizer.Add(f, system, partial[begin / kFeaturesPerChunk]);
    }
  });
  VisualSums sums(system.visual_size(), cameras);
  for (const VisualSums& part : partial) {
    sums.H += part.H;
    sums.b += part.b;
    sums.cost += part.cost;
    for (std::size_t c = 0; c < cameras; ++c) sums.per_camera[c].Add(part.per_camera[c]);
  }
  AddVisual(sums, system);
  system.per_camera = sums.per_camera;
}

}  // namespace

double BearingVariance(const WindowObservation& anchor, const WindowObservation& target,
                       const WindowConfig& config) {
  const double sets = target.index - anchor.index;
  const double usual =
      config.pixel_sigma * config.pixel_sigma + sets * config.pixel_drift * config.pixel_drift;
  return target.observation.sigma_scale * target.observation.sigma_scale * usual;
}

LinearizedWindow Linearize(const VioWindow& window, const WindowConfig& config, double gravity,
                           const FactorSelection& selection) {
  LinearizedWindow system;
  system.layout = window.Layout(config);
  system.H = Eigen::MatrixXd::Zero(system.layout.size(), system.layout.size());
  system.b = Eigen::VectorXd::Zero(system.layout.size());
  if (selection.bearings) AddBearings(window, config, system);
  const std::size_t known = selection.first_only ? 1 : window.frames.size();
  for (std::size_t i = 0; i < known; ++i) {
    if (selection.imu && i + 1 < window.frames.size()) AddImu(window, i + 1, gravity, system);
    if (selection.rest) AddRest(window, i, system);
  }
  if (selection.prior) AddPrior(window, system);
  if (selection.calibration) AddCalibrationPrior(window, config, system);
  return system;
}

std::vector<double> FeatureErrors(const VioWindow& window, const WindowConfig& config) {
  const FeatureLinearizer linearizer(window, config);
  std::vector<double> errors;
  errors.reserve(window.features.size());
  for (const WindowFeature& f : window.features) errors.push_back(linearizer.ErrorOf(f).mean());
  return errors;
}

ReducedSystem EliminateFeatures(const LinearizedWindow& system, double relative_damping,
                                double absolute_damping) {
  ReducedSystem reduced{system.H, system.b};
  if (system.coupling.rows() == 0) return reduced;
  const Eigen::ArrayXd information =
      (1.0 + relative_damping) * system.feature_information.array() + absolute_damping;
  const Eigen::ArrayXd inverse = (information > kNoInformation).select(information.inverse(), 0.0);
  const Eigen::MatrixXd scaled = inverse.sqrt().matrix().asDiagonal() * system.coupling;
  Eigen::MatrixXd taken = Eigen::MatrixXd::Zero(scaled.cols(), scaled.cols());
  taken.selfadjointView<Eigen::Upper>().rankUpdate(scaled.transpose());
  const Eigen::VectorXd gradient =
      system.coupling.transpose() * (inverse * system.feature_gradient.array()).matrix();
  for (int c = 0; c < system.visual_size(); ++c) {
    const int column = system.FromVisual(c);
    for (int r = 0; r <= c; ++r) reduced.H(system.FromVisual(r), column) -= taken(r, c);
    reduced.b[column] -= gradient[c];
  }
  return reduced;
}

Eigen::VectorXd FeatureSteps(const LinearizedWindow& system, const Eigen::VectorXd& step,
                             double relative_damping, double absolute_damping) {
  Eigen::VectorXd visual(system.visual_size());
  for (int i = 0; i < visual.size(); ++i) visual[i] = step[system.FromVisual(i)];
  const Eigen::ArrayXd information =
      (1.0 + relative_damping) * system.feature_information.array() + absolute_damping;
  const Eigen::ArrayXd inverse = (information > kNoInformation).select(information.inverse(), 0.0);
  if (system.coupling.rows() == 0) return Eigen::VectorXd();
  return (inverse * (system.feature_gradient - system.coupling * visual).array()).matrix();
}

}  // namespace mlvi
