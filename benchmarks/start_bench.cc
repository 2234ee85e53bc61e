// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// First states from cameras and IMU alone, tried again and again along a simulated sequence, against
// the truth: how often there is one, how far off it is, and whether its covariance says so.
//   start_bench --sequence room-01 --seconds 60 --rate 10 --exact --cache drawn --imu m2dgr
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <ctime>
#include <map>
#include <vector>

#include "drawn_sequence.h"
#include "mlvi/base/parallel.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/panorama/panoramic_tracker.h"
#include "mlvi/vio/frame_history.h"
#include "mlvi/vio/visual_inertial_start.h"
#include "quantile.h"

namespace mlvi {
namespace {

struct Options : DrawnSetup {
  std::string imu;  // rig whose IMU takes the place of the sequence's
  std::vector<std::string> cameras;
  bool verbose = false;
};

// What became of the starts of one kind ("static", "visual-inertial").
struct Tally {
  std::vector<double> velocity, speed_error, tilt, nees;
};

// Velocity, tilt and biases of a start have no gauge: in the levelled frame of the body's heading.
using Observable = Eigen::Matrix<double, 11, 1>;

struct StartError {
  Observable error;
  double nees = 0.0;
};

Eigen::Matrix<double, 11, 15> ObservableDerivative(const NavState& state) {
  const Eigen::Matrix3d R = state.T_world_body.R();
  Eigen::Matrix<double, 11, 15> J = Eigen::Matrix<double, 11, 15>::Zero();
  // R^T v, and the direction of gravity in the body frame: nothing depends on the heading.
  J.block<3, 3>(0, nav_index::kVelocity) = R.transpose();
  J.block<3, 3>(0, nav_index::kRotation) = Hat(R.transpose() * state.v_world_body);
  const Eigen::Vector3d up = R.transpose().col(2);
  J.block<2, 3>(3, nav_index::kRotation) = TangentBasis(up).transpose() * Hat(up);
  J.block<6, 6>(5, nav_index::kAccelerometerBias).setIdentity();
  return J;
}

StartError ErrorOf(const Initialization& start, const NavState& truth) {
  const NavState& state = start.states.back();
  const Eigen::Matrix<double, 11, 15> J = ObservableDerivative(state);
  StartError result;
  result.error.head<3>() = truth.T_world_body.rotation().conjugate() * truth.v_world_body -
                           state.T_world_body.rotation().conjugate() * state.v_world_body;
  const Eigen::Vector3d up = state.T_world_body.R().transpose().col(2),
                        true_up = truth.T_world_body.R().transpose().col(2);
  result.error.segment<2>(3) = TangentBasis(up).transpose() * (true_up - up);
  result.error.segment<3>(5) = truth.bias.accelerometer - state.bias.accelerometer;
  result.error.segment<3>(8) = truth.bias.gyroscope - state.bias.gyroscope;
  const Eigen::Matrix<double, 11, 11> covariance = J * start.covariance * J.transpose();
  result.nees = result.error.dot(covariance.ldlt().solve(result.error));
  return result;
}

// Follows the tracks through the sequence, and tries a start whenever it is due.
class Starter {
 public:
  Starter(const Options& options, const VioConfig& config, const Rig& rig,
          const PanoramaModel& model, const Recording& recording, const ImuSimulator& imu)
      : options_(options),
        config_(config),
        rig_(rig),
        recording_(recording),
        imu_(imu),
        tracker_(model, config.tracker),
        history_(Duration::FromSeconds(config.start.max_seconds + 1.0)) {}

  void Process(const ImageSet& set, std::span<const ImuSample> imu) {
    if (set.stamp > recording_.end()) return;
    frame_ = FrameId(frame_.value() + 1);
    history_.AddSamples(imu);
    tracker_.tracks().ForgetBefore(history_.AddFrame(frame_, set.stamp));
    TrackingHints hints;
    hints.motion = [this](FrameId earlier) {
      return history_.Motion(earlier, frame_, tracker_.model().T_body_pano(),
                             Eigen::Vector3d::Zero());
    };
    tracker_.Process(frame_, set.images, hints);
    if (next_.valid() && set.stamp < next_) return;
    next_ = set.stamp + Duration::FromSeconds(config_.start.retry_interval);
    Try(set.stamp);
  }

  void Print() const {
    fmt::print("{} tries, {:.0f} ms of processor time each at most\n", tries_, worst_ms_);
    fmt::print(
        "| start | times | velocity: median, m/s | p95 | largest | tilt: median, deg | p95 | NEES "
        "(11) | p95 |\n|---|---|---|---|---|---|---|---|---|\n");
    for (const auto& [method, t] : tallies_) {
      fmt::print("| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} |\n",
                 method, t.velocity.size(), Quantile(t.velocity, 0.5), Quantile(t.velocity, 0.95),
                 Quantile(t.velocity, 1.0), Quantile(t.tilt, 0.5), Quantile(t.tilt, 0.95),
                 Quantile(t.nees, 0.5), Quantile(t.nees, 0.95));
    }
    for (const auto& [reason, times] : objections_) fmt::print("{} times: {}...\n", times, reason);
  }

 private:
  void Try(Time now) {
    std::vector<FrameInstant> frames;
    for (const FrameHistory::Frame& seen : history_.frames()) {
      if ((now - seen.stamp).seconds() <= config_.start.max_seconds &&
          seen.stamp >= history_.samples().front().stamp) {
        frames.push_back({seen.id, seen.stamp});
      }
    }
    const std::clock_t before = std::clock();
    const auto start = InitializeFromTracks({.tracks = tracker_.tracks().tracks(),
                                             .frames = frames,
                                             .samples = history_.samples(),
                                             .T_body_pano = tracker_.model().T_body_pano(),
                                             .pixel_sigma = config_.window.pixel_sigma},
                                            rig_.imu, rig_.gravity, config_.start);
    worst_ms_ =
        std::max(worst_ms_, 1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    ++tries_;
    if (!start) {
      ++objections_[start.error().message.substr(0, 40)];
      if (options_.verbose) fmt::print("{}\n", start.error().message);
      return;
    }
    NavState truth = recording_.GroundTruth(now);
    truth.bias = imu_.BiasAt(now);
    const StartError error = ErrorOf(*start, truth);
    Tally& tally = tallies_[start->method];
    tally.velocity.push_back(error.error.head<3>().norm());
    tally.tilt.push_back(error.error.segment<2>(3).norm() * 180.0 / M_PI);
    tally.nees.push_back(error.nees);
    if (options_.verbose) {
      fmt::print(
          "{:.2f} s: {} speed {:.2f} error {:.3f} m/s, {:.2f} deg, rms {:.2f}, NEES {:.1f}\n",
          (now - recording_.begin()).seconds(), start->method, truth.v_world_body.norm(),
          tally.velocity.back(), tally.tilt.back(), start->rms_residual, error.nees);
    }
  }

  const Options& options_;
  const VioConfig& config_;
  const Rig& rig_;
  const Recording& recording_;
  const ImuSimulator& imu_;
  PanoramicTracker tracker_;
  FrameHistory history_;
  FrameId frame_;
  Time next_;
  int tries_ = 0;
  double worst_ms_ = 0.0;
  std::map<std::string, Tally> tallies_;
  std::map<std::string, int> objections_;
};

Expected<void> Run(const Options& o, Rig rig, const VioConfig& config) {
  const std::string images = DrawImages(o, rig);
  SequenceOptions sequence = MakeSequence(o, rig);
  if (!o.imu.empty()) {
    const auto other = LoadRig(o.imu);
    if (!other) return tl::unexpected(other.error());
    rig.imu = sequence.rig.true_rig.imu = other->imu;
    sequence.imu_noise = PhysicalImuNoise(*other);
  }
  const Recording recording(sequence);
  std::vector<int> new_index;
  const Rig used = SelectCameras(rig, o.cameras, new_index);
  const auto model = PanoramaModel::FromRig(used);
  if (!model) return tl::unexpected(model.error());
  for (const std::uint64_t seed : o.noise_seeds) {
    const ImuSimulator imu = MakeImu(recording, seed);
    Starter starter(o, config, used, *model, recording, imu);
    PlaySets(
        imu, SetReader(images, new_index), [](Time) {},
        [&](const ImageSet& set, const std::vector<ImuSample>& samples) {
          starter.Process(set, samples);
        });
    starter.Print();
  }
  return {};
}

}  // namespace
}  // namespace mlvi

int main(int argc, char** argv) {
  CLI::App app("First states from cameras and IMU alone along a simulated sequence");
  mlvi::Options options;
  mlvi::VioConfig config;
  mlvi::AddDrawnOptions(app, options);
  app.add_option("--imu", options.imu, "Rig whose IMU takes the place of the sequence's");
  app.add_option("--cameras", options.cameras, "Names (default: all)")->delimiter(',');
  app.add_flag("--verbose", options.verbose, "Every try");
  CLI11_PARSE(app, argc, argv);
  const auto rig = mlvi::Resolve(options, config);
  if (!rig) {
    fmt::print(stderr, "{}\n", rig.error().message);
    return 1;
  }
  const mlvi::ThreadLimit threads(options.threads);
  if (const auto done = mlvi::Run(options, *rig, config); !done) {
    fmt::print(stderr, "{}\n", done.error().message);
    return 1;
  }
  return 0;
}
