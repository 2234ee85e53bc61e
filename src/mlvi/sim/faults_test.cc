// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

// A camera that takes images, for faults of it.
Rig WithACamera() {
  Rig rig = test::Hilti();
  rig.cameras.resize(1);
  rig.cameras[0].name = "cam0";
  rig.cameras[0].rate_hz = 40.0;
  return rig;
}

struct Heard {
  std::vector<ImuSample> imu;
  std::vector<Time> sweeps;
  int corrupted = 0;
};

Heard Listen(Recording& recording) {
  Heard heard;
  while (auto measurement = recording.Next().value()) {
    heard.corrupted += recording.IsCorrupted(*measurement);
    if (const auto* imu = std::get_if<ImuSample>(&*measurement)) heard.imu.push_back(*imu);
    if (const auto* sweep = std::get_if<LidarSweep>(&*measurement))
      heard.sweeps.push_back(sweep->stamp);
  }
  return heard;
}

TEST(Faults, ClocksAreLateAndDrift) {
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr(), 2.0);
  options.faults.clocks["imu"] = {.offset = 0.004, .drift_ppm = 1000.0};
  options.faults.clocks["lidar"] = {.offset = -0.01};
  Recording recording(options, RecordingForm::kMessages);
  const Heard heard = Listen(recording);
  for (std::size_t i = 0; i < heard.imu.size(); ++i) {
    const double t = static_cast<double>(i) / 150.0;
    EXPECT_NEAR((heard.imu[i].stamp - recording.begin()).seconds(), t + 0.004 + 1e-3 * t, 1e-8);
  }
  for (std::size_t i = 0; i < heard.sweeps.size(); ++i)
    EXPECT_NEAR((heard.sweeps[i] - recording.begin()).seconds(), 0.1 * i - 0.01, 1e-8);
}

// Late by less than the jitter, evenly, and never out of order.
TEST(Faults, StampsOfArrivalJitter) {
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr(), 10.0);
  options.clocks["imu"] = {.offset = 0.004, .jitter = 0.002};
  options.faults.clocks["lidar"] = {.jitter = 0.05};
  Recording recording(options, RecordingForm::kMessages);
  const Heard heard = Listen(recording);
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < heard.imu.size(); ++i) {
    const double t = static_cast<double>(i) / 150.0,
                 late = (heard.imu[i].stamp - recording.begin()).seconds() - t - 0.004;
    ASSERT_GE(late, -1e-8);
    ASSERT_LE(late, 0.002 + 1e-8);
    if (i > 0) {
      ASSERT_GT(heard.imu[i].stamp, heard.imu[i - 1].stamp);
    }
    sum += late, squares += late * late;
  }
  const auto n = static_cast<double>(heard.imu.size());
  // Uniform: mean J / 2, variance J^2 / 12; 5 sigma of 1500 samples.
  EXPECT_NEAR(sum / n, 0.001, 5.0 * 0.002 / std::sqrt(12.0 * n));
  EXPECT_NEAR(squares / n, 0.002 * 0.002 / 3.0, 0.15 * 0.002 * 0.002 / 3.0);
  for (std::size_t i = 1; i < heard.sweeps.size(); ++i)
    EXPECT_GT(heard.sweeps[i], heard.sweeps[i - 1]);
  options.clocks["imu"].jitter = 0.008;  // longer than a sample
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("the jitter of the clock of imu"));
}

TEST(Faults, SmallImusSaturate) {
  SequenceOptions options = StandardSequence("courtyard-hard", test::NewerCollege(), 15.0);
  options.faults.imu_saturation = ImuSaturation{.acceleration = 10.0, .rate = 1.0};
  const Recording recording(options);
  std::size_t clipped = 0;
  for (std::size_t i = 0; i < recording.imu().size(); ++i) {
    const ImuSample sample = recording.imu().Sample(i);
    ASSERT_LE(sample.linear_acceleration.cwiseAbs().maxCoeff(), 10.0);
    ASSERT_LE(sample.angular_velocity.cwiseAbs().maxCoeff(), 1.0);
    clipped += sample.angular_velocity.cwiseAbs().maxCoeff() == 1.0;
  }
  EXPECT_GT(clipped, recording.imu().size() / 100);  // the motion goes up to 3.5 rad/s
}

TEST(Faults, CorruptedMessagesAreWrittenButNotDelivered) {
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr(), 1.0);
  options.faults.corrupted_sweeps = FaultWindow{.start = 0.25, .length = 0.3};
  options.faults.corrupted_imu = FaultWindow{.start = 0.1, .length = 0.1};
  options.faults.nan_imu = FaultWindow{.start = 0.7, .length = 0.2};
  Recording messages(options, RecordingForm::kMessages), measurements(options);
  const Heard written = Listen(messages), delivered = Listen(measurements);
  EXPECT_EQ(written.sweeps.size(), 10U);
  EXPECT_EQ(written.corrupted, 3 + 15);  // 150 samples per second
  EXPECT_EQ(delivered.sweeps.size(), 7U);
  EXPECT_EQ(measurements.Counts().at("/points").dropped.at("unreadable message"), 3);
  const auto is_nan = [](const ImuSample& sample) {
    return sample.linear_acceleration.hasNaN() && sample.angular_velocity.hasNaN();
  };
  EXPECT_EQ(std::ranges::count_if(written.imu, is_nan), 30);
  EXPECT_EQ(std::ranges::count_if(delivered.imu, is_nan), 0);
  EXPECT_EQ(delivered.imu.size() + 45, written.imu.size());
}

TEST(Faults, ExtrinsicsAreOffByWhatWasOrdered) {
  Rig rig = test::Hilti();
  rig.cameras.resize(2);
  const ExtrinsicsError error{.rotation = 0.02, .translation = 0.03};
  const SimulatedRig simulated = MakeSimulatedRig(rig, error, 5);
  const auto expect_off = [&](const Pose3& truth, const Pose3& told) {
    EXPECT_NEAR(truth.rotation().angularDistance(told.rotation()), 0.02, 1e-9);
    EXPECT_NEAR((truth.translation() - told.translation()).norm(), 0.03, 1e-12);
  };
  expect_off(simulated.true_rig.lidar->T_body_lidar, simulated.estimator_rig.lidar->T_body_lidar);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_off(simulated.true_rig.cameras[i].T_body_camera,
               simulated.estimator_rig.cameras[i].T_body_camera);
  }
}

TEST(Faults, LensPatchesDarkenWhatLiesBehindThemOnly) {
  Image image{.width = 100, .height = 80, .pixels = std::vector<std::uint8_t>(8000, 200)};
  SmearLens({.camera = "cam0", .u = 0.5, .v = 0.5, .radius = 0.1}, 1, image);
  EXPECT_EQ(image.pixels[40 * 100 + 50], 100);  // half, in the middle
  EXPECT_EQ(image.pixels[40 * 100 + 61], 200);
  EXPECT_EQ(image.pixels[0], 200);
}

// Every pixel against its own box, of a patch that reaches beyond the image.
TEST(Faults, LensPatchesBlurAsTheirBoxesDo) {
  constexpr int kWidth = 40, kHeight = 30, kChannels = 3, kReach = 6;
  Image image{.width = kWidth, .height = kHeight, .channels = kChannels};
  RandomStream random(1, "pixels");
  for (int i = 0; i < kWidth * kHeight * kChannels; ++i)
    image.pixels.push_back(static_cast<std::uint8_t>(random.Uniform(0.0, 255.99)));
  const Image before = image;
  const auto at = [](const Image& of, int x, int y, int c) {
    return of.pixels[static_cast<std::size_t>((y * kWidth + x) * kChannels + c)];
  };
  SmearLens({.camera = "cam0", .u = 0.3, .v = 0.4, .radius = 1.0}, kChannels, image);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double share = std::hypot(x - 0.3 * kWidth, y - 0.4 * kHeight) / kWidth;
      const double strength = std::min(1.0, 2.0 * (1.0 - share));
      for (int c = 0; c < kChannels; ++c) {
        double sum = 0.0;
        int count = 0;
        for (int j = std::max(0, y - kReach); j <= std::min(kHeight - 1, y + kReach); ++j) {
          for (int i = std::max(0, x - kReach); i <= std::min(kWidth - 1, x + kReach); ++i, ++count)
            sum += at(before, i, j, c);
        }
        ASSERT_EQ(at(image, x, y, c), std::lround((1.0 - strength) * at(before, x, y, c) +
                                                  strength * 0.5 * sum / count));
      }
    }
  }
}

TEST(Faults, WhatCannotHappenIsRefused) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithACamera(), 5.0);
  options.cameras = {"cam0"};
  const auto refusal = [](SequenceOptions faulty, auto spoil) {
    spoil(faulty.faults, faulty);
    const auto checked = CheckOptions(faulty);
    return checked ? std::string() : checked.error().message;
  };
  using F = SequenceFaults;
  using O = SequenceOptions;
  const auto late = [](F& f, O&) { f.lidar_gap = {100.0, 5.0}; };
  const auto soon = [](F& f, O&) { f.lidar_gap = {4.0, 5.0}; };
  EXPECT_THAT(refusal(options, late), AllOf(HasSubstr("100 s"), HasSubstr("after 5 s")));
  EXPECT_EQ(refusal(options, soon), "");
  const auto dead = [](F& f, O&) { f.cameras = {{.camera = "cam0", .window = {1.0, 1.0}}}; };
  const auto corrupted = [](F& f, O&) {
    f.cameras = {{.camera = "cam0", .failure = CameraFailure::kCorrupted, .window = {1.0, 1.0}}};
  };
  const auto patch = [](F& f, O&) { f.lens_patches = {{.camera = "cam0"}}; };
  const auto dark = [](F& f, O&) { f.lights_off = {1.0, 1.0}; };
  const auto clock = [](F& f, O&) { f.clocks["cam0"] = {.offset = 0.1}; };
  for (const auto& fault : {+dead, +corrupted, +patch, +dark, +clock}) {
    EXPECT_EQ(refusal(options, fault), "");
    EXPECT_THAT(refusal(options,
                        [&](F& f, O& o) {
                          fault(f, o);
                          o.cameras.clear();
                        }),
                HasSubstr("no camera"));
  }
}

// As much jitter as stamps can bear, at the rate at which images are really taken and by a clock
// that loses time; more is refused.
TEST(Faults, StampsAscendWhateverJitterIsAccepted) {
  const Rig rig = WithACamera();  // 40 Hz
  for (const double rate : {10.0, 40.0, 60.0}) {
    for (const double drift_ppm : {-1e5, 0.0, 1e5}) {
      const double period = (1.0 + 1e-6 * drift_ppm) / rate;
      const Clocks clocks = {{"cam0", {.drift_ppm = drift_ppm, .jitter = 0.9999 * period}}};
      EXPECT_TRUE(CheckClocks(clocks, rig, rate)) << rate << " Hz, " << drift_ppm << " ppm";
      EXPECT_FALSE(
          CheckClocks({{"cam0", {.drift_ppm = drift_ppm, .jitter = 1.001 * period}}}, rig, rate));
      double last = -1.0;
      for (std::size_t i = 0; i < 2000; ++i) {
        const double seconds = static_cast<double>(i) / rate;
        const double stamp =
            seconds +
            StampError(clocks, "cam0", seconds, RandomStream(1, "stamps").Fork(i)).seconds();
        ASSERT_GT(stamp, last) << rate << " Hz, " << drift_ppm << " ppm, image " << i;
        last = stamp;
      }
    }
  }
}

// TrueSeconds undoes what the clock adds, up to its jitter about the mean.
TEST(Faults, ClocksCanBeRead) {
  const Clocks clocks = {{"lidar", {.offset = -0.3, .drift_ppm = 2e4, .jitter = 0.01}}};
  for (const double t : {0.0, 1.0, 77.7}) {
    const double shown = t + MeanStampError(clocks, "lidar", t);
    EXPECT_NEAR(TrueSeconds(clocks, "lidar", shown), t, 1e-9);
    EXPECT_EQ(TrueSeconds(clocks, "imu", t), t);
    for (std::size_t i = 0; i < 20; ++i) {
      const double once =
          t + StampError(clocks, "lidar", t, RandomStream(2, "stamps").Fork(i)).seconds();
      EXPECT_NEAR(TrueSeconds(clocks, "lidar", once), t, 0.005);
    }
  }
}

TEST(Faults, UnknownSensorsAreNamed) {
  SequenceOptions options = StandardSequence("courtyard-easy", WithACamera());
  options.cameras = {"cam0"};
  options.faults.cameras.push_back({.camera = "cam7", .window = {.start = 1.0, .length = 2.0}});
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("'cam7'"));
  options.faults.cameras[0].camera = "cam0";
  EXPECT_TRUE(CheckOptions(options).has_value());
  EXPECT_EQ(FailureOf(options.faults, "cam0", 1.5), CameraFailure::kDead);
  EXPECT_EQ(FailureOf(options.faults, "cam0", 3.5), std::nullopt);
  options.faults.clocks["ium"] = {};
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("'ium'"));
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("it has cam0, imu, lidar"));
}

// Every number of every fault, not finite in turn.
TEST(Faults, NumbersThatAreNoneAreRefused) {
  SequenceOptions good = StandardSequence("courtyard-easy", WithACamera());
  good.cameras = {"cam0"};
  good.faults.lidar_gap = good.faults.empty_sweeps = good.faults.nan_points =
      good.faults.corrupted_sweeps = good.faults.imu_gap = good.faults.nan_imu =
          good.faults.corrupted_imu = good.faults.image_gap = good.faults.lights_off =
              FaultWindow{1.0, 2.0};
  good.faults.imu_saturation = ImuSaturation{50.0, 5.0};
  good.faults.imu_vibration = ImuVibration{0.1, 0.01};
  good.faults.imu_warm_up = ImuWarmUp{0.1, 0.01, 60.0};
  good.faults.imu_sensitivity = ImuSensitivity{0.01, 0.01};
  good.faults.exposure_jump = ExposureJump{.window = {1.0, 2.0}, .factor = 2.0};
  good.faults.time_jump = TimeJump{1.0, 2.0};
  good.faults.extrinsics = ExtrinsicsError{0.01, 0.01};
  good.faults.clocks["imu"] = {.offset = -0.1, .drift_ppm = 10.0, .jitter = 1e-3};
  ASSERT_TRUE(CheckOptions(good)) << CheckOptions(good).error().message;
  const auto numbers = [](SequenceOptions& options) {
    SequenceFaults& f = options.faults;
    std::vector<double*> all = {&options.seconds,
                                &options.rest,
                                &f.imu_saturation->rate,
                                &f.imu_saturation->acceleration,
                                &f.imu_vibration->acceleration,
                                &f.imu_vibration->rate,
                                &f.imu_vibration->lowest,
                                &f.imu_vibration->highest,
                                &f.imu_warm_up->accelerometer,
                                &f.imu_warm_up->gyroscope,
                                &f.imu_warm_up->time_constant,
                                &f.imu_sensitivity->accelerometer,
                                &f.imu_sensitivity->gyroscope,
                                &f.exposure_jump->factor,
                                &f.time_jump->start,
                                &f.time_jump->back,
                                &f.extrinsics->rotation,
                                &f.extrinsics->translation,
                                &f.clocks["imu"].offset,
                                &f.clocks["imu"].drift_ppm,
                                &f.clocks["imu"].jitter};
    for (FaultWindow* window : {&*f.lidar_gap, &*f.empty_sweeps, &*f.nan_points,
                                &*f.corrupted_sweeps, &*f.imu_gap, &*f.nan_imu, &*f.corrupted_imu,
                                &*f.image_gap, &*f.lights_off, &f.exposure_jump->window}) {
      all.insert(all.end(), {&window->start, &window->length});
    }
    return all;
  };
  for (std::size_t i = 0; i < numbers(good).size(); ++i) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1e10}) {
      SequenceOptions options = good;
      *numbers(options)[i] = bad;
      EXPECT_FALSE(CheckOptions(options)) << "number " << i << " is " << bad;
    }
  }
}

// Real samples pass as they are, moved to the recording's clock, with the biases that are known.
TEST(Recording, PlaysRecordedImuSamples) {
  std::vector<Time> stamps;
  std::vector<Pose3> poses;
  SequenceOptions options = StandardSequence("courtyard-easy", test::M2dgr());
  const Time start = Time::FromNanoseconds(5'000'000'000LL);
  for (int i = 0; i <= 40; ++i) {
    stamps.push_back(start + Duration::FromMilliseconds(50 * i));
    poses.push_back(Pose3::FromTranslation({0.01 * i, 0.0, 0.0}));
  }
  for (int i = 0; i < 500; ++i) {  // from 0.2 s before the motion
    options.recorded_imu.samples.push_back(
        {.stamp = start + Duration::FromMilliseconds(5 * (i - 40)),
         .angular_velocity = {0.001 * i, 0.0, 0.0}});
  }
  options.recorded_imu.biases = {{start + Duration::FromSeconds(1.0), {.gyroscope = {1, 2, 3}}}};
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("trajectory"));
  options.trajectory = FitPoseSpline(stamps, poses).value();
  Recording recording(options);
  options.faults.imu_vibration = ImuVibration{0.1, 0.01};
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("played as they are"));
  const Heard heard = Listen(recording);
  ASSERT_EQ(heard.imu.size(), 401U);
  EXPECT_EQ(heard.imu.front().stamp, recording.begin());
  EXPECT_DOUBLE_EQ(heard.imu.front().angular_velocity.x(), 0.04);
  EXPECT_DOUBLE_EQ(heard.imu.back().angular_velocity.x(), 0.44);
  EXPECT_EQ(recording.GroundTruth(recording.end()).bias.gyroscope, Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace mlvi
