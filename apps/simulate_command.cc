// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "simulate_command.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
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

namespace {

using namespace mlvi;
using Json = nlohmann::ordered_json;

struct SimulateOptions {
  std::string sequence;
  std::string output;
  std::string rig;  // empty: the sequence's own
  std::string trajectory, imu, scene;
  std::vector<double> start;  // x, y, z, heading in deg
  std::vector<std::string> waypoints;
  SceneImportOptions scene_import;
  std::string cameras = "all";
  double image_rate = 0.0;
  bool contact_sheet = false;
  int jpeg_quality = 80;
  double seconds = 0.0;
  double rest = 2.0;
  std::uint64_t seed = 1;
  bool list = false;
  bool wrong_extrinsics = false, exact_extrinsics = false, ideal_lidar = false, ideal_imu = false;
  bool plane_surfaces = false, no_operator = false, exact_clocks = false;
  FaultArguments faults;
  BagCompression compression = BagCompression::kNone;
  VelodyneStamp velodyne_stamp = VelodyneStamp::kFirstPacket;
  int threads = 0;
};

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

Json ToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json ToJson(const Pose3& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  return {{"t", ToJson(pose.translation())}, {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

Json ToJson(const ImuBias& bias) {
  return {{"accelerometer_m_s2", ToJson(bias.accelerometer)},
          {"gyroscope_rad_s", ToJson(bias.gyroscope)}};
}

Json ToJson(const ImuErrors& errors) {
  const auto& [vibration, warm_up, sensitivity] = errors;
  return {{"vibration",
           {{"acceleration_m_s2", vibration.acceleration},
            {"rate_rad_s", vibration.rate},
            {"lowest_hz", vibration.lowest},
            {"highest_hz", vibration.highest}}},
          {"warm_up",
           {{"accelerometer_m_s2", warm_up.accelerometer},
            {"gyroscope_rad_s", warm_up.gyroscope},
            {"time_constant_s", warm_up.time_constant}}},
          {"largest_scale_error",
           {{"accelerometer", sensitivity.accelerometer}, {"gyroscope", sensitivity.gyroscope}}}};
}

// Row by row.
Json RowsJson(const Eigen::Matrix3d& m) {
  Json rows = Json::array();
  for (const auto& row : m.rowwise()) rows.push_back({row[0], row[1], row[2]});
  return rows;
}

// By material; none where surfaces are plane.
Json ReliefJson(const Recording& recording) {
  Json json = Json::object();
  if (recording.lidar().pattern().physics.plane_surfaces) return json;
  for (const Material& material : recording.world().mesh().materials) {
    const Relief& relief = material.relief;
    if (relief.plane()) continue;
    json[material.name] = {{"fine_m", relief.fine},
                           {"fine_size_m", relief.fine_size},
                           {"coarse_m", relief.coarse},
                           {"coarse_size_m", relief.coarse_size}};
  }
  return json;
}

Json NoiseJson(const Recording& recording) {
  const SequenceOptions& options = recording.options();
  const ImuNoise& imu = options.imu_noise;
  const LidarPhysics& lidar = recording.lidar().pattern().physics;
  return {{"imu",
           {{"accelerometer_density", imu.accelerometer_density},
            {"gyroscope_density", imu.gyroscope_density},
            {"accelerometer_random_walk", imu.accelerometer_random_walk},
            {"gyroscope_random_walk", imu.gyroscope_random_walk}}},
          {"imu_errors", ToJson(EffectiveErrors(options.imu_errors, options.faults))},
          {"imu_sensitivity",
           {{"accelerometer", RowsJson(recording.imu().accelerometer_sensitivity())},
            {"gyroscope", RowsJson(recording.imu().gyroscope_sensitivity())}}},
          {"lidar",
           {{"range_noise_m", lidar.range_noise},
            {"beam_noise_rad", lidar.beam_noise},
            {"max_range_m", lidar.max_range},
            {"dropout", lidar.dropout},
            {"first_surface", lidar.first_surface},
            {"surface_relief", ReliefJson(recording)},
            {"beam_divergence_rad", lidar.beam_divergence},
            {"pulse_length_m", lidar.pulse_length},
            {"incidence_bias", lidar.incidence_bias},
            {"walk_error_m_per_decade", lidar.walk_error}}}};
}

Json MotionJson(const Recording& recording) {
  const MotionStatistics motion =
      MeasureMotion(recording.motion(), recording.begin(), recording.end());
  return {{"mean_speed_m_s", motion.mean_speed},
          {"mean_rate_rad_s", motion.mean_rate},
          {"p95_rate_rad_s", motion.p95_rate},
          {"max_rate_rad_s", motion.max_rate},
          {"max_acceleration_m_s2", motion.max_acceleration}};
}

Json CamerasJson(const Recording& recording) {
  const CameraPhysics& physics = recording.options().camera_physics;
  Json json = Json::object();
  for (const CameraStream& stream : recording.cameras()) {
    const CameraSpec& truth =
        recording.options().rig.true_rig.cameras[static_cast<std::size_t>(stream.camera())];
    double longest = 0.0, highest = 1.0;
    for (std::size_t i = 0; i < stream.size(); ++i) {
      longest = std::max(longest, stream.ExposureOf(i).seconds);
      highest = std::max(highest, stream.ExposureOf(i).gain);
    }
    json[truth.name] = {{"true_T_body_camera", ToJson(truth.T_body_camera)},
                        {"true_time_offset_s", truth.time_offset.seconds()},
                        {"longest_exposure_s", longest},
                        {"highest_gain", highest},
                        {"read_noise_electrons", physics.read_noise},
                        {"gamma", physics.gamma},
                        {"row_time_s", physics.row_time.seconds()}};
  }
  return json;
}

Json Description(const Recording& recording, const SimulateOptions& options, bool interrupted) {
  const SequenceOptions& sequence = recording.options();
  Json messages;
  for (const auto& [topic, counts] : recording.Counts()) messages[topic] = counts.messages;
  return {{"sequence", sequence.sequence},
          {"status", interrupted ? "interrupted" : "complete"},
          {"seed", sequence.seed},
          {"seconds", sequence.seconds},
          {"rest_s", sequence.rest},
          {"operator", sequence.carried},
          {"begin", ToString(sequence.begin)},
          {"end", ToString(interrupted ? recording.reached() : recording.end())},
          {"trajectory", options.trajectory},
          {"recorded_imu", options.imu},
          {"scene", options.scene},
          {"rig", recording.rig().name},
          {"true_T_body_lidar", ToJson(sequence.rig.true_rig.lidar->T_body_lidar)},
          {"estimator_T_body_lidar", ToJson(recording.rig().lidar->T_body_lidar)},
          {"gravity_m_s2", sequence.rig.true_rig.gravity},
          {"messages", messages},
          {"cameras", CamerasJson(recording)},
          {"faults", ToJson(sequence.faults)},
          {"clocks", ToJson(EffectiveClocks(sequence.clocks, sequence.faults))},
          {"noise", NoiseJson(recording)},
          {"bias_at_begin", ToJson(recording.GroundTruth(recording.begin()).bias)},
          {"bias_at_end", ToJson(recording.GroundTruth(recording.end()).bias)},
          {"motion", MotionJson(recording)}};
}

// Up to where the bag goes: all of it, unless it was interrupted.
Expected<void> WriteTruth(const Recording& recording, bool interrupted, const std::string& path) {
  constexpr Duration kStep = Duration::FromMilliseconds(10);
  const Time end =
      interrupted ? std::min(recording.reached() + kStep, recording.end()) : recording.end();
  std::vector<StampedPose> poses;
  for (Time t = recording.begin(); t <= end; t = t + kStep) {
    poses.push_back({.stamp = t, .pose = recording.motion().PoseAt(t)});
  }
  return WriteTum(
      poses, path,
      "T_world_body: pose of the IMU in the simulated world (z up; not the first pose), exact, "
      "at 100 Hz on the true clock; t x y z qx qy qz qw");
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
    fmt::print("{:<27} {:>4.0f} s  {:<13}  {}\n", info.name, info.seconds, info.rig,
               info.description);
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

  std::error_code error;
  std::filesystem::create_directories(options.output, error);
  if (error) {
    return MakeError(ErrorKind::kConfiguration, "cannot create {}: {}", options.output,
                     error.message());
  }
  const std::filesystem::path folder(options.output);
  const InterruptGuard guard;
  const auto written =
      SaveRig(recording.rig(), folder / "rig.yaml")
          .and_then([&] {
            return WriteBag(recording, folder / (options.sequence + ".bag"), options, guard);
          })
          .and_then([&] {
            return WriteTruth(recording, guard.interrupted(), folder / "groundtruth.tum");
          })
          .and_then([&] {
            const Json description = Description(recording, options, guard.interrupted());
            return WriteWholeFile(folder / "sequence.json", description.dump(2) + "\n");
          })
          .and_then([&]() -> Expected<void> {
            if (!options.contact_sheet || guard.interrupted()) return {};
            return WriteContactSheets(recording, folder);
          });
  if (!written) return tl::unexpected(written.error());
  fmt::print("{:.1f} s of {}{} in {}\n", (recording.reached() - recording.begin()).seconds(),
             options.sequence, guard.interrupted() ? " (interrupted)" : "", options.output);
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
