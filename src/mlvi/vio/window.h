// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The sliding window as a value: frames, features, calibration, and the prior that what has left it
// has become. Functions on it are in the other window*.h.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/imu/preintegration.h"
#include "mlvi/panorama/panorama_model.h"
#include "mlvi/panorama/track_store.h"
#include "mlvi/vio/image_motion.h"
#include "mlvi/vio/window_config.h"

namespace mlvi {

// Coordinates of a step of one frame: the pose chart (position in the body frame, rotation), then
// velocity and biases, so that a pose is one block.
namespace frame_index {
inline constexpr int kPose = 0, kRotation = 3, kVelocity = 6, kBias = 9, kSize = 15;
}

NavState MoveState(const NavState& state, const Vector15d& step);
// The step from `from` to `state`: MoveState(from, StateStep(from, state)) = state.
Vector15d StateStep(const NavState& from, const NavState& state);

// IMU between a frame and the one before.
struct ImuConnection {
  std::vector<ImuSample> samples;
  PreintegratedImu motion;
  Matrix15d sqrt_information = Matrix15d::Zero();
};

// Samples of [from, to], integrated at `bias`. Contract: `samples` is not empty.
ImuConnection Connect(std::span<const ImuSample> samples, Time from, Time to, const ImuBias& bias,
                      const ImuSpec& imu);

struct WindowFrame {
  FrameId id;
  NavState state;  // at the stamp of the set of images
  bool keyframe = false;
  std::optional<ImuConnection> imu;  // from the frame before; not of the first
  // Where the prior was linearised that this frame is part of; empty: it is not.
  std::optional<NavState> prior_state;
  double rest_sigma = 0.0;  // m/s; the body stands still to this, per axis; 0: nothing is known
  // Per camera: when its image was taken, and what that means for the present state; the latter is
  // a constant while the window is solved.
  std::vector<ImageTiming> timings;
  std::vector<ImageMotion> images;

  void Move(const Vector15d& d) { state = MoveState(state, d); }
};

struct WindowObservation {
  FrameId frame;
  PanoramicObservation observation;
  int index = 0;  // in the track, counted from its first one
};

// What LiDAR says about a feature, along the ray of its anchor.
struct InverseDepthMeasurement {
  double inverse_depth = 0.0;  // 1/m
  double sigma = 0.0;          // 1/m
};

// A feature at an inverse depth along the ray of its first observation, the anchor.
struct WindowFeature {
  TrackId track;
  std::vector<WindowObservation> observations;  // oldest first
  int seen = 0;                                 // observations of the track so far
  double inverse_depth = 0.0;                   // 1/m, >= 0
  bool triangulated = false;  // false: the depth is a mere default, until parallax tells
  bool alive = true;          // still followed by the tracker
  std::optional<InverseDepthMeasurement> lidar;

  bool usable() const { return observations.size() >= 2; }
};

struct VioCalibration {
  Pose3 T_body_pano;
  std::vector<Pose3> T_pano_camera;
  std::vector<double> time_offsets;  // s, per camera; images are taken this much later than stamped
  double radius = 10.0;              // m, of the sphere; matters to `none` and `plane` only
};

// Which coordinates a step of the window has: frames first, calibration behind.
class WindowLayout {
 public:
  WindowLayout() = default;
  WindowLayout(int frames, int cameras, const WindowConfig& config)
      : frames_(frames),
        cameras_(config.extrinsics == ExtrinsicsCalibration::kCameras ? cameras : 0),
        rig_(config.extrinsics == ExtrinsicsCalibration::kRig),
        times_(config.time_offset ? cameras : 0) {}

  int frames() const { return frames_; }
  bool has_rig() const { return rig_; }
  bool has_cameras() const { return cameras_ > 0; }
  bool has_times() const { return times_ > 0; }
  int times() const { return times_; }  // one per camera, or none
  int frame(int i) const { return frame_index::kSize * i; }
  int calibration() const { return frame_index::kSize * frames_; }
  int calibration_size() const { return 6 * (cameras_ + (rig_ ? 1 : 0)) + times_; }
  int size() const { return calibration() + calibration_size(); }
  // Within the calibration.
  int rig() const { return 0; }
  int camera(int i) const { return 6 * i; }
  int time(int camera) const { return calibration_size() - times_ + camera; }

 private:
  int frames_ = 0;
  int cameras_ = 0;
  bool rig_ = false;
  int times_ = 0;
};

// What has left the window: residual(step) = residual + sqrt_information * step, with `step` the
// steps of frames from their prior states and of the calibration from `calibration`, stacked.
struct WindowPrior {
  struct Block {
    FrameId frame;  // invalid: the calibration
    int first = 0;  // coordinate within the frame or the calibration
    int size = 0;
  };
  std::vector<Block> blocks;
  Eigen::MatrixXd sqrt_information;
  Eigen::VectorXd residual;
  VioCalibration calibration;
};

struct VioWindow {
  std::vector<WindowFrame> frames;  // in the order of time
  std::vector<WindowFeature> features;
  VioCalibration calibration;
  VioCalibration nominal;  // as the rig file has it
  WindowPrior prior;

  int FindFrame(FrameId id) const;  // index, -1 if there is none
  WindowLayout Layout(const WindowConfig& config) const {
    return WindowLayout(static_cast<int>(frames.size()),
                        static_cast<int>(calibration.T_pano_camera.size()), config);
  }
};

// Moves everything but the features by a step laid out as `layout` says.
void MoveWindow(VioWindow& window, const WindowLayout& layout, const Eigen::VectorXd& step);
// The step from one calibration to another, as `layout` says.
Eigen::VectorXd CalibrationStep(const VioCalibration& from, const VioCalibration& to,
                                const WindowLayout& layout);

}  // namespace mlvi
