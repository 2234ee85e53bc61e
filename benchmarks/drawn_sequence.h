// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Simulated sequences with images for benchmarks of visual odometry. Images take long to draw: they
// are kept in a cache, and seeds of noise differ in the IMU's errors and those of the first state
// only.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "bench_setup.h"
#include "mlvi/sim/recording.h"
#include "mlvi/vio/vio.h"

namespace mlvi {

struct DrawnSetup : BenchSetup {
  std::string cache = "vio_bench_images";
  double rate = 15.0;
  std::uint64_t seed = 1;
  std::vector<std::uint64_t> noise_seeds = {1};
  bool exact = false, unattended = false;
};

inline void AddDrawnOptions(CLI::App& app, DrawnSetup& setup) {
  AddSetupOptions(app, setup);
  app.add_option("--cache", setup.cache, "Folder for drawn images and sweeps");
  app.add_option("--rate", setup.rate, "Sets of images per second");
  app.add_option("--seed", setup.seed, "Of the sequence");
  app.add_option("--noise-seeds", setup.noise_seeds, "Of the IMU and the first state's error")
      ->delimiter(',');
  app.add_flag("--unattended", setup.unattended, "Nobody carries the rig");
  app.add_flag("--exact", setup.exact, "Cameras are where the rig file has them");
}

inline SequenceOptions MakeSequence(const DrawnSetup& o, const Rig& rig) {
  SequenceOptions sequence = StandardSequence(o.sequence, rig, o.seconds, o.seed);
  if (o.exact) sequence.rig = MakeSimulatedRig(rig, false, o.seed);
  sequence.rest = o.rest;
  if (o.unattended) sequence.carried = false;
  sequence.image_rate = o.rate;
  return sequence;
}

// When images with that stamp were taken, and the truth then; cameras share a clock.
inline Time TrueTimeOf(const Recording& recording, Time stamp) {
  return recording.TrueTime(stamp, recording.rig().cameras.front().name);
}
inline NavState TruthOf(const Recording& recording, Time stamp) {
  return recording.GroundTruth(stamp, recording.rig().cameras.front().name);
}

// All images of a sequence in one file: records of [camera, stamp, width, height, pixels].
class ImageFile {
 public:
  explicit ImageFile(const std::string& path) : in_(path, std::ios::binary) {}
  static void Write(std::ostream& out, const Image& image) {
    const std::int64_t header[4] = {image.camera, image.stamp.nanoseconds(), image.width,
                                    image.height};
    out.write(reinterpret_cast<const char*>(header), sizeof header);
    out.write(reinterpret_cast<const char*>(image.pixels.data()),
              static_cast<std::streamsize>(image.pixels.size()));
  }
  std::optional<Image> Next() {
    std::int64_t header[4];
    if (!in_.read(reinterpret_cast<char*>(header), sizeof header)) return std::nullopt;
    Image image{.stamp = Time::FromNanoseconds(header[1]),
                .camera = static_cast<int>(header[0]),
                .width = static_cast<int>(header[2]),
                .height = static_cast<int>(header[3])};
    image.pixels.resize(static_cast<std::size_t>(header[2] * header[3]));
    if (!in_.read(reinterpret_cast<char*>(image.pixels.data()),
                  static_cast<std::streamsize>(image.pixels.size()))) {
      return std::nullopt;
    }
    return image;
  }

 private:
  std::ifstream in_;
};

inline std::string CachePath(const DrawnSetup& o, const Rig& rig, std::string_view suffix) {
  return fmt::format("{}/{}-{}-{}-{:g}s-{:g}hz-rest{:g}{}{}.{}", o.cache, o.sequence, rig.name,
                     o.seed, o.seconds, o.rate, o.rest, o.exact ? "-exact" : "",
                     o.unattended ? "-unattended" : "", suffix);
}

// Writes a file of the cache, unless it is there already, by `write(stream)`. A file that is there
// is whole.
template <typename Write>
void WriteOnce(const std::string& path, const Write& write) {
  if (std::filesystem::exists(path)) return;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  const std::string unfinished = path + ".unfinished";
  {
    std::ofstream out(unfinished, std::ios::binary);
    write(out);
  }
  std::filesystem::rename(unfinished, path);
}

// Draws the images of all cameras, unless they are there already. Returns the file.
inline std::string DrawImages(const DrawnSetup& o, const Rig& rig) {
  std::string path = CachePath(o, rig, "images");
  WriteOnce(path, [&](std::ostream& out) {
    SequenceOptions sequence = MakeSequence(o, rig);
    sequence.cameras = rig.CameraNames();
    Recording recording(sequence);
    int images = 0;
    while (true) {
      const auto next = recording.Next();
      if (!next || !*next) break;
      const auto* image = std::get_if<Image>(&**next);
      if (image == nullptr) continue;
      ImageFile::Write(out, *image);
      if (++images % 100 == 0) {
        fmt::print(stderr, "{} images drawn, {:.0f} %\n", images, 100.0 * recording.Progress());
      }
    }
  });
  return path;
}

// The images of one instant; cameras renumbered to those in use.
class SetReader {
 public:
  SetReader(const std::string& path, std::vector<int> new_index)
      : file_(path), new_index_(std::move(new_index)), next_(file_.Next()) {}

  std::optional<ImageSet> Next() {
    if (!next_) return std::nullopt;
    ImageSet set{.stamp = next_->stamp, .images = {}};
    while (next_ && next_->stamp == set.stamp) {
      const int camera = new_index_[static_cast<std::size_t>(next_->camera)];
      if (camera >= 0) {
        set.images.push_back(std::move(*next_));
        set.images.back().camera = camera;
      }
      next_ = file_.Next();
    }
    return set;
  }

 private:
  ImageFile file_;
  std::vector<int> new_index_;
  std::optional<Image> next_;
};

// The IMU of the recording with noise and biases of another seed.
inline ImuSimulator MakeImu(const Recording& recording, std::uint64_t seed) {
  const Rig& rig = recording.options().rig.true_rig;
  const ImuPhysics physics{
      .rate_hz = rig.imu.rate_hz,
      .noise = recording.options().imu_noise,
      .accelerometer_saturation = rig.imu.accelerometer_saturation,
      .gyroscope_saturation = rig.imu.gyroscope_saturation,
      .gravity = rig.gravity,
      .errors = EffectiveErrors(recording.options().imu_errors, recording.options().faults)};
  return ImuSimulator(physics, recording.motion(), recording.begin(), recording.end(),
                      RandomStream(seed, "imu"));
}

inline OdometryEstimate NoisyTruth(const NavState& truth, std::uint64_t seed) {
  Vector15d sigma;
  sigma << Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(0.02),
      Eigen::Vector3d::Constant(2e-3), Eigen::Vector3d::Constant(0.03),
      Eigen::Vector3d::Constant(2e-3);
  RandomStream random(seed, "start");
  Vector15d error;
  for (int i = 0; i < 15; ++i) error[i] = sigma[i] * random.Normal();
  // Heading and position are the world's, not to be estimated.
  return {.state = BoxPlus(truth, error), .covariance = sigma.cwiseAbs2().asDiagonal()};
}

// The rig with the chosen cameras only; `new_index` maps those of the whole rig.
inline Rig SelectCameras(const Rig& rig, const std::vector<std::string>& names,
                         std::vector<int>& new_index) {
  Rig selected = rig;
  selected.cameras.clear();
  for (const CameraSpec& camera : rig.cameras) {
    const bool in_use =
        names.empty() || std::find(names.begin(), names.end(), camera.name) != names.end();
    new_index.push_back(in_use ? static_cast<int>(selected.cameras.size()) : -1);
    if (in_use) selected.cameras.push_back(camera);
  }
  return selected;
}

// Hands the sets of images of a run, in the order of time and with the IMU samples since the set
// before, to `process(set, samples)`; `before_set(stamp)` is called first, with the newest instant that
// the IMU has reached.
template <typename BeforeSet, typename Process>
void PlaySets(const ImuSimulator& imu, SetReader sets, const BeforeSet& before_set,
              const Process& process) {
  std::optional<ImageSet> set = sets.Next();
  std::vector<ImuSample> samples;
  for (std::size_t i = 0; set && i < imu.size(); ++i) {
    samples.push_back(imu.Sample(i));
    before_set(samples.back().stamp);
    for (; set && set->stamp <= samples.back().stamp; set = sets.Next()) {
      process(*set, samples);
      samples.erase(samples.begin(), samples.end() - 1);
    }
  }
}

}  // namespace mlvi
