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

double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

// The walker without oscillations: where, heading where, and how much in motion, at every control
// instant.
struct Walker {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> headings;
  std::vector<double> activity;  // 0 at rest .. 1
};

Walker Walk(const WalkingPath& path, const MotionProfile& profile, std::size_t controls) {
  const double dt = profile.knot_interval.seconds();
  Walker walker;
  double s = 0.0;
  for (std::size_t i = 0; i < controls; ++i) {
    const double t = dt * (static_cast<double>(i) - 1.0);
    const double activity =
        profile.rest > 0.0 ? SmoothStep((t - profile.rest) / kStartSeconds) : 1.0;
    const PathPoint at = path.At(s);
    walker.positions.push_back(at.position);
    walker.headings.push_back(at.heading);
    walker.activity.push_back(activity);
    s += profile.speed * activity / (1.0 + 0.6 * at.curvature) * dt;  // slower in bends
  }
  walker.headings = SmoothOpen(walker.headings, profile.heading_smoothing / dt);
  return walker;
}

// Bursts: shaking swells and fades within some seconds.
double Envelope(double t, double phase) {
  const double wave = std::sin(2.0 * std::numbers::pi * t / 7.0 + phase);
  return 0.3 + 0.7 * wave * wave;
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
  }

  PoseSpline Make(const ShakingScale& scale) const {
    std::vector<Pose3> controls;
    for (std::size_t i = 0; i < walker_.positions.size(); ++i) {
      const double t = profile_.knot_interval.seconds() * (static_cast<double>(i) - 1.0);
      const Offset gait = Sum(gait_, t), shaking = Sum(shaking_, t);
      const double burst = Envelope(t, envelope_phase_), activity = walker_.activity[i];
      const Eigen::Vector3d shift = activity * (gait.shift + burst * scale.shift * shaking.shift);
      const Eigen::Vector3d turn = activity * (gait.turn + burst * scale.turn * shaking.turn);
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
  std::vector<Oscillation> gait_, shaking_;
  double envelope_phase_ = 0.0;
};

}  // namespace

MotionProfile EasyMotion() { return {}; }

MotionProfile HardMotion() {
  return {.speed = 1.4,
          .knot_interval = Duration::FromMilliseconds(25),
          .look_around = 0.35,
          .heading_smoothing = 0.6,
          .peak_rate = 3.5,
          .peak_acceleration = 9.0};
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
