// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

// Grey values, root mean square along the weakest direction over the window: less is noise.
constexpr float kLeastTexture = 1.0F;
// Noise of grey values, one sigma: sets the weight of the prior on the warp.
constexpr float kGreySigma = 2.0F;

bool Fits(const cv::Mat& image, const Eigen::Vector2f& center, const Eigen::Vector2f& reach) {
  // One pixel more for the neighbours of the interpolation.
  return center.x() - reach.x() >= 1.0F && center.y() - reach.y() >= 1.0F &&
         center.x() + reach.x() < static_cast<float>(image.cols - 2) &&
         center.y() + reach.y() < static_cast<float>(image.rows - 2);
}

// Bilinear grey value at p, whose four neighbours are in the image.
float GreyAt(const cv::Mat& image, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float dx = x - static_cast<float>(column), dy = y - static_cast<float>(row);
  const std::uint8_t* upper = image.ptr<std::uint8_t>(row) + column;
  const std::uint8_t* lower = upper + image.step[0];
  const float top = static_cast<float>(upper[0]) + dx * static_cast<float>(upper[1] - upper[0]);
  const float bottom = static_cast<float>(lower[0]) + dx * static_cast<float>(lower[1] - lower[0]);
  return top + dy * (bottom - top);
}

// Grey values at center + warp * offset for all offsets of the window, row by row.
void Sample(const cv::Mat& image, const Eigen::Vector2f& center, const Eigen::Matrix2f& warp,
            int radius, Eigen::VectorXf& grey) {
  Eigen::Index i = 0;
  for (int v = -radius; v <= radius; ++v) {
    const Eigen::Vector2f start = center + warp.col(1) * static_cast<float>(v);
    for (int u = -radius; u <= radius; ++u) {
      const Eigen::Vector2f p = start + warp.col(0) * static_cast<float>(u);
      grey[i++] = GreyAt(image, p.x(), p.y());
    }
  }
}

// How far the warped window reaches from its middle.
Eigen::Vector2f Reach(const Eigen::Matrix2f& warp, int radius) {
  return static_cast<float>(radius) * warp.cwiseAbs().rowwise().sum();
}

// Takes mean and length away: what is left does not change with gain and offset. Returns the
// length.
float Normalize(Eigen::VectorXf& grey) {
  grey.array() -= grey.mean();
  const float length = grey.norm();
  if (length > 0.0F) grey /= length;
  return length;
}

template <typename Scalar>
Scalar LargestEigenvalue(const Eigen::Matrix<Scalar, 2, 2>& symmetric) {
  const Scalar half_trace = symmetric.trace() / 2;
  return half_trace +
         std::sqrt(std::max(half_trace * half_trace - symmetric.determinant(), Scalar(0)));
}

}  // namespace

double PatchMatch::sigma() const { return std::sqrt(LargestEigenvalue(covariance)); }

double Patch::position_sigma() const { return std::sqrt(LargestEigenvalue(position_covariance_)); }

void PatchConfig::Declare(ConfigDeclaration& d) {
  d.Field("size_px", size_px, "px", "Side of the window, odd", {5.0, 31.0});
  d.Field("max_iterations", max_iterations, "", "Steps of an alignment", {1.0, 100.0});
  d.Field("step_px", step_px, "px", "A shorter step ends it", {1e-4, 1.0});
  d.Field("max_shift_px", max_shift_px, "px", "Farthest from where flow put it", {0.1, 20.0});
  d.Field("warp_sigma", warp_sigma, "",
          "Relative stretch and shear per image beyond what is predicted, one sigma", {0.0, 1.0});
  d.Field("min_correlation", min_correlation, "",
          "Of grey values with those of the patch; below, it is not the same place", {0.0, 1.0});
}

std::optional<Patch> Patch::Cut(const ImagePyramid& image, const Eigen::Vector2d& pixel,
                                const PatchConfig& config) {
  Patch patch;
  patch.radius_ = config.size_px / 2;
  const Eigen::Vector2f center = pixel.cast<float>();
  const Eigen::Matrix2f identity = Eigen::Matrix2f::Identity();
  // Central differences need one pixel around.
  if (!Fits(image.image, center, Reach(identity, patch.radius_ + 1))) return std::nullopt;
  const Eigen::Index side = 2 * patch.radius_ + 1, wide = side + 2;
  Eigen::VectorXf around(wide * wide);
  Sample(image.image, center, identity, patch.radius_ + 1, around);
  patch.grey_.resize(side * side);
  patch.slope_.resize(side * side, 6);
  for (Eigen::Index v = 0, i = 0; v < side; ++v) {
    for (Eigen::Index u = 0; u < side; ++u, ++i) {
      const Eigen::Index at = (v + 1) * wide + u + 1;
      patch.grey_[i] = around[at];
      const float by_x = 0.5F * (around[at + 1] - around[at - 1]);
      const float by_y = 0.5F * (around[at + wide] - around[at - wide]);
      const auto x = static_cast<float>(u - patch.radius_);
      const auto y = static_cast<float>(v - patch.radius_);
      patch.slope_.row(i) << by_x, by_y, by_x * x, by_x * y, by_y * x, by_y * y;
    }
  }
  const float length = Normalize(patch.grey_);
  if (!(length > 0.0F)) return std::nullopt;
  // With the slopes' share along constants and along the grey values gone, offset and gain need no
  // unknowns of their own.
  for (int k = 0; k < 6; ++k) {
    auto slope = patch.slope_.col(k);
    slope.array() -= slope.mean();
    slope -= patch.grey_ * patch.grey_.dot(slope);
    slope /= length;
  }
  Eigen::Matrix<float, 6, 6> hessian = patch.slope_.transpose() * patch.slope_;
  const Eigen::Matrix2f shift = hessian.topLeftCorner<2, 2>();
  const float weakest = shift.trace() - LargestEigenvalue(shift);
  const float count = static_cast<float>(side * side);
  if (!(weakest * length * length > kLeastTexture * kLeastTexture * count)) return std::nullopt;
  const float noise = kGreySigma / length;
  const float prior = noise / static_cast<float>(std::max(config.warp_sigma, 1e-4));
  patch.warp_weight_ = prior * prior;
  hessian.diagonal().tail<4>().array() += patch.warp_weight_;
  patch.inverse_hessian_ = hessian.inverse();
  patch.position_covariance_ = patch.inverse_hessian_.topLeftCorner<2, 2>().cast<double>() / count;
  return patch;
}

std::optional<PatchMatch> Patch::Align(const ImagePyramid& image, const Eigen::Matrix2d& warp_of,
                                       const Eigen::Vector2d& guess,
                                       const PatchConfig& config) const {
  Eigen::Matrix2f warp = warp_of.cast<float>();
  const Eigen::Matrix2f from_predicted = warp.inverse();
  const Eigen::Vector2f start = guess.cast<float>();
  const auto most = static_cast<float>(config.max_shift_px);
  Eigen::Vector2f center = start;
  Eigen::VectorXf grey(grey_.size());
  PatchMatch match;
  for (int i = 0; i < config.max_iterations && !match.converged; ++i) {
    if (!Fits(image.image, center, Reach(warp, radius_))) return std::nullopt;
    Sample(image.image, center, warp, radius_, grey);
    if (!(Normalize(grey) > 0.0F)) return std::nullopt;
    match.correlation = grey.dot(grey_);
    // At the goal grey = grey_; where the window is moved by (s, D), it is grey_ + slope_ (s, D).
    // The prior holds the goal, warp (I + D)^-1, to the warp that was predicted.
    const Eigen::Matrix2f strayed = from_predicted * warp - Eigen::Matrix2f::Identity();
    Eigen::Matrix<float, 6, 1> gradient = slope_.transpose() * grey;
    gradient.tail<4>() +=
        warp_weight_ * Eigen::Vector4f(strayed(0, 0), strayed(0, 1), strayed(1, 0), strayed(1, 1));
    const Eigen::Matrix<float, 6, 1> moved = inverse_hessian_ * gradient;
    Eigen::Matrix2f stretch;
    stretch << 1.0F + moved[2], moved[3], moved[4], 1.0F + moved[5];
    if (!(stretch.determinant() > 0.1F)) return std::nullopt;
    warp *= stretch.inverse();
    const Eigen::Vector2f step = warp * moved.head<2>();
    center -= step;
    if ((center - start).norm() > most) return std::nullopt;
    match.converged = step.norm() < static_cast<float>(config.step_px);
  }
  match.pixel = center.cast<double>();
  match.warp = warp.cast<double>();
  // Grey values of unit length differ by 2 (1 - correlation), squared; shifts of the window are
  // stretched into this image as the window is.
  match.covariance = std::max(0.0, 2.0 * (1.0 - match.correlation)) * match.warp *
                     position_covariance_ * match.warp.transpose();
  return match;
}

}  // namespace mlvi
