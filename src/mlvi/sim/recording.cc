// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/recording.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/parallel.h"
#include "mlvi/sim/places/operator.h"

namespace mlvi {
namespace {

constexpr double kStandardGravity = 9.80665;  // m/s^2, of drivers that report multiples of g
// Why messages are dropped, as readers say it.
constexpr char kCutOff[] = "unreadable message", kNotFinite[] = "NaN or infinite";
constexpr Duration kSweepPeriod = Duration::FromMilliseconds(100);

// What covers the noise of an IMU and its vibration, which is as much as white noise of its rms at
// every sample: that of the rig file where it holds more.
ImuNoise NoiseToCover(const SequenceOptions& options, const ImuErrors& errors) {
  const ImuSpec& imu = options.rig.true_rig.imu;
  const double second = std::sqrt(imu.rate_hz);
  ImuNoise noise = imu.noise;
  noise.accelerometer_density = std::max(
      noise.accelerometer_density,
      std::hypot(options.imu_noise.accelerometer_density, errors.vibration.acceleration / second));
  noise.gyroscope_density =
      std::max(noise.gyroscope_density,
               std::hypot(options.imu_noise.gyroscope_density, errors.vibration.rate / second));
  return noise;
}

// Complete: the length as a number, and an estimator that is told noise that fits the IMU.
SequenceOptions Checked(SequenceOptions options) {
  const auto ok = CheckOptions(options);
  MLVI_CHECK(ok.has_value(), "{}", ok.error().message);
  options.seconds = options.length();
  if (!options.recorded_imu.samples.empty()) options.imu_errors = {};  // they have real ones
  options.carried = options.carried && !options.trajectory && !options.own_world &&
                    CanBeCarried(options.rig.true_rig);
  const ImuErrors errors = EffectiveErrors(options.imu_errors, options.faults);
  if (HasErrors(errors)) options.rig.estimator_rig.imu.noise = NoiseToCover(options, errors);
  return options;
}

// The recorded motion with its first pose at `start` (position and heading), and its stamps counted
// from `begin`.
PoseSpline Placed(const PoseSpline& recorded, const PathPoint& start, Time begin,
                  const Eigen::Quaterniond& R_carrier_body) {
  const Pose3 first = recorded.PoseAt(recorded.begin());
  const Eigen::Vector3d ahead =
      first.rotation() * R_carrier_body.conjugate() * Eigen::Vector3d::UnitX();
  const Eigen::Quaterniond turn =
      ExpSo3({0.0, 0.0, start.heading - std::atan2(ahead.y(), ahead.x())});
  const PoseSpline moved =
      recorded.Transformed(Pose3(turn, start.position - turn * first.translation()));
  return PoseSpline(begin, moved.knot_interval(), moved.control_poses());
}

// The place of the sequence, or the own world. Without waypoints that has a walk of its own about
// its origin, which nobody takes.
Place MakePlace(const SequenceOptions& options) {
  if (!options.own_world) return FindSequence(options.sequence)->make_place(options.seed);
  const OwnWorld& own = *options.own_world;
  const std::vector<Eigen::Vector3d> nowhere = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  return {.world = World(own.mesh, own.lighting),
          .path = WalkingPath(own.waypoints.empty() ? nowhere : own.waypoints, own.rounding)};
}

PoseSpline MakeMotion(const SequenceOptions& options, const WalkingPath& path) {
  const Eigen::Quaterniond carried = CarriedOrientation(options.rig.true_rig);
  if (options.trajectory && options.own_world && !options.trajectory_start) {
    return PoseSpline(options.begin, options.trajectory->knot_interval(),
                      options.trajectory->control_poses());
  }
  if (options.trajectory) {
    return Placed(*options.trajectory, options.trajectory_start.value_or(path.At(0.0)),
                  options.begin, carried);
  }
  MotionProfile profile = FindSequence(options.sequence)->make_profile();
  profile.rest = options.rest;
  return MakeWalk(path, profile, carried, options.begin, options.seconds, options.seed);
}

// What the rig file says of the stamps of `sensor`.
Duration TimeOffsetOf(const Rig& rig, const std::string& sensor) {
  if (sensor == "imu") return rig.imu.time_offset;
  if (sensor == "lidar") return rig.lidar->time_offset;
  const auto camera = std::ranges::find(rig.cameras, sensor, &CameraSpec::name);
  MLVI_CHECK(camera != rig.cameras.end(), "no sensor '{}'", sensor);
  return camera->time_offset;
}

// From the body to who carries it: as far as suits the handheld rigs, and behind every sensor of
// another one as it is behind the LiDAR of Newer College's.
double DistanceBehind(const Rig& rig) {
  constexpr double kRoom = 0.38;  // m
  const Eigen::Quaterniond carried = CarriedOrientation(rig);
  double distance = Carrying{}.distance;
  const auto keep_before = [&](const Pose3& T_body_sensor) {
    distance = std::max(distance, kRoom - (carried * T_body_sensor.translation()).x());
  };
  keep_before(rig.lidar->T_body_lidar);
  for (const CameraSpec& camera : rig.cameras) keep_before(camera.T_body_camera);
  return distance;
}

ImuPhysics PhysicsOf(const SequenceOptions& options) {
  const Rig& rig = options.rig.true_rig;
  const auto& faulty = options.faults.imu_saturation;
  return {
      .rate_hz = rig.imu.rate_hz,
      .noise = options.imu_noise,
      .accelerometer_saturation = faulty ? faulty->acceleration : rig.imu.accelerometer_saturation,
      .gyroscope_saturation = faulty ? faulty->rate : rig.imu.gyroscope_saturation,
      .gravity = rig.gravity,
      .errors = EffectiveErrors(options.imu_errors, options.faults)};
}

ImuSimulator MakeImu(const SequenceOptions& options, const PoseSpline& motion, Time end) {
  if (options.recorded_imu.samples.empty()) {
    return ImuSimulator(PhysicsOf(options), motion, options.begin, end,
                        RandomStream(options.seed, "imu"));
  }
  return ImuSimulator(PhysicsOf(options), options.recorded_imu,
                      options.begin - options.trajectory->begin(), options.begin, end);
}

LidarSimulator MakeLidar(const SequenceOptions& options) {
  const LidarSpec& spec = *options.rig.true_rig.lidar;
  LidarPattern pattern = MakeLidarPattern(spec.model).value();
  if (options.ideal_lidar) pattern.physics = IdealPhysics(pattern.physics);
  if (options.plane_surfaces) pattern.physics.plane_surfaces = true;
  return LidarSimulator(std::move(pattern), spec.T_body_lidar, RandomStream(options.seed, "lidar"));
}

}  // namespace

Recording::Recording(SequenceOptions options, RecordingForm form)
    : options_(Checked(std::move(options))),
      clocks_(EffectiveClocks(options_.clocks, options_.faults)),
      form_(form),
      place_(MakePlace(options_)),
      end_(options_.begin + Duration::FromSeconds(options_.seconds)),
      reached_(options_.begin),
      motion_(MakeMotion(options_, place_.path)),
      lidar_(MakeLidar(options_)),
      imu_(MakeImu(options_, motion_, end_)) {
  place_.world.StartClock(options_.begin);
  if (options_.carried) {
    place_.world.AddMover(
        MakeOperator(place_.world, motion_, CarriedOrientation(options_.rig.true_rig),
                     {.distance = DistanceBehind(options_.rig.true_rig), .height = kHandheldHeight},
                     RandomStream(options_.seed, "operator")));
  }
  if (const auto off = options_.faults.lights_off) {
    place_.world.SetLampLevel([off](double seconds) { return off->Contains(seconds) ? 0.0 : 1.0; });
  }
  while (SweepStamp(sweeps_) + lidar_.pattern().span() <= end_) ++sweeps_;
  if (!options_.cameras.empty()) MakeCameras();
}

void Recording::MakeCameras() {
  const TextureTint tint =
      options_.camera_physics.colour ? TextureTint::kColour : TextureTint::kGrey;
  renderer_ = std::make_unique<SceneRenderer>(place_.world, tint);
  const auto& specs = options_.rig.true_rig.cameras;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const CameraSpec& spec = specs[i];
    if (std::ranges::find(options_.cameras, spec.name) == options_.cameras.end()) continue;
    const double rate = options_.image_rate > 0.0 ? options_.image_rate : spec.rate_hz;
    cameras_.emplace_back(spec, static_cast<int>(i), rate, options_.camera_physics,
                          RandomStream(options_.seed, "camera " + spec.name), *renderer_, motion_,
                          options_.begin + TriggerDelay(options_.faults, spec.name), end_);
    if (const auto& jump = options_.faults.exposure_jump)
      cameras_.back().MultiplyGain(TimeOf(jump->window.start),
                                   TimeOf(jump->window.start + jump->window.length), jump->factor);
  }
  frozen_images_.resize(cameras_.size());
  next_images_.resize(cameras_.size());
  image_counts_.resize(cameras_.size());
}

Time Recording::SweepStamp(std::size_t index) const {
  return options_.begin + kSweepPeriod * static_cast<std::int64_t>(index);
}

Time Recording::Stamped(Time time, const std::string& sensor, Duration sensor_offset,
                        std::size_t index) const {
  const auto& jump = options_.faults.time_jump;
  const double seconds = SecondsOf(time);
  const RandomStream random = RandomStream(options_.seed, "stamps of " + sensor).Fork(index);
  Time stamp = time + StampError(clocks_, sensor, seconds, random);
  if (jump && seconds >= jump->start) stamp = stamp - Duration::FromSeconds(jump->back);
  return form_ == RecordingForm::kMessages ? stamp - sensor_offset : stamp;
}

Expected<std::optional<Measurement>> Recording::Next() {
  while (true) {
    // The earliest: an IMU sample, else an image, else a sweep where they arrive at once.
    std::optional<Time> earliest;
    int stream = 0;  // -1: IMU, -2: LiDAR, else the camera stream
    const auto offer = [&](Time time, int source) {
      if (earliest && *earliest <= time) return;
      earliest = time;
      stream = source;
    };
    if (next_imu_ < imu_.size()) offer(imu_.StampOf(next_imu_), -1);
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      if (next_images_[i] < cameras_[i].size())
        offer(cameras_[i].TimeOf(next_images_[i]), static_cast<int>(i));
    }
    if (next_sweep_ < sweeps_) offer(SweepStamp(next_sweep_) + lidar_.pattern().span(), -2);
    if (!earliest) return std::nullopt;
    reached_ = *earliest;
    auto measurement = stream == -1   ? NextImu()
                       : stream == -2 ? NextSweep()
                                      : NextImage(static_cast<std::size_t>(stream));
    if (measurement) return measurement;
  }
}

std::optional<Measurement> Recording::NextImu() {
  const std::size_t index = next_imu_++;
  const Time time = imu_.StampOf(index);
  const SequenceFaults& faults = options_.faults;
  if (faults.imu_gap && faults.imu_gap->Contains(SecondsOf(time))) return std::nullopt;
  const auto within = [&](const std::optional<FaultWindow>& window) {
    return window && window->Contains(SecondsOf(time));
  };
  const bool is_nan = within(faults.nan_imu);
  ++imu_counts_.messages;
  if (form_ == RecordingForm::kMeasurements && (is_nan || within(faults.corrupted_imu))) {
    ++imu_counts_.dropped[is_nan ? kNotFinite : kCutOff];
    return std::nullopt;
  }
  ImuSample sample = imu_.Sample(index);
  if (is_nan) SpoilSample(sample);
  sample.stamp = Stamped(time, "imu", options_.rig.true_rig.imu.time_offset, index);
  if (form_ == RecordingForm::kMessages && faults.imu_in_g)
    sample.linear_acceleration /= kStandardGravity;
  ++imu_counts_.delivered;
  return sample;
}

std::optional<Measurement> Recording::NextSweep() {
  const std::size_t index = next_sweep_++;
  const Time time = SweepStamp(index);
  const SequenceFaults& faults = options_.faults;
  if (faults.lidar_gap && faults.lidar_gap->Contains(SecondsOf(time))) return std::nullopt;
  const bool corrupted =
      faults.corrupted_sweeps && faults.corrupted_sweeps->Contains(SecondsOf(time));
  if (corrupted && form_ == RecordingForm::kMeasurements) {  // as a reader would have dropped it
    ++lidar_counts_.messages;
    ++lidar_counts_.dropped[kCutOff];
    return std::nullopt;
  }
  const LidarSpec& spec = *options_.rig.estimator_rig.lidar;
  LidarSweep sweep = lidar_.Sweep(place_.world, motion_, time, index);
  sweep.stamp = Stamped(time, "lidar", options_.rig.true_rig.lidar->time_offset, index);
  SpoilPoints(sweep, index);
  if (form_ == RecordingForm::kMeasurements) KeepReturns(sweep, spec.min_range, spec.max_range);
  ++lidar_counts_.messages;
  ++lidar_counts_.delivered;
  return sweep;
}

std::optional<Measurement> Recording::NextImage(std::size_t stream) {
  const std::size_t index = next_images_[stream]++;
  const auto camera = static_cast<std::size_t>(cameras_[stream].camera());
  const CameraSpec& spec = options_.rig.true_rig.cameras[camera];
  const Time time = cameras_[stream].TimeOf(index);
  const SequenceFaults& faults = options_.faults;
  const auto failure = FailureOf(faults, spec.name, SecondsOf(time));
  if (failure == CameraFailure::kDead) return std::nullopt;
  if (faults.image_gap && faults.image_gap->Contains(SecondsOf(time))) return std::nullopt;
  ++image_counts_[stream].messages;
  if (failure == CameraFailure::kCorrupted && form_ == RecordingForm::kMeasurements) {
    ++image_counts_[stream].dropped[kCutOff];
    return std::nullopt;
  }
  std::optional<Image>& frozen = frozen_images_[stream];
  if (failure != CameraFailure::kFrozen) frozen.reset();
  Image image = frozen ? *frozen : cameras_[stream].Take(index);
  if (failure == CameraFailure::kFrozen && !frozen) frozen = image;
  for (const LensPatch& patch : faults.lens_patches) {
    if (patch.camera == spec.name) SmearLens(patch, image.channels, image);
  }
  image.stamp = Stamped(time, spec.name, spec.time_offset, index);
  if (form_ == RecordingForm::kMeasurements) MakeGrey(image);
  ++image_counts_[stream].delivered;
  return image;
}

void Recording::SpoilPoints(LidarSweep& sweep, std::size_t index) const {
  const double seconds = SecondsOf(SweepStamp(index));
  const SequenceFaults& faults = options_.faults;
  if (faults.empty_sweeps && faults.empty_sweeps->Contains(seconds)) {
    for (LidarPoint& point : sweep.points) point.position.setZero();
  }
  if (faults.nan_points && faults.nan_points->Contains(seconds)) {
    SpoilTenth(sweep, RandomStream(options_.seed, "nan points").Fork(index));
  }
}

bool Recording::IsCorrupted(const Measurement& measurement) const {
  const SequenceFaults& faults = options_.faults;
  const auto within = [&](const std::optional<FaultWindow>& window, Time time) {
    return window && window->Contains(SecondsOf(time));
  };
  if (const auto* image = std::get_if<Image>(&measurement)) return IsImageCorrupted(*image);
  if (std::holds_alternative<LidarSweep>(measurement))
    return next_sweep_ > 0 && within(faults.corrupted_sweeps, SweepStamp(next_sweep_ - 1));
  return next_imu_ > 0 && within(faults.corrupted_imu, imu_.StampOf(next_imu_ - 1));
}

bool Recording::IsImageCorrupted(const Image& image) const {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (cameras_[i].camera() != image.camera || next_images_[i] == 0) continue;
    const auto camera = static_cast<std::size_t>(image.camera);
    const double seconds = SecondsOf(cameras_[i].TimeOf(next_images_[i] - 1));
    return FailureOf(options_.faults, options_.rig.true_rig.cameras[camera].name, seconds) ==
           CameraFailure::kCorrupted;
  }
  return false;
}

double Recording::Progress() const {
  const auto done = static_cast<double>(next_sweep_),
             all = static_cast<double>(std::max<std::size_t>(sweeps_, 1));
  return std::min(1.0, done / all);
}

std::map<std::string, StreamCounts> Recording::Counts() const {
  const Rig& rig = options_.rig.true_rig;
  std::map<std::string, StreamCounts> counts = {{rig.imu.topic, imu_counts_},
                                                {rig.lidar->topic, lidar_counts_}};
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    counts[rig.cameras[static_cast<std::size_t>(cameras_[i].camera())].topic] = image_counts_[i];
  return counts;
}

NavState Recording::GroundTruth(Time time) const {
  const MotionSample sample = motion_.At(std::clamp(time, begin(), end_));
  return {.stamp = time,
          .T_world_body = sample.T_world_body,
          .v_world_body = sample.velocity,
          .bias = imu_.BiasAt(std::clamp(time, begin(), end_))};
}

NavState Recording::GroundTruth(Time stamp, const std::string& sensor) const {
  NavState truth = GroundTruth(TrueTime(stamp, sensor));
  truth.stamp = stamp;
  return truth;
}

Time Recording::TrueTime(Time stamp, const std::string& sensor) const {
  return TimeOf(TrueSeconds(clocks_, sensor, SecondsOf(stamp)));
}

Time Recording::TruthStamp(Time time) const {
  return time +
         Duration::FromSeconds(MeanStampError(clocks_, options_.truth_clock, SecondsOf(time)));
}

Duration Recording::TrueTimeOffset(const std::string& sensor) const {
  const auto lateness = [&](const std::string& name) {
    return Duration::FromSeconds(MeanStampError(clocks_, name, 0.0));
  };
  return TimeOffsetOf(options_.rig.true_rig, sensor) + lateness("imu") - lateness(sensor);
}

double Recording::Clearance() const {
  constexpr double kFar = 10.0;
  const auto steps = static_cast<std::size_t>(10.0 * options_.seconds) + 1;
  const auto nearest = [&](std::size_t begin, std::size_t end) {
    double clearance = kFar;
    for (std::size_t i = begin; i < end; ++i) {
      const Time time = options_.begin + Duration::FromSeconds(0.1 * static_cast<double>(i));
      if (time > end_) break;
      clearance =
          std::min(clearance, place_.world.Clearance(motion_.PoseAt(time).translation(), kFar));
    }
    return clearance;
  };
  return ParallelReduce(steps, 64, kFar, nearest, [](double& a, double b) { a = std::min(a, b); });
}

namespace {

// Of the cameras' optical axes, in the body; zero without cameras.
Eigen::Vector3d MeanView(const Rig& rig) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const CameraSpec& camera : rig.cameras)
    sum += camera.T_body_camera.rotation() * Eigen::Vector3d::UnitZ();
  return rig.cameras.empty() ? sum : sum / static_cast<double>(rig.cameras.size());
}

// The direction in the body that points ahead: the axis of the body that the cameras look along (on
// the whole: `view`, without its part along `up`), or their own direction where it is none of these;
// x, or y if x stands upright, where they look all around.
Eigen::Vector3d NominallyAhead(const Eigen::Vector3d& up, const Eigen::Vector3d& view) {
  constexpr double kAllAround = 0.2, kAlong = 0.94;  // the latter within 20 deg
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  if (view.norm() < kAllAround) return std::abs(up.dot(x)) < 0.9 ? x : y;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    const double cosine = unit.dot(view) / view.norm();
    if (std::abs(cosine) > kAlong) return std::copysign(1.0, cosine) * unit;
  }
  return view;
}

}  // namespace

Eigen::Quaterniond CarriedOrientation(const Rig& rig) {
  const Eigen::Vector3d up = rig.lidar
                                 ? rig.lidar->T_body_lidar.rotation() * Eigen::Vector3d::UnitZ()
                                 : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  const auto level = [&](const Eigen::Vector3d& v) { return (v - v.dot(up) * up).eval(); };
  const Eigen::Vector3d ahead = level(NominallyAhead(up, level(MeanView(rig)))).normalized();
  Eigen::Matrix3d R;
  R << ahead.transpose(), up.cross(ahead).transpose(), up.transpose();
  return Eigen::Quaterniond(R);
}

}  // namespace mlvi
