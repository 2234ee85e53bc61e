// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mlvi/state/estimates.h"
#include "mlvi/vio/calibration_deviation.h"
#include "mlvi/vio/keyframe_policy.h"
#include "mlvi/vio/window.h"
#include "mlvi/vio/window_solver.h"

namespace mlvi {

// When a set of images was taken.
struct FrameImages {
  FrameId frame;
  Time stamp;
  std::vector<Duration> delays = {};  // per camera, of its image's stamp against `stamp`, <= 0;
                                      // empty: none
};

// What the window says after a solution.
struct WindowEstimate {
  bool solved = false;
  OdometryEstimate newest;            // covariance in error-state order (nav_state.h)
  std::optional<MotionPrior> motion;  // from the frame before
  int features = 0;                   // in use
  int features_with_lidar = 0;
  int iterations = 0;
  double rms_px = 0.0;                // of bearings, per axis
  std::vector<double> camera_rms_px;  // per camera; 0 without bearings
  double imu_chi_square = 0.0;        // of the newest IMU factor; 15 degrees of freedom
  CalibrationDeviation deviation;     // of the calibration from the rig file
};

// Visual-inertial estimation over a window of keyframes and the newest frame (VINS-Mono's scheme of
// two-way marginalisation), from tracks and IMU samples alone: it knows no images. One round is
// Add, Solve, Slide.
class SlidingWindow {
 public:
  SlidingWindow(const WindowConfig& config, const KeyframeConfig& keyframes, const ImuSpec& imu,
                double gravity, const VioCalibration& calibration);

  bool started() const { return !window_.frames.empty(); }
  // Begins (anew) with one frame whose state is known. Variances of zero are raised to what no
  // sensor knows better. Calibration, and half of how certain it is, stay as they were in the last
  // round that came to Slide.
  void Start(const FrameImages& images, const OdometryEstimate& state,
             std::span<const ImuSample> samples, const TrackStore& tracks);
  void Clear();

  // The state at `stamp` by the IMU alone. `samples` reach from the newest frame to there.
  NavState Predict(std::span<const ImuSample> samples, Time stamp) const;
  // A frame at the stamp of a set, predicted as above, and what the tracks saw in it.
  void Add(const FrameImages& images, std::span<const ImuSample> samples, const TrackStore& tracks);
  // The newest frame stands still, to `velocity_sigma` m/s per axis.
  void AddRest(double velocity_sigma) { window_.frames.back().rest_sigma = velocity_sigma; }
  WindowEstimate Solve();
  // Drops outliers (their tracks are returned), decides whether the newest frame is a keyframe and
  // lets go what leaves the window.
  std::vector<TrackId> Slide();

  bool newest_is_keyframe() const { return window_.frames.back().keyframe; }
  const VioWindow& window() const { return window_; }
  VioWindow& window() { return window_; }
  const WindowConfig& config() const { return config_; }

 private:
  std::vector<ImageTiming> TimeImages(const FrameImages& images, const ImuBias& bias,
                                      std::span<const ImuSample> samples) const;
  void PrepareFrames();
  void Report(const WindowSolution& solution, WindowEstimate& estimate);

  WindowConfig config_;
  KeyframeConfig keyframes_;
  ImuSpec imu_;
  double gravity_;
  VioWindow window_;
  VioCalibration believed_;  // as of the last round that came to Slide
  Eigen::MatrixXd believed_covariance_, newest_covariance_;  // of that round; of the last solution
};

// Covariance of T_i_j = T_i^-1 T_j in its pose chart, from the joint covariance of both poses in
// theirs.
Matrix6d RelativePoseCovariance(const Pose3& T_i_j, const Eigen::Matrix<double, 12, 12>& joint);

}  // namespace mlvi
