// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/panorama/panorama_model.h"

namespace mlvi {

// A sparse depth picture of one camera.
struct DepthPicture {
  int width = 0, height = 0;
  std::vector<float> depths;  // m from the camera centre, row-major; 0: no point

  float At(int x, int y) const {
    return depths[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

// One picture per camera of points in pano (m), the nearest point per pixel. A point that several
// cameras see is drawn in the one that holds it best, nearest to its optical axis, and there only.
std::vector<DepthPicture> DrawDepthPictures(const PanoramaModel& model,
                                            std::span<const Eigen::Vector3d> points_pano);

}  // namespace mlvi
