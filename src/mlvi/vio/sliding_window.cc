// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/sliding_window.h"

#include "mlvi/base/error.h"
#include "mlvi/imu/imu_residual.h"
#include "mlvi/vio/window_features.h"
#include "mlvi/vio/window_marginalization.h"

namespace mlvi {
namespace {

// Variances of a first state below these are raised to them, in the order of frame_index.
Vector15d SmallestVariance() {
  Vector15d smallest;
  smallest << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-8),
      Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-8),
      Eigen::Vector3d::Constant(1e-12);
  return smallest;
}

// Error-state coordinates (p, v, R, ba, bg; position in the world) from those of a frame.
Matrix15d ErrorByFrameStep(const Eigen::Matrix3d& R_world_body) {
  Matrix15d J = Matrix15d::Zero();
  J.block<3, 3>(nav_index::kPosition, frame_index::kPose) = R_world_body;
  J.block<3, 3>(nav_index::kRotation, frame_index::kRotation).setIdentity();
  J.block<3, 3>(nav_index::kVelocity, frame_index::kVelocity).setIdentity();
  J.block<6, 6>(nav_index::kAccelerometerBias, frame_index::kBias).setIdentity();
  return J;
}

// Integrates anew when the biases have moved too far for a first-order correction.
bool NeedsIntegration(const PreintegratedImu& motion, const ImuBias& bias, double limit) {
  const Eigen::Vector3d gyroscope = bias.gyroscope - motion.bias.gyroscope;
  const Eigen::Vector3d accelerometer = bias.accelerometer - motion.bias.accelerometer;
  return (motion.dR_dbg * gyroscope).norm() > limit ||
         (motion.dv_dba * accelerometer).norm() > limit;
}

}  // namespace

SlidingWindow::SlidingWindow(const WindowConfig& config, const KeyframeConfig& keyframes,
                             const ImuSpec& imu, double gravity, const VioCalibration& calibration)
    : config_(config), keyframes_(keyframes), imu_(imu), gravity_(gravity) {
  window_.calibration = window_.nominal = believed_ = calibration;
}

void SlidingWindow::Clear() {
  window_.frames.clear();
  window_.features.clear();
  window_.prior = {};
  window_.calibration = believed_;
}

void SlidingWindow::Start(const FrameImages& images, const OdometryEstimate& state,
                          std::span<const ImuSample> samples, const TrackStore& tracks) {
  Clear();
  window_.frames.push_back({.id = images.frame,
                            .state = state.state,
                            .keyframe = true,
                            .imu = {},
                            .prior_state = state.state,
                            .timings = TimeImages(images, state.state.bias, samples)});
  PrepareFrames();
  // The frame's coordinates are the error state's, turned; so the inverse is the transpose.
  const Matrix15d by_error = ErrorByFrameStep(state.state.T_world_body.R()).transpose();
  Matrix15d covariance = by_error * state.covariance * by_error.transpose();
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  covariance.diagonal() = covariance.diagonal().cwiseMax(SmallestVariance()).eval();
  const bool known = believed_covariance_.size() > 0;
  window_.prior = FirstPrior(
      window_, covariance,
      known ? KnowledgeOf(window_, config_, believed_covariance_) : CalibrationKnowledge());
  AddObservations(window_, images.frame, tracks);
  InitializeDepths(window_, config_);
}

NavState SlidingWindow::Predict(std::span<const ImuSample> samples, Time stamp) const {
  const NavState& newest = window_.frames.back().state;
  const std::vector<ImuSample> between = SamplesBetween(samples, newest.stamp, stamp);
  MLVI_CHECK(!between.empty(), "no IMU between {} and {}", ToString(newest.stamp), ToString(stamp));
  return mlvi::Predict(newest, Preintegrate(between, newest.bias, imu_), gravity_);
}

void SlidingWindow::Add(const FrameImages& images, std::span<const ImuSample> samples,
                        const TrackStore& tracks) {
  const NavState& newest = window_.frames.back().state;
  WindowFrame added{.id = images.frame,
                    .imu = Connect(samples, newest.stamp, images.stamp, newest.bias, imu_),
                    .prior_state = {},
                    .timings = TimeImages(images, newest.bias, samples)};
  added.state = mlvi::Predict(newest, added.imu->motion, gravity_);
  window_.frames.push_back(std::move(added));
  PrepareFrames();
  AddObservations(window_, images.frame, tracks);
  InitializeDepths(window_, config_);
}

std::vector<ImageTiming> SlidingWindow::TimeImages(const FrameImages& images, const ImuBias& bias,
                                                   std::span<const ImuSample> samples) const {
  const std::size_t cameras = window_.calibration.T_pano_camera.size();
  MLVI_CHECK(images.delays.empty() || images.delays.size() == cameras, "{} delays of {} cameras",
             images.delays.size(), cameras);
  std::vector<ImageTiming> timings;
  for (std::size_t c = 0; c < cameras; ++c) {
    const Duration delay = images.delays.empty() ? Duration() : images.delays[c];
    timings.push_back(TimeImage(samples, images.stamp, delay, bias, imu_));
  }
  return timings;
}

void SlidingWindow::PrepareFrames() {
  for (std::size_t i = 0; i < window_.frames.size(); ++i) {
    WindowFrame& frame = window_.frames[i];
    frame.images.clear();
    for (const ImageTiming& timing : frame.timings) {
      frame.images.push_back(MotionOfImage(timing, frame.state, gravity_));
    }
    if (i == 0) continue;
    const WindowFrame& before = window_.frames[i - 1];
    if (NeedsIntegration(frame.imu->motion, before.state.bias, config_.max_bias_change)) {
      frame.imu = Connect(frame.imu->samples, before.state.stamp, frame.state.stamp,
                          before.state.bias, imu_);
    }
  }
}

WindowEstimate SlidingWindow::Solve() {
  WindowEstimate estimate;
  const WindowSolution solution = SolveWindow(window_, config_, gravity_);
  estimate.solved = solution.solved;
  estimate.iterations = solution.iterations;
  estimate.newest.state = window_.frames.back().state;
  BearingStatistics all;
  for (const BearingStatistics& camera : solution.per_camera) {
    estimate.camera_rms_px.push_back(camera.rms());
    all.Add(camera);
  }
  estimate.rms_px = all.rms();
  for (const WindowFeature& feature : window_.features) {
    if (!feature.usable()) continue;
    ++estimate.features;
    estimate.features_with_lidar += feature.lidar ? 1 : 0;
  }
  if (estimate.solved) Report(solution, estimate);
  return estimate;
}

void SlidingWindow::Report(const WindowSolution& solution, WindowEstimate& estimate) {
  const WindowLayout layout = window_.Layout(config_);
  const int count = static_cast<int>(window_.frames.size());
  const int frames = std::min(count, 2), first = layout.frame(count - frames);
  // The last two frames, and the calibration behind them.
  const auto columns = InverseColumns(solution.information.H, first, layout.size() - first);
  estimate.solved = columns.has_value();
  if (!columns) return;
  const WindowFrame& newest = window_.frames.back();
  const Matrix15d J = ErrorByFrameStep(newest.state.T_world_body.R());
  const int last = layout.frame(count - 1);
  const Matrix15d marginal = columns->block<15, 15>(last, last - first);
  estimate.newest.covariance = J * (0.5 * (marginal + marginal.transpose())) * J.transpose();
  newest_covariance_ =
      columns->bottomRightCorner(layout.calibration_size(), layout.calibration_size());
  estimate.deviation =
      DeviationFromNominal(window_.calibration, window_.nominal, layout, newest_covariance_);
  if (frames < 2) return;
  const WindowFrame& before = window_.frames[static_cast<std::size_t>(count) - 2];
  const Eigen::MatrixXd joint = columns->block<30, 30>(first, 0);
  Eigen::Matrix<double, 12, 12> poses;
  poses << joint.block<6, 6>(0, 0), joint.block<6, 6>(0, 15), joint.block<6, 6>(15, 0),
      joint.block<6, 6>(15, 15);
  const Pose3 T_from_to = before.state.T_world_body.inverse() * newest.state.T_world_body;
  estimate.motion = MotionPrior{.from = before.state.stamp,
                                .to = newest.state.stamp,
                                .T_from_to = T_from_to,
                                .covariance = RelativePoseCovariance(T_from_to, poses)};
  const Vector15d imu =
      newest.imu->sqrt_information *
      EvaluateImuResidual(before.state, newest.state, newest.imu->motion, gravity_).value;
  estimate.imu_chi_square = imu.squaredNorm();
}

std::vector<TrackId> SlidingWindow::Slide() {
  believed_ = window_.calibration;
  believed_covariance_ = newest_covariance_;
  const std::vector<TrackId> outliers = RemoveOutliers(window_, config_);
  window_.frames.back().keyframe = IsKeyframe(window_, keyframes_);
  const std::size_t count = window_.frames.size();
  if (count >= 3 && !window_.frames[count - 2].keyframe) {
    DropFrame(window_, count - 2, config_, imu_);
  } else if (static_cast<int>(count) > config_.keyframes) {
    MarginalizeFirstFrame(window_, config_, gravity_);
  }
  return outliers;
}

Matrix6d RelativePoseCovariance(const Pose3& T_i_j, const Eigen::Matrix<double, 12, 12>& joint) {
  const Eigen::Matrix3d Rt = T_i_j.R().transpose();
  Eigen::Matrix<double, 6, 12> J;
  J << -Rt, Rt * Hat(T_i_j.translation()), Eigen::Matrix<double, 3, 6>::Identity(),
      Eigen::Matrix3d::Zero(), -Rt, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity();
  const Matrix6d covariance = J * joint * J.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace mlvi
