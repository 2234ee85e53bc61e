// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "sequence_description.h"

namespace mlvi {
namespace {

using Json = nlohmann::ordered_json;

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

// Null where recorded samples bring their own.
Json ImuNoiseJson(const SequenceOptions& options) {
  if (!options.recorded_imu.samples.empty()) return nullptr;
  const ImuNoise& imu = options.imu_noise;
  return {{"accelerometer_density", imu.accelerometer_density},
          {"gyroscope_density", imu.gyroscope_density},
          {"accelerometer_random_walk", imu.accelerometer_random_walk},
          {"gyroscope_random_walk", imu.gyroscope_random_walk}};
}

Json NoiseJson(const Recording& recording) {
  const SequenceOptions& options = recording.options();
  const LidarPhysics& lidar = recording.lidar().pattern().physics;
  return {{"imu", ImuNoiseJson(options)},
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

// How stamps of a sensor and of the IMU belong together, and by how much that varies.
Json TimeOffsetJson(const Recording& recording, const std::string& sensor, Duration told) {
  const SequenceOptions& options = recording.options();
  const Clocks clocks = EffectiveClocks(options.clocks, options.faults);
  const auto jitter = [&](const std::string& name) {
    const auto found = clocks.find(name);
    return found == clocks.end() ? 0.0 : found->second.jitter;
  };
  return {{"true_s", recording.TrueTimeOffset(sensor).seconds()},
          {"rig_s", told.seconds()},
          {"jitter_s", jitter("imu") + jitter(sensor)}};
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
                        {"time_offset", TimeOffsetJson(recording, truth.name, truth.time_offset)},
                        {"rate_hz", stream.rate_hz()},
                        {"longest_exposure_s", longest},
                        {"highest_gain", highest},
                        {"read_noise_electrons", physics.read_noise},
                        {"gamma", physics.gamma},
                        {"row_time_s", physics.row_time.seconds()}};
  }
  return json;
}

// Null without a place of its own.
Json StartJson(const SequenceOptions& sequence) {
  const auto& start = sequence.trajectory_start;
  if (!start) return nullptr;
  return {{"position", ToJson(start->position)}, {"heading_rad", start->heading}};
}

// Null without an own world.
Json SceneJson(const SequenceOptions& sequence, const SceneImportOptions& import) {
  if (!sequence.own_world) return nullptr;
  Json waypoints = Json::array();
  for (const Eigen::Vector3d& point : sequence.own_world->waypoints)
    waypoints.push_back(ToJson(point));
  return {{"scale", import.scale},
          {"up", import.up == UpAxis::kY ? "y" : "z"},
          {"relief_m", {import.relief.fine, import.relief.coarse}},
          {"waypoints", waypoints}};
}

Json CompressionJson(BagCompression compression) {
  switch (compression) {
    case BagCompression::kBz2: return "bz2";
    case BagCompression::kLz4: return "lz4";
    case BagCompression::kNone: break;
  }
  return "none";
}

// How the bag was written.
Json BagJson(const SimulateOptions& options, std::uintmax_t bytes) {
  const bool first = options.velodyne_stamp == VelodyneStamp::kFirstPacket;
  return {{"bytes", bytes},
          {"compression", CompressionJson(options.compression)},
          {"jpeg_quality", options.jpeg_quality},
          {"velodyne_stamp", first ? "first" : "last"}};
}

}  // namespace

Json DescribeSequence(const Recording& recording, const SimulateOptions& options, bool interrupted,
                      std::uintmax_t bag_bytes) {
  const SequenceOptions& sequence = recording.options();
  const LidarSpec& lidar = *sequence.rig.true_rig.lidar;
  Json messages;
  for (const auto& [topic, counts] : recording.Counts()) messages[topic] = counts.messages;
  return {{"mlvi", MLVI_VERSION},
          {"sequence", sequence.sequence},
          {"status", interrupted ? "interrupted" : "complete"},
          {"seed", sequence.seed},
          {"seconds", sequence.seconds},
          {"rest_s", sequence.rest},
          {"operator", sequence.carried},
          {"begin", ToString(sequence.begin)},
          {"end", ToString(interrupted ? recording.reached() : recording.end())},
          {"trajectory", options.trajectory},
          {"trajectory_start", StartJson(sequence)},
          {"recorded_imu", options.imu},
          {"scene", options.scene},
          {"scene_import", SceneJson(sequence, options.scene_import)},
          {"rig", recording.rig().name},
          {"bag", BagJson(options, bag_bytes)},
          {"true_T_body_lidar", ToJson(lidar.T_body_lidar)},
          {"estimator_T_body_lidar", ToJson(recording.rig().lidar->T_body_lidar)},
          {"gravity_m_s2", sequence.rig.true_rig.gravity},
          {"lidar_time_offset", TimeOffsetJson(recording, "lidar", lidar.time_offset)},
          {"ground_truth_clock", sequence.truth_clock.empty() ? "true" : sequence.truth_clock},
          {"messages", messages},
          {"cameras", CamerasJson(recording)},
          {"faults", ToJson(sequence.faults)},
          {"clocks", ToJson(EffectiveClocks(sequence.clocks, sequence.faults))},
          {"noise", NoiseJson(recording)},
          {"bias_at_begin", ToJson(recording.GroundTruth(recording.begin()).bias)},
          {"bias_at_end", ToJson(recording.GroundTruth(recording.end()).bias)},
          {"motion", MotionJson(recording)}};
}

}  // namespace mlvi
