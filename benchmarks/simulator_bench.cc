// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Cost of simulated recordings by stage: building the place, drawing textures and metering, sets of
// images one after another from the middle of the sequence (the first one computes the soft light
// of what it sees), sweeps.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <bit>
#include <chrono>
#include <ctime>
#include <vector>

#include "mlvi/base/parallel.h"
#include "mlvi/io/image_encoder.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/sim/recording.h"

namespace mlvi {
namespace {

struct Cost {
  double wall = 0.0, cpu = 0.0;  // s; cpu: all threads, comparable when other programs run
};

template <typename Work>
Cost Measure(const Work& work) {
  const std::clock_t cpu_start = std::clock();
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC};
}

Cost Median(std::vector<Cost> costs) {
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::ranges::nth_element(costs, middle, {}, &Cost::cpu);
  return *middle;
}

// Numbers that change with any bit of the images, of the sweeps: equal sums, equal data.
class Sum {
 public:
  void Add(std::uint64_t bits) { value_ = (value_ ^ bits) * 0x100000001b3ULL; }
  void Add(const Image& image) {
    for (const std::uint8_t pixel : image.pixels) Add(pixel);
  }
  void Add(const LidarSweep& sweep) {
    for (const LidarPoint& point : sweep.points) {
      for (const float x : point.position) Add(std::bit_cast<std::uint32_t>(x));
      Add(std::bit_cast<std::uint32_t>(point.intensity));
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

struct Options {
  std::string sequence = "quad-easy";
  std::string rig;
  std::vector<std::string> cameras;
  int sets = 8;
  int threads = 2;
};

void Report(const char* stage, const Cost& cost) {
  fmt::print("| {} | {:.3f} | {:.3f} |\n", stage, cost.wall, cost.cpu);
}

int Run(const Options& options) {
  const ThreadLimit limit(options.threads);
  const SequenceInfo* info = FindSequence(options.sequence);
  const auto rig = LoadRig(options.rig.empty() && info ? info->rig : options.rig);
  if (!rig) return fmt::print(stderr, "{}\n", rig.error().message), 1;
  SequenceOptions sequence = StandardSequence(options.sequence, *rig, 0.0, 1);
  sequence.cameras = options.cameras;
  if (sequence.cameras.empty()) sequence.cameras = rig->CameraNames();
  if (sequence.cameras.front() == "none") sequence.cameras.clear();
  sequence.image_rate = 10.0;
  if (const auto ok = CheckOptions(sequence); !ok)
    return fmt::print(stderr, "{}\n", ok.error().message), 1;

  fmt::print("{} with {}\n| stage | wall, s | CPU, s |\n|---|---|---|\n", options.sequence,
             rig->name);
  std::optional<Recording> recording;
  Report("place, textures, exposures", Measure([&] { recording.emplace(sequence); }));
  std::vector<Cost> sets, jpegs, sweeps;
  StageTimes stages;  // of single images, without those of the first set
  Sum images, points;
  const auto all = static_cast<std::size_t>((recording->end() - recording->begin()).seconds() *
                                            sequence.image_rate);
  for (int i = 0; i < options.sets; ++i) {
    const std::size_t index = std::min(all / 2 + static_cast<std::size_t>(i), all - 2);
    std::vector<Image> set;
    sets.push_back(Measure([&] {
      for (const CameraStream& stream : recording->cameras())
        set.push_back(stream.Take(index, i > 0 ? &stages : nullptr));
    }));
    for (const Image& image : set) images.Add(image);
    jpegs.push_back(Measure([&] {
      for (const Image& image : set) EncodeJpeg(image, 80).value();
    }));
    const Time time = recording->begin() + Duration::FromSeconds(0.1 * static_cast<double>(index));
    LidarSweep sweep;
    sweeps.push_back(Measure([&] {
      sweep = recording->lidar().Sweep(recording->world(), recording->motion(), time, index);
    }));
    points.Add(sweep);
  }
  Report("first set of images", sets.front());
  Report("set of images, median", Median(sets));
  for (const auto& [stage, statistics] : stages.Summarize())
    fmt::print("| one image: {}, median | {:.3f} | |\n", stage, 1e-3 * statistics.p50_ms);
  Report("JPEG of a set, median", Median(jpegs));
  Report("sweep, median", Median(sweeps));
  fmt::print("images {:016x}, points {:016x}\n", images.value(), points.value());
  return 0;
}

}  // namespace
}  // namespace mlvi

int main(int argc, char** argv) {
  CLI::App app("Cost of simulated recordings by stage");
  mlvi::Options options;
  app.add_option("--sequence", options.sequence, "Sequence of the catalogue");
  app.add_option("--rig", options.rig, "Rig (default: the sequence's own)");
  app.add_option("--cameras", options.cameras, "Cameras, or none (default: all)")->delimiter(',');
  app.add_option("--sets", options.sets, "Image sets and sweeps")->check(CLI::Range(1, 10000));
  app.add_option("--threads", options.threads, "Threads, 0 for all cores");
  CLI11_PARSE(app, argc, argv);
  return mlvi::Run(options);
}
