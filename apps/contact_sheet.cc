// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mlvi/io/image_encoder.h"
#include "mlvi/sensors/camera_model.h"
#include "range_colours.h"

namespace {

using namespace mlvi;

// The returns of a sweep in the world, each from the pose at its own firing.
std::vector<Eigen::Vector3d> WorldPoints(const Recording& recording, Time time) {
  const Duration period = Duration::FromMilliseconds(100);
  const auto index = (time - recording.begin()).nanoseconds() / period.nanoseconds();
  const Time start = recording.begin() + period * index;
  if (start + recording.lidar().pattern().span() > recording.end()) return {};
  const LidarSweep sweep = recording.lidar().Sweep(recording.world(), recording.motion(), start,
                                                   static_cast<std::uint64_t>(index));
  const Pose3& T_body_lidar = recording.options().rig.true_rig.lidar->T_body_lidar;
  std::vector<Eigen::Vector3d> points;
  for (const LidarPoint& point : sweep.points) {
    if (point.position.isZero(0.0F) || !point.position.allFinite()) continue;
    const Pose3 T_world_body =
        recording.motion().PoseAt(start + Duration::FromNanoseconds(point.offset_ns));
    points.push_back(T_world_body * (T_body_lidar * point.position.cast<double>()));
  }
  return points;
}

void DrawPoints(const Recording& recording, const CameraSpec& camera, Time time,
                const std::vector<Eigen::Vector3d>& points, Image& image) {
  const Pose3 T_world_camera = recording.motion().PoseAt(time) * camera.T_body_camera;
  const Pose3 T_camera_world = T_world_camera.inverse();
  const WorldSnapshot snapshot = recording.world().At(time);
  for (const Eigen::Vector3d& point : points) {
    const auto pixel = camera.model->Project(T_camera_world * point);
    if (!pixel || !camera.model->InImage(*pixel)) continue;
    const Eigen::Vector3d ray = point - T_world_camera.translation();
    const double range = ray.norm();
    // Hidden from the camera, though not from the LiDAR.
    const auto hit = snapshot.Cast(T_world_camera.translation(), ray / range, range);
    if (hit && hit->range < 0.97 * range - 0.1) continue;
    Paint(image, static_cast<int>(std::lround(pixel->x())),
          static_cast<int>(std::lround(pixel->y())), ColourOfRange(range));
  }
}

void Paste(const Image& tile, int column, int row, Image& sheet) {
  const auto bytes = 3 * static_cast<std::size_t>(tile.width);
  for (int y = 0; y < tile.height; ++y) {
    const auto* from = tile.pixels.data() + static_cast<std::size_t>(y) * bytes;
    const auto to = 3 * (static_cast<std::size_t>(row + y) * static_cast<std::size_t>(sheet.width) +
                         static_cast<std::size_t>(column));
    std::copy(from, from + bytes, sheet.pixels.begin() + static_cast<std::ptrdiff_t>(to));
  }
}

}  // namespace

mlvi::Expected<void> WriteContactSheet(const Recording& recording, double share,
                                       const std::string& path) {
  std::vector<Image> plain, drawn;
  int width = 0, height = 0;
  for (const CameraStream& stream : recording.cameras()) {
    if (stream.size() == 0) continue;
    const auto index = static_cast<std::size_t>(share * static_cast<double>(stream.size() - 1));
    const CameraSpec& camera =
        recording.options().rig.true_rig.cameras[static_cast<std::size_t>(stream.camera())];
    plain.push_back(Coloured(stream.Take(index)));
    drawn.push_back(plain.back());
    DrawPoints(recording, camera, stream.TimeOf(index),
               WorldPoints(recording, stream.TimeOf(index)), drawn.back());
    width = std::max(width, plain.back().width);
    height = std::max(height, plain.back().height);
  }
  if (plain.empty()) {
    return MakeError(ErrorKind::kConfiguration,
                     "a contact sheet needs images: a rig with cameras, --cameras other than none, "
                     "and a recording of 0.05 s or longer");
  }
  const int rows = (static_cast<int>(plain.size()) + 1) / 2;
  Image sheet{.width = 2 * width, .height = 2 * rows * height, .channels = 3};
  sheet.pixels.resize(3 * static_cast<std::size_t>(sheet.width) *
                      static_cast<std::size_t>(sheet.height));
  for (int i = 0; i < static_cast<int>(plain.size()); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Paste(drawn[k], i % 2 * width, i / 2 * height, sheet);
    Paste(plain[k], i % 2 * width, (rows + i / 2) * height, sheet);
  }
  return WriteImage(sheet, path);
}
