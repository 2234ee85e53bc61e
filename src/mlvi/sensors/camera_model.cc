// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/camera_model.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "mlvi/base/suggestion.h"
#include "mlvi/sensors/camera_double_sphere.h"
#include "mlvi/sensors/camera_kannala_brandt.h"
#include "mlvi/sensors/camera_mei.h"
#include "mlvi/sensors/camera_pinhole_radtan.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;
using Values = std::vector<double>;
using Result = Expected<std::shared_ptr<const CameraModel>>;

// What a calibration of a model consists of, and how to make one.
struct ModelCase {
  std::string name;
  std::vector<std::string> intrinsics;
  std::vector<std::string> distortion;
  std::size_t
      optional_distortion;  // how many of the last distortion values may be absent, standing for zero
  std::function<Result(int, int, const Eigen::VectorXd&)> make;  // parameters: fx fy cx cy shape
};

template <typename Model>
Result Make(int width, int height, const Eigen::VectorXd& parameters) {
  if (auto valid = Model::ValidateShape(parameters.tail(parameters.size() - 4)); !valid) {
    return tl::unexpected(valid.error());
  }
  return std::make_shared<const Model>(width, height, parameters);
}

std::vector<ModelCase> ModelCases() {
  const std::vector<std::string> radtan = {"k1", "k2", "p1", "p2"};
  const std::vector<std::string> radtan5 = {"k1", "k2", "p1", "p2", "k3"};
  return {
      {"equidistant",
       {"fx", "fy", "cx", "cy"},
       {"k1", "k2", "k3", "k4"},
       0,
       Make<KannalaBrandtCamera>},
      {"mei", {"xi", "fx", "fy", "cx", "cy"}, radtan, 0, Make<MeiCamera>},
      {"double_sphere", {"xi", "alpha", "fx", "fy", "cx", "cy"}, {}, 0, Make<DoubleSphereCamera>},
      {"pinhole_radtan", {"fx", "fy", "cx", "cy"}, radtan5, 1, Make<PinholeRadtanCamera>},
  };
}

bool AllFinite(const Values& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

Expected<void> CheckCounts(const ModelCase& model, const Values& intrinsics,
                           const Values& distortion) {
  if (intrinsics.size() != model.intrinsics.size()) {
    return MakeError(kKind, "camera model {}: {} intrinsics given, expected {} ({})", model.name,
                     intrinsics.size(), model.intrinsics.size(), fmt::join(model.intrinsics, ", "));
  }
  const std::size_t most = model.distortion.size(), least = most - model.optional_distortion;
  if (distortion.size() < least || distortion.size() > most) {
    return MakeError(kKind, "camera model {}: {} distortion coefficients given, expected {} ({})",
                     model.name, distortion.size(), most, fmt::join(model.distortion, ", "));
  }
  if (!AllFinite(intrinsics) || !AllFinite(distortion)) {
    return MakeError(kKind,
                     "camera model {}: a value is not finite: intrinsics [{}], distortion [{}]",
                     model.name, fmt::join(intrinsics, ", "), fmt::join(distortion, ", "));
  }
  return {};
}

// Calibration files put the parameters of the projection before fx; the models want fx fy cx cy
// first.
Eigen::VectorXd ToParameters(const ModelCase& model, const Values& intrinsics,
                             const Values& distortion) {
  const std::size_t lead = intrinsics.size() - 4;
  Values sorted(intrinsics.begin() + static_cast<std::ptrdiff_t>(lead), intrinsics.end());
  sorted.insert(sorted.end(), intrinsics.begin(),
                intrinsics.begin() + static_cast<std::ptrdiff_t>(lead));
  sorted.insert(sorted.end(), distortion.begin(), distortion.end());
  sorted.resize(model.intrinsics.size() + model.distortion.size(), 0.0);
  return Eigen::Map<Eigen::VectorXd>(sorted.data(), static_cast<Eigen::Index>(sorted.size()));
}

Expected<void> CheckImage(const ModelCase& model, int width, int height, const Eigen::VectorXd& p) {
  if (width <= 0 || height <= 0) {
    return MakeError(kKind, "camera model {}: image size {} x {}: must be positive", model.name,
                     width, height);
  }
  if (p[0] <= 0.0 || p[1] <= 0.0) {
    return MakeError(kKind, "camera model {}: focal lengths fx = {}, fy = {} px: must be positive",
                     model.name, p[0], p[1]);
  }
  return {};
}

}  // namespace

std::vector<std::string> CameraModel::parameter_names() const {
  std::vector<std::string> names = {"fx", "fy", "cx", "cy"};
  const std::vector<std::string> shape = shape_names();
  names.insert(names.end(), shape.begin(), shape.end());
  return names;
}

std::optional<Eigen::Vector2d> CameraModel::Project(const Eigen::Vector3d& point,
                                                    PointJacobian* d_point,
                                                    ParameterJacobian* d_parameters) const {
  Eigen::Vector2d m;
  ParameterJacobian d_shape;
  if (d_parameters != nullptr) d_shape.setZero(2, parameters_.size() - 4);
  PointJacobian d_m;
  if (!Flatten(point, m, d_point != nullptr ? &d_m : nullptr,
               d_parameters != nullptr ? &d_shape : nullptr)) {
    return std::nullopt;
  }
  const Eigen::Array2d focal = parameters_.head<2>();
  if (d_point != nullptr) *d_point = focal.matrix().asDiagonal() * d_m;
  if (d_parameters != nullptr) {
    d_parameters->setZero(2, parameters_.size());
    d_parameters->leftCols<2>() = m.asDiagonal();
    d_parameters->middleCols<2>(2).setIdentity();
    d_parameters->rightCols(d_shape.cols()) = focal.matrix().asDiagonal() * d_shape;
  }
  return Eigen::Vector2d(focal * m.array() + parameters_.segment<2>(2).array());
}

std::optional<Eigen::Vector3d> CameraModel::Unproject(const Eigen::Vector2d& pixel,
                                                      PixelJacobian* d_pixel) const {
  Eigen::Vector3d bearing;
  const Eigen::Vector2d m = (pixel - principal_point()).array() / parameters_.head<2>().array();
  if (!m.allFinite() || !Lift(m, bearing)) return std::nullopt;
  if (d_pixel != nullptr) {
    // Project has the inverse function's Jacobian J (2x3) with J bearing = 0, as it does not depend
    // on the length. On the tangent plane of the bearing the inverse is the pseudo-inverse J^T (J
    // J^T)^-1.
    PointJacobian J;
    if (!Project(bearing, &J)) return std::nullopt;
    *d_pixel = J.transpose() * (J * J.transpose()).inverse();
  }
  return bearing;
}

Expected<std::shared_ptr<const CameraModel>> MakeCameraModel(
    std::string_view name, int width, int height, const std::vector<double>& intrinsics,
    const std::vector<double>& distortion) {
  for (const ModelCase& model : ModelCases()) {
    if (model.name != name) continue;
    if (auto valid = CheckCounts(model, intrinsics, distortion); !valid) {
      return tl::unexpected(valid.error());
    }
    const Eigen::VectorXd parameters = ToParameters(model, intrinsics, distortion);
    if (auto valid = CheckImage(model, width, height, parameters); !valid) {
      return tl::unexpected(valid.error());
    }
    return model.make(width, height, parameters);
  }
  return MakeError(kKind, "unknown camera model '{}', known are {}{}", name,
                   fmt::join(CameraModelNames(), ", "), DidYouMean(name, CameraModelNames()));
}

std::vector<std::string> CameraModelNames() {
  std::vector<std::string> names;
  for (const ModelCase& model : ModelCases()) names.push_back(model.name);
  return names;
}

}  // namespace mlvi
