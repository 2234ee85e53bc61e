// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Cost of the visual front end per image set, over the number of cameras: pyramids, flow there and
// back, RANSAC and new features. 720 x 540 px pictures of natural spectrum that turn by a degree
// per set, as at 1 rad/s and 60 Hz. With --sequence, accuracy instead: the tracks that visual odometry
// has on a simulated sequence, with all cameras and with the first one alone, against the truth:
//   tracking_bench --sequence room-01 --seconds 60 --rate 10 --exact --cache drawn
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

#include "drawn_sequence.h"
#include "mlvi/base/parallel.h"
#include "mlvi/features/testing.h"
#include "mlvi/panorama/panoramic_tracker.h"
#include "mlvi/panorama/testing.h"
#include "track_accuracy.h"

namespace mlvi {
namespace {

constexpr int kDistinct = 4;  // different sets; played forth and back

Pose3 PoseAt(int set) { return Pose3(ExpSo3(Eigen::Vector3d(0.0, 0.0, 0.0175 * set)), {}); }

// A texture on the sphere at infinity, by the two angles of the direction seen.
std::vector<Image> RenderSet(const PanoramaModel& model, int set) {
  const test::WaveTexture texture(1, 40.0, 6.0, 150.0);
  std::vector<Image> images(static_cast<std::size_t>(model.cameras()));
  for (int camera = 0; camera < model.cameras(); ++camera) {
    const CameraModel& lens = model.camera(camera);
    const Eigen::Quaterniond R = PoseAt(set).rotation() * model.T_pano_camera(camera).rotation();
    const auto source = [&](const Eigen::Vector2d& pixel) {
      const Eigen::Vector3d d = R * lens.Unproject(pixel).value_or(Eigen::Vector3d::UnitX());
      return Eigen::Vector2d(350.0 * std::atan2(d.y(), d.x()), 350.0 * d.z());
    };
    Image& image = images[static_cast<std::size_t>(camera)];
    image = test::Render(lens.width(), lens.height(), texture, source, 2.0,
                         RandomStream(static_cast<std::uint64_t>(100 * set + camera)));
    image.camera = camera;
  }
  return images;
}

struct Cost {
  double p50_ms = 0.0, cpu_ms = 0.0,
         alive = 0.0;  // cpu: all threads, comparable when other programs run
};

Cost Measure(const PanoramaModel& model, const std::vector<std::vector<Image>>& sets, int cameras,
             const PanoramicTrackerConfig& config, int repeats) {
  PanoramicTracker tracker(model, config);
  std::vector<double> times, cpu;
  int set_of_last = 0;
  for (int i = 0; i < repeats; ++i) {
    const int phase = i % (2 * kDistinct - 2),
              set = phase < kDistinct ? phase : 2 * kDistinct - 2 - phase;
    std::vector<Image> images(sets[static_cast<std::size_t>(set)].begin(),
                              sets[static_cast<std::size_t>(set)].begin() + cameras);
    for (Image& image : images) image.stamp = Time::FromSeconds(0.05 * i);
    const Pose3 T = PoseAt(set_of_last).inverse() * PoseAt(set);
    const TrackingHints hints{.motion =
                                  [&](FrameId) {
                                    return PredictedMotion{T.rotation(), std::nullopt};
                                  },
                              .inverse_depth = {}};
    const std::clock_t cpu_start = std::clock();
    const auto start = std::chrono::steady_clock::now();
    tracker.Process(FrameId(i), images, hints);
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - start;
    if (i > 0) {
      times.push_back(elapsed.count());
      cpu.push_back(1e3 * static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC);
    }
    tracker.tracks().ForgetBefore(FrameId(i - 10));
    set_of_last = set;
  }
  std::sort(times.begin(), times.end());
  std::sort(cpu.begin(), cpu.end());
  return {times[times.size() / 2], cpu[cpu.size() / 2],
          static_cast<double>(tracker.tracks().alive())};
}

void Run(const std::vector<int>& counts, int repeats, int threads, PanoramicTrackerConfig config) {
  const ThreadLimit limit(threads);
  fmt::print(
      "| cameras | p50, ms | CPU p50, ms | CPU of the first | tracks |\n|---|---|---|---|---|\n");
  double one = 0.0;
  for (const int cameras : counts) {
    // A ring of the Newer College's lenses.
    const PanoramaModel model = test::MakePanorama(
        test::RingRig(cameras, 0.07, test::MakeCamera(testing::NewerCollegeCalibrations()[0])));
    std::vector<std::vector<Image>> sets;
    for (int set = 0; set < kDistinct; ++set) sets.push_back(RenderSet(model, set));
    const Cost cost = Measure(model, sets, cameras, config, repeats);
    if (one == 0.0) one = cost.cpu_ms;
    fmt::print("| {} | {:.1f} | {:.1f} | {:.2f} | {:.0f} |\n", cameras, cost.p50_ms, cost.cpu_ms,
               cost.cpu_ms / one, cost.alive);
  }
}

void PrintRows(std::size_t cameras, const std::vector<TrackAccuracy::Row>& rows) {
  for (const TrackAccuracy::Row& row : rows) {
    fmt::print(
        "| {} | {} | {} | {:.1f} | {:.3f} | {:.2f} | {:.2f} | {:.3f} | {:.2f} | {:.1f} | {:.1f} | "
        "{:.2f} | "
        "{:.0f} | {:.1f} "
        "|\n",
        cameras, row.kind, row.tracks, 100.0 * row.share, row.step, 100.0 * row.step_1,
        100.0 * row.strict_1, row.median, row.p90, 100.0 * row.beyond_1, 100.0 * row.beyond_3,
        row.whole_median, 100.0 * row.short_lived, 100.0 * row.beyond_1_young);
  }
}

void FollowSequence(const DrawnSetup& setup, const VioConfig& config, const Recording& recording,
                    const std::vector<std::string>& cameras, const std::string& images) {
  std::vector<int> new_index;
  const Rig used = SelectCameras(recording.rig(), cameras, new_index);
  const auto model = PanoramaModel::FromRig(used);
  MLVI_CHECK(model.has_value(), "{}", model.error().message);
  const std::uint64_t seed = setup.noise_seeds.front();
  const ImuSimulator imu = MakeImu(recording, seed);
  StageTimes times;
  Vio vio(config, used, times);
  TrackAccuracy accuracy(recording, *model);
  bool started = false;
  PlaySets(
      imu, SetReader(images, new_index), [](Time) {},
      [&](const ImageSet& set, const std::vector<ImuSample>& samples) {
        if (set.stamp > recording.end()) return;
        if (!started) {
          NavState truth = TruthOf(recording, set.stamp);
          truth.bias = imu.BiasAt(set.stamp);
          vio.Start(NoisyTruth(truth, seed));
        }
        started = vio.Process(set, samples).status == VioResult::Status::kTracking;
        accuracy.Observe(TrueTimeOf(recording, set.stamp), vio.tracks());
      });
  PrintRows(used.cameras.size(), accuracy.Rows());
}

void RunSequence(const DrawnSetup& setup, const Rig& rig, const VioConfig& config) {
  const std::string images = DrawImages(setup, rig);
  const Recording recording(MakeSequence(setup, rig));  // without images
  fmt::print(
      "| cameras | on | tracks | share, % | step: median, px | > 1 px, % | of what the pixel is "
      "on, % | {0} "
      "sets: median, px | "
      "p90, "
      "px | > 1 px, % | > 3 px, % | since the start: median, px | tracks that end before {0} sets, "
      "% "
      "| > 1 px after {0}, % |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      TrackAccuracy::kSpan);
  FollowSequence(setup, config, recording, {}, images);
  FollowSequence(setup, config, recording, {rig.cameras.front().name}, images);
}

}  // namespace
}  // namespace mlvi

int main(int argc, char** argv) {
  CLI::App app(
      "Cost of the visual front end over the number of cameras, and accuracy of its tracks");
  int repeats = 60;
  std::vector<int> counts = {1, 2, 4, 6};
  mlvi::DrawnSetup setup;
  setup.threads = 2;
  mlvi::VioConfig config;
  mlvi::PanoramicTrackerConfig& tracker = config.tracker;
  mlvi::AddDrawnOptions(app, setup);
  app.add_option("--cameras", counts,
                 "Numbers of cameras; the first is what others are compared with")
      ->check(CLI::Range(1, 20));
  app.add_option("--repeats", repeats, "Image sets per entry")->check(CLI::Range(3, 100000));
  app.add_option("--budget", tracker.budget, "Features");
  app.add_option("--window", tracker.pyramid.window_px, "Window, px");
  app.add_option("--levels", tracker.pyramid.levels, "Pyramid levels");
  app.add_flag("--equalise", tracker.pyramid.equalise, "Equalise contrast");
  CLI11_PARSE(app, argc, argv);
  const auto rig = mlvi::Resolve(setup, config);
  if (!rig) {
    fmt::print(stderr, "{}\n", rig.error().message);
    return 1;
  }
  if (setup.sequence.empty()) {
    mlvi::Run(counts, repeats, setup.threads, tracker);
  } else {
    const mlvi::ThreadLimit threads(setup.threads);
    mlvi::RunSequence(setup, *rig, config);
  }
  return 0;
}
