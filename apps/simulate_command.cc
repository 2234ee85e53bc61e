// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "simulate_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "contact_sheet.h"
#include "exit_code.h"
#include "fault_options.h"
#include "interrupt.h"
#include "mlvi/base/parallel.h"
#include "mlvi/base/progress.h"
#include "mlvi/io/bag_writer.h"
#include "mlvi/io/euroc.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/tum.h"
#include "mlvi/io/whole_file.h"
#include "mlvi/sim/recording.h"
#include "mlvi/sim/scene_import.h"
#include "option_values.h"
#include "sensor_selection.h"
#include "sequence_description.h"
#include "simulate_options.h"

namespace {

using namespace mlvi;

// Poses of the body, and the biases of the IMU where the file knows them (EuRoC).
struct RecordedMotion {
  std::vector<Time> stamps;
  std::vector<Pose3> poses;
  std::vector<std::pair<Time, ImuBias>> biases;
};

Expected<RecordedMotion> ReadEurocMotion(const std::string& path) {
  const auto states = ReadEurocGroundTruth(path);
  if (!states) return tl::unexpected(states.error());
  RecordedMotion motion;
  for (const NavState& state : *states) {
    motion.stamps.push_back(state.stamp);
    motion.poses.push_back(state.T_world_body);
    motion.biases.emplace_back(state.stamp, state.bias);
  }
  return motion;
}

Expected<RecordedMotion> ReadTumMotion(const std::string& path) {
  const Expected<Trajectory> poses = ReadTum(path);
  if (!poses) return tl::unexpected(poses.error());
  RecordedMotion motion;
  for (const StampedPose& pose : *poses) {
    if (!pose.has_rotation) {
      return MakeError(ErrorKind::kInput,
                       "{}: the pose at {} s has no rotation; motion with rotations is needed",
                       path, ToString(pose.stamp));
    }
    motion.stamps.push_back(pose.stamp);
    motion.poses.push_back(pose.pose);
  }
  return motion;
}

// Recorded motion and IMU samples, from TUM and EuRoC files.
Expected<void> LoadMotion(const SimulateOptions& options, SequenceOptions& sequence) {
  const auto motion = options.trajectory.ends_with(".csv") ? ReadEurocMotion(options.trajectory)
                                                           : ReadTumMotion(options.trajectory);
  if (!motion) return tl::unexpected(motion.error());
  auto spline = FitPoseSpline(motion->stamps, motion->poses);
  if (!spline) return tl::unexpected(spline.error());
  sequence.trajectory = std::move(*spline);
  if (!options.start.empty()) {
    sequence.trajectory_start =
        PathPoint{.position = {options.start[0], options.start[1], options.start[2]},
                  .heading = options.start[3] * std::numbers::pi / 180.0};
  }
  if (options.imu.empty()) return {};
  auto samples = ReadEurocImu(options.imu);
  if (!samples) return tl::unexpected(samples.error());
  sequence.recorded_imu = {.samples = std::move(*samples), .biases = motion->biases};
  return {};
}

Expected<void> LoadScene(const SimulateOptions& options, SequenceOptions& sequence) {
  std::vector<Eigen::Vector3d> waypoints;
  for (const std::string& text : options.waypoints) {
    const auto p = ParseNumbers("--waypoint", text, 3, 3, "X,Y,Z in metres");
    if (!p) return tl::unexpected(p.error());
    waypoints.emplace_back((*p)[0], (*p)[1], (*p)[2]);
  }
  auto mesh = ImportScene(options.scene, options.scene_import);
  if (!mesh) return tl::unexpected(mesh.error());
  sequence.own_world =
      std::make_shared<OwnWorld>(OwnWorld{.mesh = std::move(*mesh),
                                          .lighting = {.ambient_illuminance = 200.0},
                                          .waypoints = std::move(waypoints)});
  return {};
}

// The rig of the sequence unless another one is named; its true mounts as ordered.
Expected<SimulatedRig> ResolveRig(const SimulateOptions& options, const SequenceFaults& faults) {
  const SequenceInfo* info = FindSequence(options.sequence);
  const std::string name =
      !options.rig.empty() ? options.rig : (info != nullptr ? info->rig : "newer_college");
  const Expected<Rig> rig = LoadRig(name);
  if (!rig) return tl::unexpected(rig.error());
  if (faults.extrinsics) return MakeSimulatedRig(*rig, *faults.extrinsics, options.seed);
  if (options.wrong_extrinsics || options.exact_extrinsics)
    return MakeSimulatedRig(*rig, options.wrong_extrinsics, options.seed);
  return StandardSequence(options.sequence, *rig, options.seconds, options.seed).rig;
}

// "all", "none" or names separated by commas.
std::vector<std::string> CameraNames(const std::string& text, const Rig& rig) {
  if (text == "none") return {};
  return text == "all" ? rig.CameraNames() : SplitAtCommas(text);
}

// From one row to the next, where the cameras' tallest image takes `readout` seconds.
Duration RowTime(double readout, const Rig& rig) {
  int rows = 1;
  for (const CameraSpec& camera : rig.cameras) rows = std::max(rows, camera.model->height());
  return Duration::FromSeconds(readout / rows);
}

Expected<SequenceOptions> Resolve(const SimulateOptions& options) {
  auto faults = FaultsOf(options.faults);
  if (!faults) return tl::unexpected(faults.error());
  auto rig = ResolveRig(options, *faults);
  if (!rig) return tl::unexpected(rig.error());
  SequenceOptions sequence =
      StandardSequence(options.sequence, rig->estimator_rig, options.seconds, options.seed);
  sequence.rig = std::move(*rig);
  sequence.rest = options.rest;
  sequence.cameras = CameraNames(options.cameras, sequence.rig.true_rig);
  if (options.contact_sheet && sequence.cameras.empty()) {
    return MakeError(ErrorKind::kConfiguration,
                     "--contact-sheet shows what cameras see: it needs a rig with cameras, and "
                     "--cameras other than none");
  }
  sequence.image_rate = options.image_rate;
  sequence.camera_physics.row_time = RowTime(options.rolling_shutter, sequence.rig.true_rig);
  sequence.ideal_lidar = sequence.ideal_lidar || options.ideal_lidar;
  sequence.plane_surfaces = options.plane_surfaces;
  if (options.no_operator) sequence.carried = false;
  if (options.exact_clocks) sequence.clocks = {};
  if (options.ideal_imu) sequence.imu_errors = {};
  sequence.faults = std::move(*faults);
  if (!options.trajectory.empty()) {
    if (const auto ok = LoadMotion(options, sequence); !ok) return tl::unexpected(ok.error());
  }
  if (!options.scene.empty()) {
    if (const auto ok = LoadScene(options, sequence); !ok) return tl::unexpected(ok.error());
  }
  if (const auto ok = CheckOptions(sequence); !ok) return tl::unexpected(ok.error());
  return sequence;
}

// The walks of the catalogue are free by construction (tested); a trajectory from outside may not
// be.
Expected<void> CheckFree(const Recording& recording, const SimulateOptions& options) {
  constexpr double kNeeded = 0.2;  // m
  const double clearance = recording.Clearance();
  if (clearance >= kNeeded) return {};
  return MakeError(
      ErrorKind::kConfiguration,
      "the motion of {} comes within {:.2f} m of a surface of the world of '{}' ({:.1f} m "
      "are needed): it does not fit there; try {}",
      options.trajectory.empty() ? "the sequence" : options.trajectory, clearance,
      options.scene.empty() ? options.sequence : options.scene, kNeeded,
      options.scene.empty() ? "another sequence or --start"
                            : "other waypoints, --scene-scale or --scene-up");
}

// Lights can go off only where there are some.
Expected<void> CheckLamps(const Recording& recording) {
  const Lighting& light = recording.world().lighting();
  if (!recording.options().faults.lights_off || !light.lamps.empty() ||
      light.carried_lamp_intensity > 0.0) {
    return {};
  }
  return MakeError(
      ErrorKind::kConfiguration,
      "--lights-off: the place of '{}' has no lamps, daylight is its only light; leave "
      "it out or choose a sequence inside a building",
      recording.options().sequence);
}

// For readers of the bag: the cameras whose images are in it, at the rates at which they are.
Rig RigOfBag(const Recording& recording) {
  Rig rig = recording.rig();
  rig.cameras.clear();
  for (const CameraStream& stream : recording.cameras()) {
    rig.cameras.push_back(recording.rig().cameras[static_cast<std::size_t>(stream.camera())]);
    rig.cameras.back().rate_hz = stream.rate_hz();
  }
  return rig;
}

// Up to where the bag goes: all of it, unless it was interrupted.
Expected<void> WriteTruth(const Recording& recording, bool interrupted, const std::string& path) {
  constexpr Duration kStep = Duration::FromMilliseconds(10);
  const Time end =
      interrupted ? std::min(recording.reached() + kStep, recording.end()) : recording.end();
  std::vector<StampedPose> poses;
  for (Time t = recording.begin(); t <= end; t = t + kStep) {
    poses.push_back({.stamp = recording.TruthStamp(t), .pose = recording.motion().PoseAt(t)});
  }
  const std::string& clock = recording.options().truth_clock;
  return WriteTum(
      poses, path,
      fmt::format(
          "T_world_body: pose of the IMU in the simulated world (z up; not the first pose), "
          "exact, at 100 Hz, stamped by {}; t x y z qx qy qz qw",
          clock.empty() ? "a clock without errors" : "the clock of the " + clock));
}

Expected<void> WriteBag(Recording& recording, const std::string& path,
                        const SimulateOptions& options, const InterruptGuard& guard) {
  auto writer = BagWriter::Create(path, recording.options().rig.estimator_rig,
                                  {.compression = options.compression,
                                   .velodyne_stamp = options.velodyne_stamp,
                                   .jpeg_quality = options.jpeg_quality});
  if (!writer) return tl::unexpected(writer.error());
  ProgressBar progress("simulate " + options.sequence, stderr);
  while (!guard.interrupted()) {
    const auto next = recording.Next();
    if (!next) return tl::unexpected(next.error());
    if (!*next) break;
    const auto written =
        recording.IsCorrupted(**next) ? (*writer)->WriteCutOff(**next) : (*writer)->Write(**next);
    if (!written) return written;
    progress.Update(recording.Progress());
  }
  if (!guard.interrupted()) progress.Finish();
  return (*writer)->Close();
}

Expected<void> WriteContactSheets(const Recording& recording, const std::filesystem::path& folder) {
  for (int i = 1; i <= 3; ++i) {
    const auto written = WriteContactSheet(recording, (2.0 * i - 1.0) / 6.0,
                                           folder / fmt::format("contact_sheet_{}.png", i));
    if (!written) return written;
  }
  return {};
}

void PrintCatalogue() {
  for (const SequenceInfo& info : SequenceCatalogue()) {
    fmt::print("{:<27} {:>4.0f} s  {:<13}  {}{}\n", info.name, info.seconds, info.rig,
               info.description, info.paper.empty() ? "" : fmt::format(" [{}]", info.paper));
  }
}

Expected<int> Simulate(const SimulateOptions& options) {
  if (options.list) {
    PrintCatalogue();
    return kExitDone;
  }
  if (options.sequence.empty() || options.output.empty()) {
    return MakeError(ErrorKind::kConfiguration,
                     "SEQUENCE and -o DIR are needed; `mlvi simulate --list` names the sequences");
  }
  const Expected<SequenceOptions> sequence = Resolve(options);
  if (!sequence) return tl::unexpected(sequence.error());
  const ThreadLimit threads(options.threads);
  Recording recording(*sequence, RecordingForm::kMessages);
  if (const auto free = CheckFree(recording, options); !free) return tl::unexpected(free.error());
  if (const auto lamps = CheckLamps(recording); !lamps) return tl::unexpected(lamps.error());
  if (sequence->carried && !recording.options().carried && !sequence->trajectory &&
      !sequence->own_world) {
    fmt::print("nobody carries the rig '{}': it reaches too far from its IMU\n",
               recording.rig().name);
  }

  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error) {
    return MakeError(ErrorKind::kConfiguration, "cannot create {}: {}", options.output,
                     error.message());
  }
  const std::filesystem::path folder(options.output), bag = folder / (options.sequence + ".bag");
  const InterruptGuard guard;
  const auto written =
      SaveRig(RigOfBag(recording), folder / "rig.yaml")
          .and_then([&] { return WriteBag(recording, bag, options, guard); })
          .and_then([&] {
            return WriteTruth(recording, guard.interrupted(), folder / "groundtruth.tum");
          })
          .and_then([&] {
            const auto description = DescribeSequence(recording, options, guard.interrupted(),
                                                      std::filesystem::file_size(bag, error));
            return WriteWholeFile(folder / "sequence.json", description.dump(2) + "\n");
          })
          .and_then([&]() -> Expected<void> {
            if (!options.contact_sheet || guard.interrupted()) return {};
            return WriteContactSheets(recording, folder);
          });
  if (!written) return tl::unexpected(written.error());
  fmt::print("{:.1f} s of {}{} in {}, bag of {:.1f} MB\n",
             (recording.reached() - recording.begin()).seconds(), options.sequence,
             guard.interrupted() ? " (interrupted)" : "", options.output,
             1e-6 * static_cast<double>(std::filesystem::file_size(bag, error)));
  return guard.interrupted() ? kExitInterrupted : kExitDone;
}

void AddMotionOptions(CLI::App& command, SimulateOptions& options) {
  CLI::Option* rest =
      command
          .add_option("--rest", options.rest,
                      "Seconds at rest at the beginning of the walk; 0 starts in motion")
          ->check(NumberIn(0.0, 86400.0))
          ->capture_default_str();
  CLI::Option* trajectory =
      command
          .add_option(
              "--trajectory", options.trajectory,
              "Recorded motion of the body (TUM, or EuRoC ground truth .csv) instead of the "
              "sequence's walk; moved to its start")
          ->check(CLI::ExistingFile)
          ->excludes(rest);
  command
      .add_option("--start", options.start,
                  "X,Y,Z,HEADING: where the recorded motion starts instead (m, deg)")
      ->expected(4)
      ->delimiter(',')
      ->check(NumberIn(-1e4, 1e4))
      ->needs(trajectory);
  command
      .add_option("--imu", options.imu,
                  "Recorded IMU samples (EuRoC .csv) of that motion instead of simulated ones")
      ->check(CLI::ExistingFile)
      ->needs(trajectory);
}

void AddSceneOptions(CLI::App& command, SimulateOptions& options) {
  CLI::Option* scene =
      command
          .add_option("--scene", options.scene,
                      "A textured mesh (glTF, OBJ, COLLADA, ...) instead of the sequence's place")
          ->check(CLI::ExistingFile);
  command.add_option("--scene-scale", options.scene_import.scale, "Metres per unit of the scene")
      ->check(NumberAbove(0.0, 1e6))
      ->capture_default_str()
      ->needs(scene);
  Relief& relief = options.scene_import.relief;
  command
      .add_option_function<std::pair<double, double>>(
          "--scene-relief",
          [&relief](const std::pair<double, double>& rms) {
            std::tie(relief.fine, relief.coarse) = rms;
          },
          fmt::format(
              "BUMPS,WAVES: unevenness of its surfaces for LiDARs, rms in m, over {} and {} m "
              "(default: {},{}, plaster)",
              relief.fine_size, relief.coarse_size, relief.fine, relief.coarse))
      ->delimiter(',')
      ->check(NumberIn(0.0, 0.1))
      ->needs(scene);
  AddChoice<UpAxis>(command, "--scene-up", options.scene_import.up,
                    {{"y", UpAxis::kY}, {"z", UpAxis::kZ}}, "Axis that is up in the scene")
      ->needs(scene);
  command
      .add_option(
          "--waypoint", options.waypoints,
          "X,Y,Z: a corner of the body's closed walk through the scene (m, z up); repeat it")
      ->expected(1)
      ->take_all()
      ->needs(scene);
}

void AddExtrinsicsOptions(CLI::App& command, SimulateOptions& options) {
  command
      .add_flag("--wrong-extrinsics", options.wrong_extrinsics,
                "The rig file's LiDAR mount is off by 0.4 deg and 8 mm (hilti_2022: truth is the "
                "2023 calibration)")
      ->group("Faults");
  command
      .add_flag("--exact-extrinsics", options.exact_extrinsics,
                "The rig file's mounts are the true ones, however well the sequence's rig was "
                "calibrated")
      ->group("Faults")
      ->excludes("--wrong-extrinsics")
      ->excludes("--extrinsics-error");
  command.get_option("--wrong-extrinsics")->excludes("--extrinsics-error");
  command.add_flag("--ideal-imu", options.ideal_imu,
                   "An IMU with white noise and walking biases only, where the sequence's own "
                   "vibrates, warms up and has errors of scale");
  command.add_flag("--ideal-lidar", options.ideal_lidar,
                   "A LiDAR with white noise and nothing else wrong: no mixed pixels, glass like "
                   "any surface, no bias of ranges, plane surfaces");
  command.add_flag("--plane-surfaces", options.plane_surfaces,
                   "Walls and grounds without roughness and waves, for the LiDAR");
  command.add_flag("--no-operator", options.no_operator,
                   "Nobody carries the rig: nothing hides what is behind it");
  command.add_flag("--exact-clocks", options.exact_clocks,
                   "Stamps without the offsets and the jitter of the sequence's rig; --clock still "
                   "sets those of a sensor");
}

}  // namespace

void AddSimulateCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* command =
      app.add_subcommand("simulate", "Make a recording of a simulated rig with its ground truth");
  command->add_option("sequence", options->sequence, "Name of the sequence (--list shows all)");
  command->add_option("-o,--output", options->output,
                      "Folder for bag, ground truth, rig and description");
  command->add_flag("--list", options->list, "List the sequences");
  command->add_option("--rig", options->rig,
                      "Rig file, or the name of a built-in rig (default: the sequence's own)");
  command
      ->add_option("--cameras", options->cameras,
                   "Cameras that take images: all, none, or names parted by commas")
      ->capture_default_str();
  command
      ->add_option("--image-rate", options->image_rate,
                   "Images per second of every camera (0: as the rig says)")
      ->check(NumberIn(0.0, 200.0));
  command
      ->add_option(
          "--rolling-shutter", options->rolling_shutter,
          "Seconds from the first row of an image to the last, as the camera itself moves (0: "
          "global shutter); stamps are those of the first row")
      ->check(NumberIn(0.0, 0.1));
  command->add_option("--jpeg-quality", options->jpeg_quality, "Of compressed images")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_flag("--contact-sheet", options->contact_sheet,
                    "Also write pictures of what all cameras see, with LiDAR points drawn in");
  command->add_option("--seconds", options->seconds, "Length (0: the sequence's own)")
      ->check(NumberIn(0.0, 86400.0));
  command->add_option("--seed", options->seed, "Seed of world, motion and noise")
      ->capture_default_str();
  AddMotionOptions(*command, *options);
  AddSceneOptions(*command, *options);
  AddChoice<BagCompression>(*command, "--compression", options->compression,
                            {{"none", BagCompression::kNone},
                             {"bz2", BagCompression::kBz2},
                             {"lz4", BagCompression::kLz4}},
                            "Compression of the bag");
  AddChoice<VelodyneStamp>(
      *command, "--velodyne-stamp", options->velodyne_stamp,
      {{"first", VelodyneStamp::kFirstPacket}, {"last", VelodyneStamp::kLastPacket}},
      "The packet of a turn that a VLP-32C message is stamped with");
  AddThreadsOption(*command, options->threads);
  AddFaultOptions(*command, options->faults);
  AddExtrinsicsOptions(*command, *options);
  command->callback([options, &exit_code] { exit_code = Report(Simulate(*options)); });
}
