// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Cameras in a textured room, rendered from the formula: tracks against the points that they
// started at.
#include "mlvi/panorama/panoramic_tracker.h"

#include <gtest/gtest.h>

#include <map>

#include "mlvi/base/parallel.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

// The walls of a room of 8 x 6 x 3 m; grey values are waves in space, wavelengths 0.15 to 1.5 m.
class Room {
 public:
  Room() {
    RandomStream random(1, "room");
    for (int i = 0; i < kWaves; ++i) {
      const double length = 0.15 * std::pow(10.0, random.Uniform());
      waves_.push_back(2.0 * M_PI / length * test::RandomDirection(random));
      phases_.push_back(2.0 * M_PI * random.Uniform());
    }
  }
  Eigen::Vector3d Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Array3d low(-4.0, -3.0, -1.5), high(4.0, 3.0, 1.5);
    const Eigen::Array3d inverse = direction.array().inverse();
    const double range =
        ((low - origin.array()) * inverse).max((high - origin.array()) * inverse).minCoeff();
    return origin + range * direction;
  }
  double Grey(const Eigen::Vector3d& p) const {
    double value = 128.0;
    for (std::size_t i = 0; i < waves_.size(); ++i) {
      value += 14.0 * std::sin(waves_[i].dot(p) + phases_[i]);
    }
    return value;
  }

 private:
  static constexpr int kWaves = 20;
  std::vector<Eigen::Vector3d> waves_;
  std::vector<double> phases_;
};

Image Render(const Room& room, const PanoramaModel& model, int camera, const Pose3& T_world_pano,
             double noise, RandomStream random) {
  const CameraModel& lens = model.camera(camera);
  const Pose3 T_world_camera = T_world_pano * model.T_pano_camera(camera);
  Image image{.camera = camera, .width = lens.width(), .height = lens.height()};
  image.pixels.resize(static_cast<std::size_t>(image.width) *
                      static_cast<std::size_t>(image.height));
  ParallelFor(static_cast<std::size_t>(image.height), 8, [&](std::size_t y) {
    RandomStream own = random.Fork(y);
    for (int x = 0; x < image.width; ++x) {
      const auto bearing = lens.Unproject({x, static_cast<double>(y)});
      double grey = 0.0;
      if (bearing) {
        grey =
            room.Grey(room.Hit(T_world_camera.translation(), T_world_camera.rotation() * *bearing));
      }
      image.pixels[y * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(std::clamp(grey + noise * own.Normal() + 0.5, 0.0, 255.0));
    }
  });
  return image;
}

class InARoom : public ::testing::Test {
 protected:
  static constexpr int kCameras = 3, kFrames = 8;

  // A walk with turns of 3 degrees between frames.
  Pose3 PoseAt(int frame) const {
    return Pose3(ExpSo3({0.01 * frame, -0.02 * frame, 0.05 * frame}),
                 {0.06 * frame, 0.03 * frame - 0.2, 0.02 * frame});
  }
  std::vector<Image> ImagesAt(int frame) const {
    std::vector<Image> images;
    for (int camera = 0; camera < kCameras; ++camera) {
      images.push_back(Render(room_, model_, camera, PoseAt(frame), 2.0,
                              RandomStream(static_cast<std::uint64_t>(frame)).Fork(camera)));
      images.back().stamp = Time::FromSeconds(0.1 * frame);
    }
    return images;
  }
  TrackingHints HintsAt(int frame) const {
    return {.motion =
                [this, frame](FrameId earlier) {
                  const Pose3 T =
                      PoseAt(static_cast<int>(earlier.value())).inverse() * PoseAt(frame);
                  return PredictedMotion{T.rotation(), std::nullopt};
                },
            .inverse_depth = {}};
  }
  PanoramicTrackerConfig Config() const {
    PanoramicTrackerConfig config;
    config.budget = 200;
    return config;
  }
  // px, between the last observation of a track and the point that it was on `steps` observations
  // before.
  double ErrorOf(const Track& track, std::size_t steps) const {
    const auto& first = track.observations[track.observations.size() - 1 - steps];
    const Pose3 T_first = PoseAt(static_cast<int>(first.frame.value()));
    const Eigen::Vector3d point = room_.Hit(T_first * first.observation.center,
                                            T_first.rotation() * first.observation.bearing);
    const Pose3 T_last = PoseAt(static_cast<int>(track.last_frame().value()));
    const auto pixel = model_.ProjectPoint(track.last().camera, T_last.inverse() * point);
    return pixel ? (*pixel - track.last().pixel).norm() : 100.0;
  }

  Room room_;
  PanoramaModel model_ = test::MakePanorama(
      test::RingRig(kCameras, 0.1, test::MakeWideCamera(2.3, 300)), {.radius = 4.0});
};

TEST_F(InARoom, TracksStayOnTheirPoints) {
  PanoramicTracker tracker(model_, Config());
  for (int frame = 0; frame < kFrames; ++frame) {
    const TrackingSummary summary =
        tracker.Process(FrameId(frame), ImagesAt(frame), HintsAt(frame));
    EXPECT_EQ(summary.followed + summary.started, tracker.tracks().alive());
    EXPECT_GT(tracker.tracks().alive(), 120);
    EXPECT_LT(tracker.tracks().alive(), 300);
    if (frame > 0) {
      EXPECT_GT(summary.followed, 100);
    }
  }
  std::vector<double> step, whole;
  for (const Track& track : tracker.tracks().tracks()) {
    if (!track.alive || track.observations.size() < 4) continue;
    step.push_back(ErrorOf(track, 1));
    whole.push_back(ErrorOf(track, track.observations.size() - 1));
  }
  ASSERT_GT(step.size(), 60U);
  std::sort(step.begin(), step.end());
  std::sort(whole.begin(), whole.end());
  EXPECT_LT(step[step.size() / 2], 0.1);
  EXPECT_LE(step[step.size() * 99 / 100], 1.0);
  // Seven steps and no more error than in one: windows are compared with the first ones. Flow alone
  // drifts by 0.35 px.
  EXPECT_LT(whole[whole.size() / 2], 0.07);
  EXPECT_LT(whole[whole.size() * 9 / 10], 0.3);
  const auto wrong = whole.end() - std::upper_bound(whole.begin(), whole.end(), 3.0);
  EXPECT_LE(static_cast<double>(wrong), 0.01 * static_cast<double>(whole.size()));
}

// A camera that freezes contradicts the motion of the others: its tracks are outliers, the rest
// goes on.
TEST_F(InARoom, AFrozenCameraIsVotedDown) {
  PanoramicTracker tracker(model_, Config());
  tracker.Process(FrameId(0), ImagesAt(0), HintsAt(0));
  int frozen = 0;
  for (const Track& track : tracker.tracks().tracks()) frozen += track.last().camera == 0 ? 1 : 0;
  std::vector<Image> images = ImagesAt(1);
  images[0].pixels = ImagesAt(0)[0].pixels;
  const TrackingSummary summary = tracker.Process(FrameId(1), images, HintsAt(1));
  std::map<int, int> followed;
  for (const Track& track : tracker.tracks().tracks()) {
    if (track.last_frame() == FrameId(1) && track.frames() == 2) ++followed[track.last().camera];
  }
  EXPECT_LT(followed[0], 0.1 * frozen);  // near the epipoles
  EXPECT_GT(followed[1], 25);
  EXPECT_GT(followed[2], 25);
  EXPECT_GT(summary.outliers + summary.lost + summary.round_trip, 25);
}

TEST_F(InARoom, AMissingImageIsBridgedAndALongGapEndsTracks) {
  PanoramicTracker tracker(model_, Config());
  tracker.Process(FrameId(0), ImagesAt(0), HintsAt(0));
  std::vector<Image> without = ImagesAt(1);
  without.erase(without.begin());
  const int before = tracker.tracks().alive();
  tracker.Process(FrameId(1), without, HintsAt(1));
  tracker.Process(FrameId(2), ImagesAt(2), HintsAt(2));
  int bridged = 0;
  for (const Track& track : tracker.tracks().tracks()) {
    bridged += track.last().camera == 0 && track.alive && track.frames() == 2 &&
               track.observations[0].frame == FrameId(0);
  }
  EXPECT_GT(bridged, before / 8);
  std::vector<Image> late = ImagesAt(3);
  for (Image& image : late) image.stamp = Time::FromSeconds(5.0);
  const TrackingSummary summary = tracker.Process(FrameId(3), late, HintsAt(3));
  EXPECT_EQ(summary.followed, 0);
  EXPECT_GT(summary.started, 120);
}

TEST_F(InARoom, GivesTheSameBitsAtAnyNumberOfThreads) {
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    PanoramicTracker tracker(model_, Config());
    std::vector<double> pixels;
    for (int frame = 0; frame < 3; ++frame) {
      tracker.Process(FrameId(frame), ImagesAt(frame), HintsAt(frame));
    }
    for (const Track& track : tracker.tracks().tracks()) {
      for (const TrackObservation& o : track.observations) {
        pixels.push_back(o.observation.pixel.x());
        pixels.push_back(o.observation.pixel.y());
      }
    }
    return pixels;
  };
  EXPECT_EQ(run(1), run(2));
}

}  // namespace
}  // namespace mlvi
