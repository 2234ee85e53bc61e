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
  double GreyAlong(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return Grey(Hit(origin, direction));
  }

 private:
  static constexpr int kWaves = 20;
  std::vector<Eigen::Vector3d> waves_;
  std::vector<double> phases_;
};

// The room through plain dark bars that stand on a circle of 1.2 m around its middle.
class BarredRoom {
 public:
  static constexpr double kRadius = 1.2, kPeriod = 0.3, kWidth = 0.07;  // m, rad, rad
  Eigen::Vector3d OnCircle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Vector2d o = origin.head<2>(), d = direction.head<2>();
    const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - kRadius * kRadius;
    return origin + (std::sqrt(b * b - a * c) - b) / a * direction;
  }
  bool IsBar(const Eigen::Vector3d& on_circle) const {
    const double turns = (std::atan2(on_circle.y(), on_circle.x()) + M_PI) / kPeriod;
    return turns - std::floor(turns) < kWidth / kPeriod;
  }
  double GreyAlong(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    return IsBar(OnCircle(origin, direction)) ? 40.0 : room.GreyAlong(origin, direction);
  }
  Room room;
};

// `samples` x `samples` rays per pixel.
template <typename Scene>
Image Render(const Scene& scene, const PanoramaModel& model, int camera, const Pose3& T_world_pano,
             double noise, RandomStream random, int samples = 1) {
  const CameraModel& lens = model.camera(camera);
  const Pose3 T_world_camera = T_world_pano * model.T_pano_camera(camera);
  Image image{.camera = camera, .width = lens.width(), .height = lens.height()};
  image.pixels.resize(static_cast<std::size_t>(image.width) *
                      static_cast<std::size_t>(image.height));
  ParallelFor(static_cast<std::size_t>(image.height), 8, [&](std::size_t y) {
    RandomStream own = random.Fork(y);
    for (int x = 0; x < image.width; ++x) {
      double grey = 0.0;
      for (int i = 0; i < samples * samples; ++i) {
        const Eigen::Vector2d within((i % samples + 0.5) / samples - 0.5,
                                     (i / samples + 0.5) / samples - 0.5);
        const auto bearing = lens.Unproject(Eigen::Vector2d(x, static_cast<double>(y)) + within);
        if (!bearing) continue;
        grey +=
            scene.GreyAlong(T_world_camera.translation(), T_world_camera.rotation() * *bearing) /
            (samples * samples);
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
  // Those voted down had been aligned, too, and count neither as followed nor as refined.
  EXPECT_GT(summary.outliers, 10);
  EXPECT_LE(summary.refined, summary.followed);
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

TEST_F(InARoom, ACameraThatReturnsAfterALongGapGetsAllItsTracksAnew) {
  PanoramicTracker tracker(model_, Config());
  const int before = tracker.Process(FrameId(0), ImagesAt(0), HintsAt(0)).cameras[0].alive;
  TrackingSummary summary;
  for (int frame = 1; frame < 4; ++frame) {
    std::vector<Image> images = ImagesAt(frame);
    for (Image& image : images) image.stamp = Time::FromSeconds(0.6 * frame);
    if (frame < 3) images.erase(images.begin());
    summary = tracker.Process(FrameId(frame), images, HintsAt(frame));
  }
  EXPECT_EQ(summary.cameras[0].followed, 0);
  // Corners of another view, by chance more or fewer by a tenth.
  EXPECT_GT(summary.cameras[0].alive, 0.75 * before);
}

// What a camera lacks is looked for in its own images, whether or not others have one: after two
// images of each it has what it has when all are triggered together.
TEST_F(InARoom, CamerasInTurnAndSlowerOnesGetTheirTracksToo) {
  const auto alive_after = [&](int frames, const auto& has_image) {
    PanoramicTracker tracker(model_, Config());
    TrackingSummary summary;
    for (int frame = 0; frame < frames; ++frame) {
      std::vector<Image> images = ImagesAt(frame);
      std::erase_if(images, [&](const Image& image) { return !has_image(image.camera, frame); });
      summary = tracker.Process(FrameId(frame), images, HintsAt(frame));
    }
    return summary.cameras;
  };
  const auto together = alive_after(2, [](int, int) { return true; });
  const auto in_turn =
      alive_after(4, [](int camera, int frame) { return camera == 2 || frame % 2 == camera; });
  const auto slow =
      alive_after(4, [](int camera, int frame) { return camera != 0 || frame % 2 == 1; });
  for (std::size_t camera = 0; camera < together.size(); ++camera) {
    // Corners of other views, by chance more or fewer by a tenth; what is starved has half.
    EXPECT_GT(in_turn[camera].alive, 0.75 * together[camera].alive) << camera;
    EXPECT_GT(slow[camera].alive, 0.75 * together[camera].alive) << camera;
  }
}

// One step with the depths of all tracks known, as `depth_factor(id)` has them, and the motion
// `motion_factor` times what it is.
class InARoomWithDepths : public InARoom {
 protected:
  TrackingSummary Step(double motion_factor, const std::function<double(TrackId)>& depth_factor) {
    tracker_.Process(FrameId(0), ImagesAt(0), HintsAt(0));
    std::map<TrackId, double> inverse_depths;
    const Pose3 T_first = PoseAt(0), T = T_first.inverse() * PoseAt(1);
    for (const Track& track : tracker_.tracks().tracks()) {
      const Eigen::Vector3d origin = T_first * track.last().center;
      const Eigen::Vector3d direction = T_first.rotation() * track.last().bearing;
      const double depth = (room_.Hit(origin, direction) - origin).norm();
      inverse_depths[track.id] = 1.0 / (depth_factor(track.id) * depth);
    }
    const PredictedMotion motion{T.rotation(), motion_factor * T.translation()};
    return tracker_.Process(FrameId(1), ImagesAt(1),
                            {.motion = [&](FrameId) { return motion; },
                             .inverse_depth = [&](TrackId id) { return inverse_depths[id]; }});
  }
  PanoramicTracker tracker_{model_, Config()};
};

// A third of the distance is three times the parallax: several pixels off but near the epipoles.
TEST_F(InARoomWithDepths, TracksThatAreNotWhereDepthAndMotionHaveThemEnd) {
  const auto is_wrong = [](TrackId id) { return id.value() % 10 == 0; };
  const TrackingSummary summary =
      Step(1.0, [&](TrackId id) { return is_wrong(id) ? 1.0 / 3.0 : 1.0; });
  int wrong = 0, wrong_kept = 0, others = 0, others_kept = 0;
  for (const Track& track : tracker_.tracks().tracks()) {
    if (track.observations.front().frame != FrameId(0)) continue;
    (is_wrong(track.id) ? wrong : others) += 1;
    (is_wrong(track.id) ? wrong_kept : others_kept) += track.alive ? 1 : 0;
  }
  EXPECT_GT(wrong, 10);
  EXPECT_LT(wrong_kept, 0.2 * wrong);
  EXPECT_GT(others_kept, 0.9 * others);
  EXPECT_GT(summary.surprising, 0.5 * wrong);
}

// A motion that is predicted badly puts all tracks elsewhere, which is no reason to end any.
TEST_F(InARoomWithDepths, ABadPredictionEndsNoTracks) {
  const TrackingSummary summary = Step(-0.5, [](TrackId) { return 1.0; });
  EXPECT_LT(summary.surprising, 0.05 * summary.followed);
  EXPECT_GT(summary.followed, 100);
}

TEST_F(InARoom, TracksCountAfterTheirTrialUnlessTooFewDo) {
  for (const int least : {0, 50}) {
    PanoramicTrackerConfig config = Config();
    config.least_trusted = least;
    PanoramicTracker tracker(model_, config);
    for (int frame = 0; frame < 5; ++frame) {
      const TrackingSummary summary =
          tracker.Process(FrameId(frame), ImagesAt(frame), HintsAt(frame));
      EXPECT_GE(summary.trusted, std::min(least, summary.followed + summary.started));
      if (least == 0) {
        EXPECT_EQ(summary.trusted > 0, frame >= config.trial) << frame;
      }
    }
    int trusted = 0;
    for (const Track& track : tracker.tracks().tracks()) {
      if (!track.alive) continue;
      // A track of the first set counts at once where some must.
      const bool first = least > 0 && track.observations.front().frame == FrameId(0);
      const bool grown = static_cast<int>(track.observations.size()) > config.trial;
      EXPECT_EQ(track.trusted(), first || grown) << track.id.value();
      if (!track.trusted()) continue;
      ++trusted;
      EXPECT_EQ(track.trusted_since, FrameId(first ? 0 : track.observations[3].frame.value()));
    }
    EXPECT_GT(trusted, 100);
  }
}

// Where bars cross the pattern behind them corners follow neither.
TEST_F(InARoom, CrossingsOfNearAndFarAreFoundOut) {
  const BarredRoom scene;
  std::vector<std::vector<Image>> images;
  for (int frame = 0; frame < kFrames; ++frame) {
    images.emplace_back();
    for (int camera = 0; camera < kCameras; ++camera) {
      images.back().push_back(Render(scene, model_, camera, PoseAt(frame), 2.0,
                                     RandomStream(static_cast<std::uint64_t>(frame)).Fork(camera),
                                     2));
      images.back().back().stamp = Time::FromSeconds(0.1 * frame);
    }
  }
  const auto error = [&](const TrackObservation& from, const TrackObservation& to, bool bar) {
    const Pose3 T_from = PoseAt(static_cast<int>(from.frame.value()));
    const Eigen::Vector3d origin = T_from * from.observation.center;
    const Eigen::Vector3d direction = T_from.rotation() * from.observation.bearing;
    const Eigen::Vector3d point =
        bar ? scene.OnCircle(origin, direction) : scene.room.Hit(origin, direction);
    const Pose3 T_to = PoseAt(static_cast<int>(to.frame.value()));
    const auto pixel = model_.ProjectPoint(to.observation.camera, T_to.inverse() * point);
    return pixel ? (*pixel - to.observation.pixel).norm() : 10.0;
  };
  const auto share_of_outliers = [&](const PanoramicTrackerConfig& config) {
    PanoramicTracker tracker(model_, config);
    for (int frame = 0; frame < kFrames; ++frame) {
      const TrackingHints hints{
          .motion =
              [&](FrameId earlier) {
                const Pose3 T = PoseAt(static_cast<int>(earlier.value())).inverse() * PoseAt(frame);
                return PredictedMotion{T.rotation(), T.translation()};
              },
          .inverse_depth = {}};
      tracker.Process(FrameId(frame), images[static_cast<std::size_t>(frame)], hints);
    }
    int steps = 0, off = 0;
    for (const Track& track : tracker.tracks().tracks()) {
      if (!track.trusted()) continue;
      std::array<int, 2> beyond = {0, 0};
      for (std::size_t i = 1; i < track.observations.size(); ++i) {
        for (const bool bar : {false, true}) {
          beyond[bar ? 1 : 0] += error(track.observations[i - 1], track.observations[i], bar) > 1.0;
        }
        ++steps;
      }
      off += std::min(beyond[0], beyond[1]);
    }
    EXPECT_GT(steps, 300);
    return off / static_cast<double>(steps);
  };
  PanoramicTrackerConfig lenient = Config();
  lenient.refinement.max_disagreement_px = 20.0;
  lenient.outliers.least_sigmas = lenient.outliers.inlier_sigmas;
  lenient.trial = 0;
  lenient.trial_limit_px = 1000.0;
  PanoramicTrackerConfig strict = Config();
  strict.least_trusted = 50;
  const double all = share_of_outliers(lenient), judged = share_of_outliers(strict);
  RecordProperty("all", std::to_string(all));
  RecordProperty("judged", std::to_string(judged));
  EXPECT_GT(all, 0.15);
  EXPECT_LT(judged, 0.5 * all);
}

TEST(PanoramicTrackerConfig, WindowsMustHaveAMiddlePixel) {
  EXPECT_TRUE(PanoramicTrackerConfig().Validate());
  PanoramicTrackerConfig pyramid, corner, patch;
  pyramid.pyramid.window_px = 20;
  corner.corner.window_px = 4;
  patch.refinement.patch.size_px = 12;
  for (const auto& [config, message] :
       {std::pair(pyramid, "vio.tracker.pyramid.window_px = 20: must be odd"),
        std::pair(corner, "vio.tracker.corner.window_px = 4: must be odd"),
        std::pair(patch, "patch.size_px = 12: must be odd, a window has a middle pixel: use 11")}) {
    const Expected<void> valid = config.Validate();
    ASSERT_FALSE(valid);
    EXPECT_NE(valid.error().message.find(message), std::string::npos) << valid.error().message;
  }
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
