// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/features/image_pyramid.h"

namespace mlvi {

struct PatchConfig {
  int size_px = 13;
  int max_iterations = 20;
  double step_px = 0.005;
  double max_shift_px = 2.0;
  double min_correlation = 0.85;
  double warp_sigma = 0.05;
  void Declare(ConfigDeclaration& d);
};

struct PatchMatch {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // where the middle of the patch lies
  Eigen::Matrix2d warp = Eigen::Matrix2d::Identity();
  double correlation = 0.0;  // of grey values, in [-1, 1]
  // px^2, of `pixel`, as if what differs from the patch were independent from pixel to pixel of the
  // patch. It is not: errors are several times what this says, but in proportion to it.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  bool converged = false;

  // px, one sigma along the worst direction.
  double sigma() const;
};

// A window of an image that can be found again in later ones, seen under another angle and in
// another light: inverse-compositional alignment (Baker and Matthews 2004) of position and linear
// warp, with a gain and an offset of grey values. What flow from image to image loses by and by,
// comparison with the first window gives back. The warp is a free unknown because a wrong one moves
// the position: corners are not symmetric.
class Patch {
 public:
  // The window around `pixel`; empty when it leaves the image or has no texture.
  static std::optional<Patch> Cut(const ImagePyramid& image, const Eigen::Vector2d& pixel,
                                  const PatchConfig& config);

  // px: what white noise as strong as the contrast of the window would move it by along the worst
  // direction (one sigma), with the warp unknown. 0.15 on fine texture, above 1 on a nearly straight
  // edge, whatever the contrast.
  double position_sigma() const;

  // `warp`, from which the alignment starts, maps small pixel differences of the patch's own image
  // to those of `image`. The result is empty when the window leaves the image or `guess` by more
  // than max_shift_px.
  std::optional<PatchMatch> Align(const ImagePyramid& image, const Eigen::Matrix2d& warp,
                                  const Eigen::Vector2d& guess, const PatchConfig& config) const;

 private:
  Patch() = default;

  int radius_ = 0;
  Eigen::VectorXf grey_;  // zero mean, unit length
  // Derivatives of grey_ by a shift (x, y) of the window and by the four numbers D (row by row) of
  // its warp I + D, orthogonal to grey_ and to constants.
  Eigen::Matrix<float, Eigen::Dynamic, 6> slope_;
  float warp_weight_ = 0.0F;  // of the prior on the warp, in units of inverse_hessian_
  Eigen::Matrix<float, 6, 6> inverse_hessian_;
  // px^2 in its own image, under noise as strong as its contrast.
  Eigen::Matrix2d position_covariance_ = Eigen::Matrix2d::Zero();
};

}  // namespace mlvi
