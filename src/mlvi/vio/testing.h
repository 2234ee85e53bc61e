// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Synthetic tracks for the tests of this module and those above it: no images, but projected points
// with noise, several cameras, an IMU, and the truth of everything.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/imu/imu_testing.h"
#include "mlvi/panorama/testing.h"
#include "mlvi/panorama/track_store.h"
#include "mlvi/state/estimates.h"
#include "mlvi/vio/sliding_window.h"

namespace mlvi::test {

struct SyntheticOptions {
  testing::Walk walk;
  ImuSpec imu = testing::TestImu();
  double accelerometer_bias = 0.02;  // m/s^2, one sigma per axis
  double gyroscope_bias = 0.002;     // rad/s
  int cameras = 4;
  double offset = 0.07;    // m, of the cameras from the body
  int budget = 150;        // living tracks
  double set_rate = 20.0;  // Hz
  // px, of every observation but the first of a track: what a tracker follows is what it saw first.
  double pixel_noise = 0.5;
  double anchor_noise = 0.0;  // px, of the first one
  double drift = 0.0;         // px, of the tracked place from one set to the next
  double min_distance = 1.5, max_distance = 8.0;  // m, of points from the path
  double seconds = 10.0;
  // s, per camera (those that are missing: 0): its images are stamped this much before the set,
  std::vector<double> advances;
  std::vector<double> time_offsets;  // and taken this much later than stamped.
  // The cameras as they are, relative to where the estimator has them.
  Pose3 T_nominal_true;
  std::uint64_t seed = 1;
};

// The first covariance of tests: sigmas of position, velocity, attitude and biases.
struct StartSigmas {
  double position = 1e-3, velocity = 0.05, rotation = 0.005;
  double accelerometer_bias = 0.05, gyroscope_bias = 0.005;

  Matrix15d Covariance() const {
    Vector15d sigma;
    sigma << Eigen::Vector3d::Constant(position), Eigen::Vector3d::Constant(velocity),
        Eigen::Vector3d::Constant(rotation), Eigen::Vector3d::Constant(accelerometer_bias),
        Eigen::Vector3d::Constant(gyroscope_bias);
    return sigma.cwiseAbs2().asDiagonal();
  }
};

// A walk through points, and what cameras and IMU make of it. Call Advance for one set of images
// after the other.
class SyntheticRecording {
 public:
  explicit SyntheticRecording(const SyntheticOptions& options)
      : options_(options),
        rig_(RingRig(options.cameras, options.offset,
                     MakeCamera(testing::NewerCollegeCalibrations()[0]))),
        random_(options.seed, "synthetic tracks") {
    rig_.imu = options.imu;
    rig_.gravity = testing::kGravity;
    model_ = std::make_unique<PanoramaModel>(MakePanorama(rig_));
    true_model_ = std::make_unique<PanoramaModel>(*model_);
    for (int i = 0; i < model_->cameras(); ++i) {
      true_model_->set_T_pano_camera(i, model_->T_pano_camera(i) * options.T_nominal_true);
    }
    MakeImu();
    MakePoints();
  }

  const Rig& rig() const { return rig_; }  // as the estimator is told
  const PanoramaModel& model() const { return *model_; }
  const std::vector<ImuSample>& samples() const { return samples_; }
  const TrackStore& tracks() const { return tracks_; }
  TrackStore& tracks() { return tracks_; }

  int sets() const { return static_cast<int>(options_.seconds * options_.set_rate); }
  FrameId frame() const { return FrameId(set_); }
  FrameImages images() const {
    FrameImages images{.frame = frame(), .stamp = stamp()};
    for (int i = 0; i < options_.cameras; ++i)
      images.delays.push_back(-Duration::FromSeconds(Of(options_.advances, i)));
    return images;
  }
  Time stamp() const { return testing::Walk::At(seconds()); }
  double seconds() const { return set_ / options_.set_rate; }
  NavState Truth() const {
    NavState state = options_.walk.State(seconds());
    state.bias = biases_[static_cast<std::size_t>(std::lround(seconds() * options_.imu.rate_hz))];
    return state;
  }
  // m, of the point of a track along the ray of its last observation from the true camera.
  double TrueDepth(TrackId track) const {
    const PanoramicObservation& o = tracks_.Find(track)->last();
    const Pose3 T_world_camera = CameraPose(o.camera);
    return (points_[static_cast<std::size_t>(point_of_.at(track))] - T_world_camera.translation())
        .norm();
  }

  // The next set of images.
  void Advance() {
    ++set_;
    FollowTracks();
    StartTracks();
  }

  // The truth with an error drawn from `sigmas`, and these as its covariance.
  OdometryEstimate DisturbedTruth(const StartSigmas& sigmas) {
    const Matrix15d covariance = sigmas.Covariance();
    Vector15d error;
    for (int i = 0; i < 15; ++i) error[i] = std::sqrt(covariance(i, i)) * random_.Normal();
    return {.state = BoxPlus(Truth(), error), .covariance = covariance};
  }

  VioCalibration NominalCalibration() const {
    VioCalibration calibration{.T_body_pano = model_->T_body_pano(), .radius = model_->radius()};
    for (int i = 0; i < model_->cameras(); ++i) {
      calibration.T_pano_camera.push_back(model_->T_pano_camera(i));
      calibration.time_offsets.push_back(0.0);
    }
    return calibration;
  }

 private:
  static double Of(const std::vector<double>& values, int camera) {
    const auto index = static_cast<std::size_t>(camera);
    return index < values.size() ? values[index] : 0.0;
  }

  void MakeImu() {
    samples_ = options_.walk.Samples(0.0, options_.seconds + 1.0, options_.imu.rate_hz);
    RandomStream random(options_.seed, "synthetic imu");
    const ImuBias bias{.accelerometer = testing::NormalVector(random, options_.accelerometer_bias),
                       .gyroscope = testing::NormalVector(random, options_.gyroscope_bias)};
    testing::AddImuNoise(options_.imu, bias, random, samples_, &biases_);
  }

  // In a tube around the path and before and behind it.
  void MakePoints() {
    RandomStream random(options_.seed, "synthetic points");
    const Eigen::Vector3d begin = options_.walk.State(0.0).T_world_body.translation();
    const Eigen::Vector3d end = options_.walk.State(options_.seconds).T_world_body.translation();
    const double length = (end - begin).norm();
    const Eigen::Vector3d ahead =
        length > 1e-3 ? Eigen::Vector3d((end - begin) / length) : Eigen::Vector3d::UnitX();
    const Eigen::Matrix<double, 3, 2> across = TangentBasis(ahead);
    const auto count = static_cast<int>(120.0 * (length + 2.0 * options_.max_distance));
    for (int i = 0; i < count; ++i) {
      const double angle = random.Uniform(0.0, 2.0 * M_PI);
      const double distance = random.Uniform(options_.min_distance, options_.max_distance);
      const double along = random.Uniform(-options_.max_distance, length + options_.max_distance);
      points_.push_back(begin + along * ahead +
                        distance * across * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }

  // Where the true camera is when its image is taken.
  Pose3 CameraPose(int camera) const {
    const double late = Of(options_.time_offsets, camera) - Of(options_.advances, camera);
    const Pose3 T_world_body = options_.walk.State(seconds() + late).T_world_body;
    return T_world_body * true_model_->T_body_pano() * true_model_->T_pano_camera(camera);
  }

  // The noisy pixel of a point, lifted by the estimator's model.
  std::optional<PanoramicObservation> Observe(int camera, const Eigen::Vector3d& point,
                                              double noise, const Eigen::Vector2d& offset) {
    const auto pixel = model_->camera(camera).Project(CameraPose(camera).inverse() * point);
    if (!pixel || !model_->Usable(camera, *pixel)) return std::nullopt;
    return model_->Lift(
        camera, *pixel + offset + noise * Eigen::Vector2d(random_.Normal(), random_.Normal()));
  }

  void FollowTracks() {
    std::vector<TrackId> alive;
    for (const Track& track : tracks_.tracks()) {
      if (track.alive) alive.push_back(track.id);
    }
    for (const TrackId id : alive) {
      const int camera = tracks_.Find(id)->last().camera;
      Eigen::Vector2d& offset = drift_of_.try_emplace(id, Eigen::Vector2d::Zero()).first->second;
      offset += options_.drift * Eigen::Vector2d(random_.Normal(), random_.Normal());
      const auto observation = Observe(camera, points_[static_cast<std::size_t>(point_of_.at(id))],
                                       options_.pixel_noise, offset);
      if (observation) {
        tracks_.Extend(id, frame(), *observation);
        continue;
      }
      tracks_.End(id);
      in_use_.erase(point_of_.at(id));
    }
  }

  void StartTracks() {
    const auto count = static_cast<double>(points_.size());
    for (int attempt = 0; attempt < 20000 && tracks_.alive() < options_.budget; ++attempt) {
      const int point = static_cast<int>(random_.Uniform(0.0, count));
      const int camera = static_cast<int>(random_.Uniform(0.0, options_.cameras));
      if (in_use_.contains(point)) continue;
      const auto observation = Observe(camera, points_[static_cast<std::size_t>(point)],
                                       options_.anchor_noise, Eigen::Vector2d::Zero());
      if (!observation) continue;
      const TrackId id = tracks_.Start(frame(), *observation);
      point_of_[id] = point;
      in_use_[point] = id;
    }
  }

  SyntheticOptions options_;
  Rig rig_;
  RandomStream random_;
  std::unique_ptr<PanoramaModel> model_, true_model_;
  std::vector<ImuSample> samples_;
  std::vector<ImuBias> biases_;  // per sample
  std::vector<Eigen::Vector3d> points_;
  TrackStore tracks_;
  std::map<TrackId, int> point_of_;
  std::map<TrackId, Eigen::Vector2d> drift_of_;  // px
  std::map<int, TrackId> in_use_;
  int set_ = -1;
};

// One run of a window over a recording.
struct SyntheticRun {
  std::vector<NavState> truth;
  std::vector<WindowEstimate> estimates;  // of every set but the first
  int keyframes = 0;
  VioCalibration calibration;  // in the end

  Vector15d LastError() const { return BoxMinus(truth.back(), estimates.back().newest.state); }
  double LastPoseNees() const {
    Vector6d e;
    Matrix6d P;
    const Matrix15d& all = estimates.back().newest.covariance;
    const Vector15d error = LastError();
    e << error.segment<3>(nav_index::kPosition), error.segment<3>(nav_index::kRotation);
    P << all.block<3, 3>(0, 0), all.block<3, 3>(0, 6), all.block<3, 3>(6, 0), all.block<3, 3>(6, 6);
    return e.dot(P.llt().solve(e));
  }
  double PathLength() const {
    double length = 0.0;
    for (std::size_t i = 1; i < truth.size(); ++i) {
      length +=
          (truth[i].T_world_body.translation() - truth[i - 1].T_world_body.translation()).norm();
    }
    return length;
  }
};

// What a test does to the window before it is solved (LiDAR depths).
using BeforeSolving = std::function<void(SyntheticRecording&, SlidingWindow&)>;

inline SyntheticRun RunWindow(const SyntheticOptions& options, const WindowConfig& config,
                              const StartSigmas& sigmas = {},
                              const BeforeSolving& before_solving = {}) {
  SyntheticRecording recording(options);
  SlidingWindow window(config, {}, recording.rig().imu, recording.rig().gravity,
                       recording.NominalCalibration());
  SyntheticRun run;
  recording.Advance();
  window.Start(recording.images(), recording.DisturbedTruth(sigmas), recording.samples(),
               recording.tracks());
  for (int set = 1; set < recording.sets(); ++set) {
    recording.Advance();
    window.Add(recording.images(), recording.samples(), recording.tracks());
    if (before_solving) before_solving(recording, window);
    run.estimates.push_back(window.Solve());
    run.truth.push_back(recording.Truth());
    for (const TrackId track : window.Slide()) recording.tracks().End(track);
    run.keyframes += window.newest_is_keyframe() ? 1 : 0;
    recording.tracks().ForgetBefore(FrameId(recording.frame().value() - 100));
  }
  run.calibration = window.window().calibration;
  return run;
}

}  // namespace mlvi::test
