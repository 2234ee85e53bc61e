// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_picture.h"

#include <cmath>

namespace mlvi {

std::vector<DepthPicture> DrawDepthPictures(const PanoramaModel& model,
                                            std::span<const Eigen::Vector3d> points_pano) {
  std::vector<DepthPicture> pictures;
  for (int camera = 0; camera < model.cameras(); ++camera) {
    const int width = model.camera(camera).width(), height = model.camera(camera).height();
    pictures.push_back(
        {width, height,
         std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))});
  }
  for (const Eigen::Vector3d& point : points_pano) {
    const auto views = model.ViewsOfPoint(point);
    if (views.empty()) continue;
    const CameraView& best = views.front();
    DepthPicture& picture = pictures[static_cast<std::size_t>(best.camera)];
    const auto index = static_cast<std::size_t>(std::lround(best.pixel.y()) * picture.width +
                                                std::lround(best.pixel.x()));
    const auto depth =
        static_cast<float>((point - model.T_pano_camera(best.camera).translation()).norm());
    float& drawn = picture.depths[index];
    if (drawn == 0.0F || depth < drawn) drawn = depth;
  }
  return pictures;
}

}  // namespace mlvi
