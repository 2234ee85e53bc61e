// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "mlvi/sensors/measurement_source.h"
#include "mlvi/sim/camera_stream.h"
#include "mlvi/sim/imu_simulator.h"
#include "mlvi/sim/lidar_simulator.h"
#include "mlvi/sim/sequence.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// In what form measurements are handed out.
enum class RecordingForm : int {
  kMeasurements = 0,  // as a reader delivers them: returns only, SI units; feed estimators with it
  kMessages = 1,  // as drivers publish them: all rays, NaN points and wrong units included; write
                  // bags with it
};

// A simulated recording, generated while it is read, in the order of the true instants at which
// measurements are complete: a sweep after its last firing, an image at the middle of its exposure.
// What a clock is late by does not count, even where a driver stamps what arrives (m2dgr): stamps of
// different sensors may be out of order by as much. Construction builds world and
// motion (well under a second), and with cameras also textures and exposures (seconds); sweeps and
// images are traced by Next(). Same options, same bits, at any number of threads.
class Recording : public MeasurementSource {
 public:
  // `options` must pass CheckOptions.
  explicit Recording(SequenceOptions options, RecordingForm form = RecordingForm::kMeasurements);
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  Expected<std::optional<Measurement>> Next() override;
  double Progress() const override;
  std::map<std::string, StreamCounts> Counts() const override;  // by topic
  std::vector<std::string> Notes() const override { return {}; }

  // Whether the message of the measurement handed out last is to be cut off, or an image's data in
  // it (kMessages).
  bool IsCorrupted(const Measurement& measurement) const;

  // The truth at a true instant in [begin(), end()] (that of the nearer end outside), in the frame
  // of the world's mesh (z up; not the first body pose).
  NavState GroundTruth(Time time) const;
  // The truth that an estimate with the stamp `stamp` on the clock of `sensor` ("imu", "lidar" or a
  // camera's name) is to be held against: that of the instant at which this clock shows `stamp`.
  NavState GroundTruth(Time stamp, const std::string& sensor) const;
  // The true instant at which the clock of `sensor` shows `stamp`, with its offset and drift. Its
  // jitter counts with its mean; that the clock has been set back (TimeJump) does not.
  Time TrueTime(Time stamp, const std::string& sensor) const;
  // The stamp of the truth of a true instant in a file: what the clock shows that
  // SequenceOptions::truth_clock names.
  Time TruthStamp(Time time) const;
  // What has to be added to stamps of `sensor`'s messages to come to the IMU's clock: what the rig
  // file says, and what it does not know of both clocks. At the beginning, with mean jitter.
  Duration TrueTimeOffset(const std::string& sensor) const;
  Time begin() const { return options_.begin; }
  Time end() const { return end_; }
  // The true instant up to which Next() has come: begin() before its first measurement.
  Time reached() const { return reached_; }
  const SequenceOptions& options() const { return options_; }
  const Rig& rig() const { return options_.rig.estimator_rig; }  // what the estimator is told
  const World& world() const { return place_.world; }
  const PoseSpline& motion() const { return motion_; }
  const LidarSimulator& lidar() const { return lidar_; }
  const ImuSimulator& imu() const { return imu_; }
  const std::vector<CameraStream>& cameras() const { return cameras_; }

  // The smallest distance of the body to any surface, m, sampled every 0.1 s; 10 when farther
  // everywhere.
  double Clearance() const;

 private:
  std::optional<Measurement> NextImu();
  std::optional<Measurement> NextSweep();
  std::optional<Measurement> NextImage(std::size_t stream);
  void MakeCameras();
  Time TimeOf(double seconds) const { return options_.begin + Duration::FromSeconds(seconds); }
  double SecondsOf(Time time) const { return (time - options_.begin).seconds(); }
  Time SweepStamp(std::size_t index) const;
  // The stamp that the sensor's message `index` gets, whose measurement belongs to the true instant
  // `time`.
  Time Stamped(Time time, const std::string& sensor, Duration sensor_offset,
               std::size_t index) const;
  void SpoilPoints(LidarSweep& sweep, std::size_t index) const;
  bool IsImageCorrupted(const Image& image) const;

  SequenceOptions options_;
  Clocks clocks_;
  RecordingForm form_;
  Place place_;
  Time end_, reached_;
  PoseSpline motion_;
  LidarSimulator lidar_;
  ImuSimulator imu_;
  std::size_t sweeps_ = 0;
  std::size_t next_imu_ = 0, next_sweep_ = 0;
  StreamCounts imu_counts_, lidar_counts_;
  std::unique_ptr<SceneRenderer> renderer_;  // null without cameras
  std::vector<CameraStream> cameras_;
  std::vector<std::optional<Image>> frozen_images_;  // by stream; what a frozen camera repeats
  std::vector<std::size_t> next_images_;             // by stream
  std::vector<StreamCounts> image_counts_;
};

// Orientation of the body in its carrier (x ahead, y left, z up). The LiDAR is carried upright, and
// what points ahead is the axis of the body that the cameras look along on the whole; its x (or y)
// axis without cameras and with such that look all around. The body's z may point up or down.
Eigen::Quaterniond CarriedOrientation(const Rig& rig);

}  // namespace mlvi
