// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

constexpr double kStartSeconds = 1.5;  // from standing to full speed

// One oscillation of the carried sensor in the carrier's frame.
struct Oscillation {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // m, amplitude
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   // rad, amplitude
  double frequency = 1.0;                           // Hz
  double phase = 0.0;                               // rad
};

struct Offset {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
};

Offset Sum(const std::vector<Oscillation>& oscillations, double t) {
  Offset sum;
  for (const Oscillation& o : oscillations) {
    const double wave = std::sin(2.0 * std::numbers::pi * o.frequency * t + o.phase);
    sum.shift += wave * o.shift;
    sum.turn += wave * o.turn;
  }
  return sum;
}

// Steps at 1.8 Hz (bobbing, nodding), strides at 0.9 Hz (swaying, rolling), and slow looking
// around.
std::vector<Oscillation> Gait(const MotionProfile& profile, RandomStream& random) {
  const double stride = random.Uniform(0.85, 0.95), degree = std::numbers::pi / 180.0;
  const auto vary = [&](double amplitude) { return amplitude * random.Uniform(0.85, 1.15); };
  const auto phase = [&] { return random.Uniform(0.0, 2.0 * std::numbers::pi); };
  const double look = profile.look_around;
  return {
      {.shift = {0.0, 0.0, vary(0.020)}, .frequency = 2.0 * stride, .phase = phase()},
      {.shift = {vary(0.010), 0.0, 0.0}, .frequency = 2.0 * stride, .phase = phase()},
      {.shift = {0.0, vary(0.018), 0.0}, .frequency = stride, .phase = phase()},
      {.turn = {vary(1.1) * degree, 0.0, 0.0}, .frequency = stride, .phase = phase()},
      {.turn = {0.0, vary(0.7) * degree, 0.0}, .frequency = 2.0 * stride, .phase = phase()},
      {.turn = {0.0, 0.0, vary(1.2) * degree}, .frequency = stride, .phase = phase()},
      {.turn = {0.0, 0.0, vary(look)}, .frequency = random.Uniform(0.10, 0.13), .phase = phase()},
      {.turn = {0.0, vary(0.3 * look), 0.0},
       .frequency = random.Uniform(0.15, 0.2),
       .phase = phase()}};
}

// Waving the sensor about on all axes, of amplitudes still to be scaled.
std::vector<Oscillation> Shaking(RandomStream& random) {
  std::vector<Oscillation> result;
  for (int axis = 0; axis < 3; ++axis) {
    for (int wave = 0; wave < 3; ++wave) {
      const auto phase = [&] { return random.Uniform(0.0, 2.0 * std::numbers::pi); };
      Oscillation turn{.frequency = random.Uniform(0.5, 1.4), .phase = phase()};
      turn.turn[axis] = random.Uniform(0.6, 1.0) * 0.1 / turn.frequency;
      Oscillation shift{.frequency = random.Uniform(0.7, 1.7), .phase = phase()};
      shift.shift[axis] = random.Uniform(0.6, 1.0) * 0.03 / (shift.frequency * shift.frequency);
      result.push_back(turn);
      result.push_back(shift);
    }
  }
  return result;
}

// The body of a robot on its wheels: heaving, pitching and rolling at 5-9 Hz, of accelerations up
// to about `amplitude` m/s^2.
std::vector<Oscillation> Vibration(double amplitude, RandomStream random) {
  std::vector<Oscillation> result;
  for (int axis = 0; axis < 3; ++axis) {
    Oscillation o{.frequency = random.Uniform(5.0, 9.0),
                  .phase = random.Uniform(0.0, 2.0 * std::numbers::pi)};
    const double omega = 2.0 * std::numbers::pi * o.frequency;
    const double shift = amplitude / (omega * omega);
    if (axis == 2) o.shift.z() = shift;
    if (axis < 2) o.turn[axis] = 4.0 * shift;  // wheels a quarter of a metre from the middle
    result.push_back(o);
  }
  return result;
}

double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

// How much in motion `t` s after the initial rest: 0 within the stops of the profile, else 1, with
// a second to slow down and to start.
double Stopping(const MotionProfile& profile, double t) {
  if (profile.pause_every <= 0.0 || t < 0.0) return 1.0;
  const double period = profile.pause_every + profile.pause + 2.0;
  const double in_period = t - period * std::floor(t / period);
  const double stop = in_period - profile.pause_every;
  return stop < 0.0 ? 1.0 : 1.0 - SmoothStep(stop) + SmoothStep(stop - 1.0 - profile.pause);
}

// The walker without oscillations: where, heading where, how steeply and how much in motion, at
// every control instant.
struct Walker {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> headings;
  std::vector<double> slopes;    // magnitudes
  std::vector<double> activity;  // 0 at rest .. 1
};

// m/s: slower in bends and on stairs.
double Speed(const MotionProfile& profile, const PathPoint& at, double activity) {
  return profile.speed * activity /
         (1.0 + 0.6 * at.curvature + profile.stair_slowing * std::abs(at.slope));
}

// Where the walker is heading at every control instant when corners are smoothed over the time in
// motion, `active` s at each of them, whose last is at least the way to the last position.
std::vector<double> HeadingsInMotion(const WalkingPath& path, const MotionProfile& profile,
                                     const std::vector<double>& active) {
  const double dt = profile.knot_interval.seconds();
  std::vector<double> headings;
  double s = 0.0;
  // As Walk does, without rest; beyond the end by what smoothing reaches.
  const double last = active.back() + 6.0 * profile.heading_smoothing;
  for (double t = 0.0; t <= last + 2.0 * dt; t += dt) {
    const PathPoint at = path.At(s);
    headings.push_back(at.heading);
    s += Speed(profile, at, 1.0) * dt;
  }
  headings = SmoothOpen(headings, profile.heading_smoothing / dt);
  std::vector<double> result;
  for (const double t : active) {
    const auto before = static_cast<std::size_t>(t / dt);
    const double share = t / dt - static_cast<double>(before);
    result.push_back((1.0 - share) * headings[before] + share * headings[before + 1]);
  }
  return result;
}

Walker Walk(const WalkingPath& path, const MotionProfile& profile, std::size_t controls) {
  const double dt = profile.knot_interval.seconds();
  Walker walker;
  std::vector<double> active;  // s in motion so far
  double s = 0.0, in_motion = 0.0;
  for (std::size_t i = 0; i < controls; ++i) {
    const double t = dt * (static_cast<double>(i) - 1.0);
    const double activity =
        (profile.rest > 0.0 ? SmoothStep((t - profile.rest) / kStartSeconds) : 1.0) *
        Stopping(profile, t - profile.rest);
    const PathPoint at = path.At(s);
    walker.positions.push_back(at.position);
    walker.headings.push_back(at.heading);
    walker.slopes.push_back(std::abs(at.slope));
    walker.activity.push_back(activity);
    active.push_back(in_motion);
    s += Speed(profile, at, activity) * dt;
    in_motion += activity * dt;
  }
  walker.headings = profile.turns_at_rest
                        ? SmoothOpen(walker.headings, profile.heading_smoothing / dt)
                        : HeadingsInMotion(path, profile, active);
  return walker;
}

// Bursts: shaking swells and fades within some seconds.
double Envelope(const MotionProfile& profile, double t, double phase) {
  const double wave = std::sin(2.0 * std::numbers::pi * t / 7.0 + phase);
  double swell = (1.0 - profile.calm) * wave * wave;
  for (int i = 1; i < profile.burst_sharpness; ++i) swell *= wave * wave;
  return profile.calm + swell;
}

struct ShakingScale {
  double turn = 1.0;
  double shift = 1.0;
};

class WalkMaker {
 public:
  WalkMaker(const WalkingPath& path, const MotionProfile& profile,
            const Eigen::Quaterniond& R_carrier_body, Time begin, double seconds,
            std::uint64_t seed)
      : profile_(profile), R_carrier_body_(R_carrier_body), begin_(begin), random_(seed, "motion") {
    const auto segments =
        static_cast<std::size_t>(std::ceil(seconds / profile.knot_interval.seconds() - 1e-9));
    walker_ = Walk(path, profile, std::max<std::size_t>(segments, 1) + 3);
    gait_ = Gait(profile, random_);
    shaking_ = Shaking(random_);
    envelope_phase_ = random_.Uniform(0.0, std::numbers::pi);
    vibration_ = Vibration(profile.vibration, RandomStream(seed, "vibration"));
  }

  PoseSpline Make(const ShakingScale& scale) const {
    std::vector<Pose3> controls;
    for (std::size_t i = 0; i < walker_.positions.size(); ++i) {
      const double t = profile_.knot_interval.seconds() * (static_cast<double>(i) - 1.0);
      Offset gait = Sum(gait_, t);
      gait.shift.z() *= 1.0 + profile_.stair_bob * walker_.slopes[i];
      const Offset shaking = Sum(shaking_, t), vibration = Sum(vibration_, t);
      const double burst = Envelope(profile_, t, envelope_phase_), activity = walker_.activity[i];
      const Eigen::Vector3d shift =
          activity *
          (profile_.gait * gait.shift + burst * scale.shift * shaking.shift + vibration.shift);
      const Eigen::Vector3d turn = activity * (profile_.gait * gait.turn +
                                               burst * scale.turn * shaking.turn + vibration.turn);
      const Eigen::Quaterniond heading = ExpSo3({0.0, 0.0, walker_.headings[i]});
      controls.emplace_back(heading * ExpSo3(turn) * R_carrier_body_,
                            walker_.positions[i] + heading * shift);
    }
    return PoseSpline(begin_, profile_.knot_interval, std::move(controls));
  }

 private:
  MotionProfile profile_;
  Eigen::Quaterniond R_carrier_body_;
  Time begin_;
  RandomStream random_;
  Walker walker_;
  std::vector<Oscillation> gait_, shaking_, vibration_;
  double envelope_phase_ = 0.0;
};

}  // namespace

MotionProfile EasyMotion() { return {}; }

MotionProfile MediumMotion() {
  return {.speed = 1.3,
          .knot_interval = Duration::FromMilliseconds(25),
          .look_around = 0.25,
          .heading_smoothing = 0.8,
          .peak_rate = 1.7,
          .peak_acceleration = 5.0};
}

MotionProfile HardMotion() {
  return {.speed = 1.4,
          .knot_interval = Duration::FromMilliseconds(25),
          .look_around = 0.35,
          .heading_smoothing = 0.6,
          .peak_rate = 3.5,
          .peak_acceleration = 9.0};
}

MotionProfile StairsMotion() {
  return {.speed = 1.0, .heading_smoothing = 0.6, .stair_slowing = 1.0, .stair_bob = 1.0};
}

MotionProfile SurveyMotion() {
  return {.speed = 0.8,
          .knot_interval = Duration::FromMilliseconds(25),
          .look_around = 0.35,
          .heading_smoothing = 0.7,
          .peak_rate = 2.5,
          .peak_acceleration = 4.5,
          .calm = 0.1,
          .burst_sharpness = 8,
          .stair_slowing = 0.6,
          .stair_bob = 1.0,
          .pause_every = 25.0,
          .pause = 2.0};
}

MotionProfile HastySurveyMotion() {
  MotionProfile profile = SurveyMotion();
  profile.look_around = 0.45;
  profile.burst_sharpness = 12;
  profile.peak_rate = 4.6;
  profile.peak_acceleration = 8.0;
  profile.pause_every = 0.0;
  return profile;
}

MotionProfile RobotMotion() {
  return {.speed = 0.85,
          .knot_interval = Duration::FromMilliseconds(20),
          .look_around = 0.0,
          .heading_smoothing = 0.8,
          .turns_at_rest = false,
          .gait = 0.0,
          .vibration = 0.4,
          .pause_every = 28.0,
          .pause = 3.0};
}

MotionProfile SlowRobotMotion() {
  MotionProfile profile = RobotMotion();
  profile.speed = 0.75;
  return profile;
}

PoseSpline MakeWalk(const WalkingPath& path, const MotionProfile& profile,
                    const Eigen::Quaterniond& R_carrier_body, Time begin, double seconds,
                    std::uint64_t seed) {
  const WalkMaker maker(path, profile, R_carrier_body, begin, seconds, seed);
  ShakingScale scale{.turn = profile.peak_rate > 0.0 ? 1.0 : 0.0,
                     .shift = profile.peak_acceleration > 0.0 ? 1.0 : 0.0};
  PoseSpline spline = maker.Make(scale);
  if (scale.turn == 0.0 && scale.shift == 0.0) return spline;
  constexpr int kRounds =
      5;  // peaks grow nearly in proportion to the scale: a few secant-like steps meet them
  for (int round = 0; round < kRounds; ++round) {
    const MotionStatistics motion = MeasureMotion(spline, spline.begin(), spline.end());
    if (motion.max_rate == 0.0 || motion.max_acceleration == 0.0)
      break;  // shorter than the initial rest
    scale.turn *= profile.peak_rate / motion.max_rate;
    scale.shift *= profile.peak_acceleration / motion.max_acceleration;
    spline = maker.Make(scale);
  }
  return spline;
}

MotionStatistics MeasureMotion(const PoseSpline& spline, Time from, Time to) {
  std::vector<double> rates;
  MotionStatistics result;
  for (Time t = from; t <= to; t = t + Duration::FromMilliseconds(5)) {
    const MotionSample sample = spline.At(t);
    rates.push_back(sample.angular_velocity.norm());
    result.mean_rate += rates.back();
    result.mean_speed += sample.velocity.norm();
    result.max_acceleration = std::max(result.max_acceleration, sample.acceleration.norm());
  }
  if (rates.empty()) return result;
  std::sort(rates.begin(), rates.end());
  const auto n = static_cast<double>(rates.size());
  result.mean_rate /= n;
  result.mean_speed /= n;
  result.p95_rate = rates[static_cast<std::size_t>(0.95 * (n - 1.0))];
  result.max_rate = rates.back();
  return result;
}

}  // namespace mlvi
