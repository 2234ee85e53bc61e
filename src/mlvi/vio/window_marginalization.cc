// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window_marginalization.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "mlvi/base/error.h"
#include "mlvi/vio/calibration_prior.h"
#include "mlvi/vio/window_features.h"

namespace mlvi {
namespace {

// Relative to a matrix of unit diagonal: weaker directions count as unknown.
constexpr double kUnknown = 1e-12;
// 1/m: far points whose depth is known to this are as good as others.
constexpr double kFarSigma = 0.02;
// An estimate that failed for one reason or another is believed to be less certain than it said by
// this factor.
constexpr double kDoubt = 2.0;

using Blocks = std::vector<WindowPrior::Block>;

// The coordinates that a linearised problem says something about, without the first frame's.
Blocks InvolvedBlocks(const VioWindow& window, const WindowLayout& layout,
                      const Eigen::MatrixXd& H) {
  Blocks blocks;
  for (int i = 1; i < layout.frames(); ++i) {
    const Eigen::VectorXd diagonal = H.diagonal().segment<frame_index::kSize>(layout.frame(i));
    const FrameId id = window.frames[static_cast<std::size_t>(i)].id;
    if (diagonal.tail<9>().maxCoeff() > 0.0) {
      blocks.push_back({id, 0, frame_index::kSize});
    } else if (diagonal.head<6>().maxCoeff() > 0.0) {
      blocks.push_back({id, 0, 6});
    }
  }
  if (layout.calibration_size() > 0) {
    blocks.push_back({FrameId(), 0, layout.calibration_size()});
  }
  return blocks;
}

std::vector<int> CoordinatesOf(const Blocks& blocks, const VioWindow& window,
                               const WindowLayout& layout) {
  std::vector<int> result;
  for (const WindowPrior::Block& block : blocks) {
    const int start =
        block.frame.valid() ? layout.frame(window.FindFrame(block.frame)) : layout.calibration();
    for (int k = 0; k < block.size; ++k) result.push_back(start + block.first + k);
  }
  return result;
}

// R with R^T R = H^-1 where H tells something, and without what it says nothing about: directions
// that nothing ties to others, which take nothing along.
Eigen::MatrixXd InverseRoot(const Eigen::MatrixXd& H) {
  const Eigen::VectorXd scale = H.diagonal().array().max(1e-30).sqrt().inverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  if (llt.info() == Eigen::Success) return llt.matrixL().solve(Eigen::MatrixXd(scale.asDiagonal()));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::ArrayXd values = eigen.eigenvalues();
  const Eigen::ArrayXd inverse =
      (values > kUnknown).select(values.max(kUnknown).sqrt().inverse(), 0.0);
  return inverse.matrix().asDiagonal() * eigen.eigenvectors().transpose() * scale.asDiagonal();
}

// H and b without the first `removed` coordinates, of which only `kept` remain.
ReducedSystem SchurComplement(const ReducedSystem& system, int removed,
                              const std::vector<int>& kept) {
  const Eigen::MatrixXd H = system.H.selfadjointView<Eigen::Upper>();
  Eigen::MatrixXd cross(removed, kept.size());
  ReducedSystem result{Eigen::MatrixXd(kept.size(), kept.size()), Eigen::VectorXd(kept.size())};
  for (std::size_t c = 0; c < kept.size(); ++c) {
    const auto column = static_cast<Eigen::Index>(c);
    cross.col(column) = H.col(kept[c]).head(removed);
    result.b[column] = system.b[kept[c]];
    for (std::size_t r = 0; r < kept.size(); ++r) {
      result.H(static_cast<Eigen::Index>(r), column) = H(kept[r], kept[c]);
    }
  }
  const Eigen::MatrixXd root = InverseRoot(H.topLeftCorner(removed, removed));
  const Eigen::MatrixXd half = root * cross;
  const Eigen::VectorXd half_b = root * system.b.head(removed);
  result.H -= half.transpose() * half;
  result.b -= half.transpose() * half_b;
  return result;
}

// J and r with J^T J = H and J^T r = -b.
void SquareRoot(const ReducedSystem& system, Eigen::MatrixXd& J, Eigen::VectorXd& r) {
  const Eigen::VectorXd scale = system.H.diagonal().array().max(1e-30).sqrt();
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * system.H * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (scaled + scaled.transpose()));
  const Eigen::ArrayXd values = eigen.eigenvalues();
  const Eigen::ArrayXd root = (values > kUnknown).select(values.max(kUnknown).sqrt(), 0.0);
  const Eigen::ArrayXd inverse_root = (values > kUnknown).select(root.max(1e-30).inverse(), 0.0);
  J = root.matrix().asDiagonal() * eigen.eigenvectors().transpose() * scale.asDiagonal();
  r = -(inverse_root.matrix().asDiagonal() *
        (eigen.eigenvectors().transpose() * inverse.cwiseProduct(system.b)));
}

// The observations of a feature that go with the first frame, and what stays in `feature`.
WindowFeature TakeObservations(WindowFeature& feature, const VioWindow& window,
                               const WindowConfig& config) {
  const auto frames = static_cast<int>(window.frames.size());
  const int last = feature.alive ? std::min(config.keyframes / 2, frames - 2) : frames - 2;
  std::size_t count = 0;
  while (count < feature.observations.size() &&
         window.FindFrame(feature.observations[count].frame) <= last) {
    ++count;
  }
  WindowFeature taken = feature;
  taken.observations.resize(count);
  if (count == feature.observations.size()) {
    feature.observations.clear();
  } else {
    AnchorAt(feature, count, window, config);
    feature.lidar.reset();
  }
  return taken;
}

bool SeesFrame(const WindowFeature& feature, FrameId frame) {
  return feature.observations.front().frame == frame;
}

// The features that go with the first frame: their window, without them changed.
std::vector<std::size_t> KnownFeatures(const VioWindow& window, const WindowConfig& config) {
  const LinearizedWindow system = Linearize(
      window, config, 0.0,
      {.bearings = true, .imu = false, .rest = false, .prior = false, .calibration = false});
  std::vector<std::size_t> known;
  for (std::size_t f = 0; f < window.features.size(); ++f) {
    const double information = system.feature_information[static_cast<Eigen::Index>(f)];
    const double allowed =
        std::max(kFarSigma, config.max_relative_depth_sigma * window.features[f].inverse_depth);
    if (information * allowed * allowed > 1.0) known.push_back(f);
  }
  return known;
}

// The part of the window that becomes the prior: it takes observations out of `window`.
VioWindow TakePart(VioWindow& window, const WindowConfig& config) {
  VioWindow part;
  part.frames = window.frames;
  part.calibration = window.calibration;
  part.nominal = window.nominal;
  part.prior = window.prior;
  std::vector<std::size_t> origin;
  for (std::size_t f = 0; f < window.features.size(); ++f) {
    WindowFeature copy = window.features[f];
    if (!SeesFrame(copy, window.frames.front().id)) continue;
    part.features.push_back(TakeObservations(copy, window, config));
    origin.push_back(f);
  }
  const std::vector<std::size_t> known = KnownFeatures(part, config);
  std::vector<WindowFeature> taken;
  for (const std::size_t k : known) {
    taken.push_back(part.features[k]);
    TakeObservations(window.features[origin[k]], window, config);
  }
  part.features = std::move(taken);
  std::erase_if(window.features, [](const WindowFeature& f) { return f.observations.empty(); });
  return part;
}

}  // namespace

WindowPrior FirstPrior(const VioWindow& window, const Matrix15d& covariance,
                       const CalibrationKnowledge& known) {
  MLVI_CHECK(window.frames.size() == 1, "{} frames", window.frames.size());
  WindowPrior prior{.calibration = window.calibration};
  constexpr int kState = frame_index::kSize;
  const auto size = static_cast<int>(known.b.size());
  prior.blocks.push_back({window.frames.front().id, 0, kState});
  if (size > 0) prior.blocks.push_back({FrameId(), 0, size});
  prior.sqrt_information = Eigen::MatrixXd::Zero(kState + size, kState + size);
  prior.residual = Eigen::VectorXd::Zero(kState + size);
  prior.sqrt_information.topLeftCorner<kState, kState>() = InverseRoot(covariance);
  if (size == 0) return prior;
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
  SquareRoot(known, J, r);
  prior.sqrt_information.bottomRightCorner(size, size) = J;
  prior.residual.tail(size) = r;
  return prior;
}

CalibrationKnowledge KnowledgeOf(const VioWindow& window, const WindowConfig& config,
                                 const Eigen::MatrixXd& covariance) {
  CalibrationKnowledge known;
  const WindowLayout layout = window.Layout(config);
  const int size = layout.calibration_size();
  if (size == 0) return known;
  // What the rig file says remains a factor of its own: it must not count twice.
  LinearizedWindow file{.layout = layout};
  file.H = Eigen::MatrixXd::Zero(layout.size(), layout.size());
  file.b = Eigen::VectorXd::Zero(layout.size());
  AddCalibrationPrior(window, config, file);
  const Eigen::MatrixXd of_file =
      file.H.bottomRightCorner(size, size).selfadjointView<Eigen::Upper>();
  const Eigen::MatrixXd root = InverseRoot(covariance);
  const Eigen::MatrixXd difference = root.transpose() * root - of_file;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(difference);
  // Along what images say nothing about the difference is one of two equal numbers.
  known.H = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
            eigen.eigenvectors().transpose() / (kDoubt * kDoubt);
  known.b = -file.b.tail(size) / (kDoubt * kDoubt);
  return known;
}

WindowPrior PriorWithoutFirstFrame(VioWindow& window, const LinearizedWindow& system) {
  const ReducedSystem reduced = EliminateFeatures(system);
  WindowPrior prior{.blocks = InvolvedBlocks(window, system.layout, reduced.H),
                    .calibration = window.calibration};
  const ReducedSystem rest = SchurComplement(reduced, frame_index::kSize,
                                             CoordinatesOf(prior.blocks, window, system.layout));
  SquareRoot(rest, prior.sqrt_information, prior.residual);
  for (const WindowPrior::Block& block : prior.blocks) {
    if (!block.frame.valid()) continue;
    WindowFrame& frame = window.frames[static_cast<std::size_t>(window.FindFrame(block.frame))];
    frame.prior_state = frame.state;
  }
  return prior;
}

void MarginalizeFirstFrame(VioWindow& window, const WindowConfig& config, double gravity) {
  MLVI_CHECK(window.frames.size() >= 3, "{} frames", window.frames.size());
  const FrameId first = window.frames.front().id;
  const VioWindow part = TakePart(window, config);
  const LinearizedWindow system =
      Linearize(part, config, gravity, {.first_only = true, .calibration = false});
  window.prior = PriorWithoutFirstFrame(window, system);
  ForgetObservations(window, first, config);
  window.frames.erase(window.frames.begin());
  window.frames.front().imu.reset();
}

void DropFrame(VioWindow& window, std::size_t index, const WindowConfig& config,
               const ImuSpec& imu) {
  MLVI_CHECK(index > 0 && index + 1 < window.frames.size(), "frame {} of {}", index,
             window.frames.size());
  const WindowFrame& dropped = window.frames[index];
  MLVI_CHECK(!dropped.prior_state, "frame {} is part of the prior", dropped.id.value());
  ForgetObservations(window, dropped.id, config);
  WindowFrame& next = window.frames[index + 1];
  std::vector<ImuSample> samples = dropped.imu->samples;
  samples.insert(samples.end(), next.imu->samples.begin() + 1, next.imu->samples.end());
  const Time from = window.frames[index - 1].state.stamp;
  next.imu = Connect(samples, from, next.state.stamp, window.frames[index - 1].state.bias, imu);
  window.frames.erase(window.frames.begin() + static_cast<std::ptrdiff_t>(index));
}

}  // namespace mlvi
