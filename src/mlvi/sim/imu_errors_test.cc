// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/imu_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

PoseSpline AtRest(double seconds) {
  const auto knots = static_cast<std::size_t>(seconds) + 4;
  return PoseSpline(Time::FromNanoseconds(0), Duration::FromSeconds(1.0),
                    std::vector<Pose3>(knots, Pose3(ExpSo3({0.3, -0.2, 1.0}), {1.0, 2.0, 3.0})));
}

double RootMeanSquare(const std::vector<Vector6d>& values, bool rates) {
  double sum = 0.0;
  for (const Vector6d& v : values)
    sum += rates ? v.tail<3>().squaredNorm() : v.head<3>().squaredNorm();
  return std::sqrt(sum / (3.0 * static_cast<double>(values.size())));
}

// Share of the power of the first axis within [low, high] Hz, by a plain discrete Fourier transform
// of segments of one second (Hann window).
double PowerWithin(const std::vector<Vector6d>& values, int rate_hz, double low, double high) {
  const auto n = static_cast<std::size_t>(rate_hz);
  double inside = 0.0, all = 0.0;
  for (std::size_t first = 0; first + n <= values.size(); first += n) {
    for (int f = 1; f < rate_hz / 2; ++f) {
      std::complex<double> sum = 0.0;
      for (std::size_t k = 0; k < n; ++k) {
        const double share = static_cast<double>(k) / static_cast<double>(n);
        const double window = std::pow(std::sin(std::numbers::pi * share), 2);
        sum += window * values[first + k][0] *
               std::polar(1.0, -2.0 * std::numbers::pi * share * static_cast<double>(f));
      }
      all += std::norm(sum);
      if (f >= low && f <= high) inside += std::norm(sum);
    }
  }
  return inside / all;
}

// Variances of m modes, each of weight 1 / m and correlated over the decay d, on 3 axes for T
// seconds have a relative variance of d / (3 m T): five sigma of the root, half of that.
TEST(ImuVibration, IsAsStrongAsAskedForAtAnyRate) {
  const ImuVibration vibration{.acceleration = 0.3, .rate = 0.02};
  const double seconds = 300.0;
  const double tolerance = 2.5 * std::sqrt(kVibrationDecay / (3.0 * kVibrationModes * seconds));
  for (const double rate_hz : {100.0, 150.0, 400.0}) {
    const auto values = MakeVibration(vibration, rate_hz,
                                      static_cast<std::size_t>(seconds * rate_hz), RandomStream(5));
    EXPECT_NEAR(RootMeanSquare(values, false) / 0.3, 1.0, tolerance) << rate_hz;
    EXPECT_NEAR(RootMeanSquare(values, true) / 0.02, 1.0, tolerance) << rate_hz;
  }
  EXPECT_TRUE(MakeVibration({}, 200.0, 10, RandomStream(1)).empty());
}

// A Lorentzian of half width 1 / (2 pi d) = 0.64 Hz holds 86 % of its power within 3 Hz.
TEST(ImuVibration, HasItsFrequenciesAndFoldsWhatIsTooFast) {
  const auto spectrum = [](double frequency, int rate_hz) {
    const ImuVibration vibration{
        .acceleration = 0.3, .rate = 0.0, .lowest = frequency, .highest = frequency};
    return MakeVibration(vibration, rate_hz, static_cast<std::size_t>(20 * rate_hz),
                         RandomStream(7));
  };
  EXPECT_GT(PowerWithin(spectrum(60.0, 400), 400, 57.0, 63.0), 0.8);
  EXPECT_GT(PowerWithin(spectrum(120.0, 400), 400, 117.0, 123.0), 0.8);
  // 120 Hz at 200 samples a second look like 80, at 100 like 20.
  EXPECT_GT(PowerWithin(spectrum(120.0, 200), 200, 77.0, 83.0), 0.8);
  EXPECT_GT(PowerWithin(spectrum(120.0, 100), 100, 17.0, 23.0), 0.8);
  const auto band = MakeVibration({.acceleration = 0.3}, 400.0, 8000, RandomStream(8));
  EXPECT_GT(PowerWithin(band, 400, 17.0, 123.0), 0.8);
}

ImuSimulator AtRestWith(const ImuErrors& errors, const PoseSpline& motion,
                        const ImuNoise& noise = {}) {
  return ImuSimulator({.rate_hz = 200.0, .noise = noise, .errors = errors}, motion, motion.begin(),
                      motion.end(), RandomStream(11));
}

TEST(ImuWarmUp, BiasesSettleAtWhatIsStated) {
  const PoseSpline motion = AtRest(60.0);
  const ImuSimulator cold = AtRestWith({}, motion);
  const ImuSimulator warming = AtRestWith(
      {.warm_up = {.accelerometer = 0.05, .gyroscope = 2e-3, .time_constant = 10.0}}, motion);
  const auto moved = [&](double seconds) {
    const Time time = motion.begin() + Duration::FromSeconds(seconds);
    const ImuBias a = warming.BiasAt(time), b = cold.BiasAt(time);
    return Eigen::Vector2d((a.accelerometer - b.accelerometer).norm() / 0.05,
                           (a.gyroscope - b.gyroscope).norm() / 2e-3);
  };
  EXPECT_EQ(moved(0.0).norm(), 0.0);
  for (const double seconds : {5.0, 10.0, 30.0, 60.0}) {
    for (const double share : moved(seconds))
      EXPECT_NEAR(share, 1.0 - std::exp(-seconds / 10.0), 1e-9) << seconds;
  }
  // What the samples hold is what the truth says.
  const std::size_t last = warming.size() - 1;
  const ImuSample a = warming.Sample(last), b = cold.Sample(last);
  const Eigen::Vector3d truth = warming.BiasAt(a.stamp).gyroscope - cold.BiasAt(b.stamp).gyroscope;
  EXPECT_LT((a.angular_velocity - b.angular_velocity - truth).norm(), 1e-12);
}

TEST(ImuSensitivity, MultipliesWhatIsMeasured) {
  RandomStream random(3);
  double largest = 0.0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3d error = DrawSensitivity(0.01, random) - Eigen::Matrix3d::Identity();
    ASSERT_LE(error.cwiseAbs().maxCoeff(), 0.01 + 1e-15);
    largest = std::max(largest, error.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(largest, 0.0095);  // 450 uniform numbers: all are smaller once in 10^10 times

  const PoseSpline motion = AtRest(4.0);
  const ImuSimulator good = AtRestWith({}, motion);
  const ImuSimulator bad =
      AtRestWith({.sensitivity = {.accelerometer = 0.02, .gyroscope = 0.01}}, motion);
  const Eigen::Vector3d force =
      motion.PoseAt(motion.begin()).rotation().conjugate() * Eigen::Vector3d(0.0, 0.0, 9.81);
  const Eigen::Vector3d change =
      bad.Sample(9).linear_acceleration - good.Sample(9).linear_acceleration;
  const Eigen::Matrix3d error = bad.accelerometer_sensitivity() - Eigen::Matrix3d::Identity();
  EXPECT_GT(change.norm(), 0.01);
  EXPECT_LT((change - error * force).norm(), 1e-12);
}

// Without errors a sample is, to the last bit, motion, bias and noise from their own streams.
TEST(ImuErrors, NoneLeaveTheBitsAsTheyWere) {
  const ImuNoise noise{1.1e-3, 2.3e-4, 3.4e-5, 8.3e-6};
  const PoseSpline motion = AtRest(2.0);
  const ImuSimulator imu = AtRestWith({}, motion, noise);
  const Eigen::Vector3d gravity(0.0, 0.0, -9.81);
  RandomStream walk = RandomStream(11).Fork(1);
  const auto vector = [](RandomStream& random, double scale) {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    return Eigen::Vector3d(scale * x, scale * y, scale * z);
  };
  const auto uniform = [&](double limit) {
    const double x = walk.Uniform(-limit, limit), y = walk.Uniform(-limit, limit),
                 z = walk.Uniform(-limit, limit);
    return Eigen::Vector3d(x, y, z);
  };
  const double root_dt = std::sqrt(1.0 / 200.0), root_rate = std::sqrt(200.0);
  Eigen::Vector3d accelerometer = uniform(0.1), gyroscope = uniform(0.006);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const ImuSample sample = imu.Sample(i);
    const MotionSample at = motion.At(sample.stamp);
    RandomStream random = RandomStream(11).Fork(0).Fork(i);
    const Eigen::Vector3d rate =
        at.angular_velocity + gyroscope + vector(random, 2.3e-4 * root_rate);
    const Eigen::Vector3d force =
        at.T_world_body.rotation().conjugate() * (at.acceleration - gravity) + accelerometer +
        vector(random, 1.1e-3 * root_rate);
    ASSERT_EQ(sample.angular_velocity, rate) << i;
    ASSERT_EQ(sample.linear_acceleration, force) << i;
    accelerometer += vector(walk, 3.4e-5 * root_dt);
    gyroscope += vector(walk, 8.3e-6 * root_dt);
  }
}

// Allan deviation of the gyroscope's x axis at `cluster` samples, from adjacent means.
double AllanDeviation(const ImuSimulator& imu, std::size_t cluster) {
  double sum = 0.0, last = 0.0;
  const std::size_t clusters = imu.size() / cluster;
  for (std::size_t i = 0; i < clusters; ++i) {
    double mean = 0.0;
    for (std::size_t k = 0; k < cluster; ++k)
      mean += imu.Sample(i * cluster + k).angular_velocity.x() / static_cast<double>(cluster);
    if (i > 0) sum += 0.5 * (mean - last) * (mean - last);
    last = mean;
  }
  return std::sqrt(sum / static_cast<double>(clusters - 1));
}

// White noise of density N has the Allan deviation N / sqrt(tau); differences of neighbours are
// correlated, which widens the estimate's 1 / sqrt(2 n) by sqrt(3 / 2). Vibration is loud at once
// and averages out within a second, as the walk of an angle does not grow by it.
TEST(ImuErrors, AllanDeviationIsThatOfTheWhiteNoise) {
  const ImuNoise noise{.gyroscope_density = 2e-3};
  const PoseSpline motion = AtRest(200.0);
  const ImuSimulator quiet = AtRestWith({}, motion, noise);
  for (const std::size_t cluster : {1U, 20U, 100U}) {
    const double tau = static_cast<double>(cluster) / 200.0;
    const double tolerance = 5.0 * std::sqrt(0.75 / (200.0 / tau));
    EXPECT_NEAR(AllanDeviation(quiet, cluster) * std::sqrt(tau) / 2e-3, 1.0, tolerance) << tau;
  }
  const ImuSimulator shaken = AtRestWith({.vibration = {.rate = 0.1}}, motion, noise);
  EXPECT_GT(AllanDeviation(shaken, 1), 2.0 * AllanDeviation(quiet, 1));
  EXPECT_LT(AllanDeviation(shaken, 200), 1.5 * AllanDeviation(quiet, 200));
}

TEST(ImuErrors, SameSeedSameBits) {
  const ImuErrors errors{.vibration = {.acceleration = 0.3, .rate = 0.02},
                         .warm_up = {.accelerometer = 0.02, .gyroscope = 1e-3},
                         .sensitivity = {.accelerometer = 0.005, .gyroscope = 0.01}};
  const PoseSpline motion = AtRest(5.0);
  const ImuSimulator one = AtRestWith(errors, motion), two = AtRestWith(errors, motion);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {  // in another order
    const std::size_t k = (37 * i) % one.size();
    ASSERT_EQ(one.Sample(k).angular_velocity, two.Sample(k).angular_velocity);
    ASSERT_EQ(one.Sample(k).linear_acceleration, two.Sample(k).linear_acceleration);
  }
}

TEST(ImuErrors, HardMotionsHaveThemCalmOnesDoNot) {
  for (const char* name : {"quad-hard", "math-hard", "undermine-hard", "stairs"})
    EXPECT_TRUE(HasErrors(StandardSequence(name, test::NewerCollege()).imu_errors)) << name;
  for (const char* name : {"courtyard-hard", "corridor-hard", "quad-easy", "cloister"})
    EXPECT_FALSE(HasErrors(StandardSequence(name, test::NewerCollege()).imu_errors)) << name;
}

// Where the IMU is as bad as a real one, the estimator is told the noise of the rig's file.
TEST(ImuErrors, EstimatorIsToldTheNoiseOfTheFile) {
  Rig rig = test::NewerCollege();
  rig.imu.noise = {0.019, 0.002, 0.0043, 4e-6};
  SequenceOptions options = StandardSequence("stairs", rig, 1.0);
  EXPECT_EQ(Recording(options).rig().imu.noise.gyroscope_density, 0.002);
  options.imu_errors = {};
  EXPECT_EQ(Recording(options).rig().imu.noise.gyroscope_density, 2.0 * 2.3e-4);
  options.faults.imu_vibration = ImuVibration{.rate = 0.01};
  EXPECT_EQ(Recording(options).rig().imu.noise.gyroscope_density, 0.002);
}

TEST(ImuErrors, RefusedNumbersAreNamed) {
  const auto message = [](const ImuErrors& errors) {
    const auto ok = CheckImuErrors(errors);
    return ok ? std::string() : ok.error().message;
  };
  EXPECT_EQ(message({}), "");
  EXPECT_THAT(message({.vibration = {.acceleration = -1.0}}), HasSubstr("is -1 m/s^2"));
  EXPECT_THAT(message({.vibration = {.rate = std::nan("")}}), HasSubstr("rate of the IMU's vib"));
  EXPECT_THAT(message({.vibration = {.lowest = 50.0, .highest = 40.0}}), HasSubstr("[50, 10000]"));
  EXPECT_THAT(message({.warm_up = {.time_constant = 0.0}}), HasSubstr("time constant"));
  EXPECT_THAT(message({.sensitivity = {.gyroscope = 0.5}}), HasSubstr("gyroscope's scale is 0.5"));
}

}  // namespace
}  // namespace mlvi
