// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/spline.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <utility>

namespace mlvi {
namespace {

using Positions = Eigen::Matrix<double, Eigen::Dynamic, 3>;
using Sparse = Eigen::SparseMatrix<double>;

// Cumulative basis functions of the second to fourth control pose of a segment and their
// derivatives by u.
struct CumulativeBasis {
  std::array<double, 3> value, first, second;
};

CumulativeBasis CumulativeBasisAt(double u) {
  const double u2 = u * u, u3 = u2 * u;
  return {.value = {(5.0 + 3.0 * u - 3.0 * u2 + u3) / 6.0,
                    (1.0 + 3.0 * u + 3.0 * u2 - 2.0 * u3) / 6.0, u3 / 6.0},
          .first = {(1.0 - 2.0 * u + u2) / 2.0, (1.0 + 2.0 * u - 2.0 * u2) / 2.0, u2 / 2.0},
          .second = {u - 1.0, 1.0 - 2.0 * u, u}};
}

// The plain basis functions of the four control poses.
std::array<double, 4> BasisAt(double u) {
  const auto value = CumulativeBasisAt(u).value;
  return {1.0 - value[0], value[0] - value[1], value[1] - value[2], value[2]};
}

// The least-squares problem of a fit; it is linear in positions and, step by step, in small
// rotations.
class FitProblem {
 public:
  FitProblem(std::span<const Time> stamps, const SplineFitOptions& options)
      : data_(static_cast<int>(stamps.size()), ControlCount(stamps, options)),
        smoothness_(static_cast<int>(data_.cols()) - 3, static_cast<int>(data_.cols())),
        smoothing_(options.smoothing) {
    std::vector<Eigen::Triplet<double>> triplets;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      const std::int64_t ns = (stamps[i] - stamps[0]).nanoseconds();
      const std::int64_t dt = options.knot_interval.nanoseconds();
      const int first = static_cast<int>(std::min<std::int64_t>(ns / dt, data_.cols() - 4));
      const auto basis = BasisAt(static_cast<double>(ns - first * dt) / static_cast<double>(dt));
      for (int j = 0; j < 4; ++j)
        triplets.emplace_back(static_cast<int>(i), first + j, basis[static_cast<std::size_t>(j)]);
    }
    data_.setFromTriplets(triplets.begin(), triplets.end());
    triplets.clear();
    constexpr std::array<double, 4> kThirdDifference = {-1.0, 3.0, -3.0, 1.0};
    for (int i = 0; i < smoothness_.rows(); ++i) {
      for (int j = 0; j < 4; ++j)
        triplets.emplace_back(i, i + j, kThirdDifference[static_cast<std::size_t>(j)]);
    }
    smoothness_.setFromTriplets(triplets.begin(), triplets.end());
    solver_.compute(Sparse(data_.transpose() * data_ +
                           smoothing_ * Sparse(smoothness_.transpose() * smoothness_)));
  }

  bool solvable() const { return solver_.info() == Eigen::Success; }
  Eigen::Index controls() const { return data_.cols(); }

  // The control values c minimising |data - B c|^2 + smoothing |third_difference + D c|^2.
  Positions Solve(const Positions& data, const Positions& third_difference) const {
    return solver_.solve(data_.transpose() * data -
                         smoothing_ * (smoothness_.transpose() * third_difference));
  }

 private:
  static int ControlCount(std::span<const Time> stamps, const SplineFitOptions& options) {
    const std::int64_t dt = options.knot_interval.nanoseconds();
    return static_cast<int>(((stamps.back() - stamps.front()).nanoseconds() + dt - 1) / dt) + 3;
  }

  Sparse data_, smoothness_;
  double smoothing_;
  Eigen::SimplicialLDLT<Sparse> solver_;
};

Positions FitPositions(const FitProblem& problem, std::span<const Pose3> poses) {
  Positions data(static_cast<Eigen::Index>(poses.size()), 3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    data.row(static_cast<Eigen::Index>(i)) = poses[i].translation().transpose();
  }
  return problem.Solve(data, Positions::Zero(problem.controls() - 3, 3));
}

// Rotations on the geodesics between the given ones, at the instants of the control poses.
std::vector<Pose3> InitialControls(std::span<const Time> stamps, std::span<const Pose3> poses,
                                   Eigen::Index count, Duration knot_interval) {
  std::vector<Pose3> controls(static_cast<std::size_t>(count));
  std::size_t next = 1;
  for (std::size_t i = 0; i < controls.size(); ++i) {
    const Time time = stamps[0] + knot_interval * (static_cast<std::int64_t>(i) - 1);
    while (next + 1 < stamps.size() && stamps[next] < time) ++next;
    const double alpha =
        (time - stamps[next - 1]).seconds() / (stamps[next] - stamps[next - 1]).seconds();
    controls[i] = Interpolate(poses[next - 1], poses[next], std::clamp(alpha, 0.0, 1.0));
  }
  return controls;
}

// One Gauss-Newton step of the rotations: the largest correction made, rad. The Jacobian treats the
// control rotations of a segment as close to each other, which costs steps, not accuracy.
double CorrectRotations(const FitProblem& problem, std::span<const Time> stamps,
                        std::span<const Pose3> poses, Duration knot_interval,
                        std::vector<Pose3>& controls) {
  const PoseSpline spline(stamps[0], knot_interval, controls);
  Positions error(static_cast<Eigen::Index>(poses.size()), 3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Quaterniond at = spline.PoseAt(stamps[i]).rotation();
    error.row(static_cast<Eigen::Index>(i)) =
        LogSo3(at.conjugate() * poses[i].rotation()).transpose();
  }
  const auto step = [&](std::size_t i) {
    return LogSo3(controls[i].rotation().conjugate() * controls[i + 1].rotation());
  };
  Positions third(problem.controls() - 3, 3);
  for (std::size_t i = 0; i + 3 < controls.size(); ++i) {
    third.row(static_cast<Eigen::Index>(i)) =
        (step(i + 2) - 2.0 * step(i + 1) + step(i)).transpose();
  }
  const Positions correction = problem.Solve(error, third);
  for (std::size_t i = 0; i < controls.size(); ++i) {
    const Eigen::Vector3d delta = correction.row(static_cast<Eigen::Index>(i)).transpose();
    controls[i] = Pose3(controls[i].rotation() * ExpSo3(delta), controls[i].translation());
  }
  return correction.rowwise().norm().maxCoeff();
}

Expected<void> CheckFitInput(std::span<const Time> stamps, std::span<const Pose3> poses,
                             const SplineFitOptions& options) {
  MLVI_CHECK(stamps.size() == poses.size(), "{} stamps for {} poses", stamps.size(), poses.size());
  MLVI_CHECK(options.knot_interval > Duration(), "knot interval {} s",
             options.knot_interval.seconds());
  if (poses.size() < 2) {
    return MakeError(ErrorKind::kInput,
                     "a trajectory of {} poses cannot be fitted: it takes at least two",
                     poses.size());
  }
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] <= stamps[i - 1]) {
      return MakeError(
          ErrorKind::kInput,
          "pose {} at {} s is not later than its predecessor at {} s; sort the poses and "
          "remove repeated stamps",
          i, ToString(stamps[i]), ToString(stamps[i - 1]));
    }
  }
  return {};
}

}  // namespace

PoseSpline::PoseSpline(Time begin, Duration knot_interval, std::vector<Pose3> control_poses)
    : begin_(begin), knot_interval_(knot_interval), control_poses_(std::move(control_poses)) {
  MLVI_CHECK(control_poses_.size() >= 4, "{} control poses, 4 needed", control_poses_.size());
  MLVI_CHECK(knot_interval_ > Duration(), "knot interval {} s", knot_interval_.seconds());
  rotation_steps_.reserve(control_poses_.size() - 1);
  for (std::size_t i = 0; i + 1 < control_poses_.size(); ++i) {
    rotation_steps_.push_back(
        LogSo3(control_poses_[i].rotation().conjugate() * control_poses_[i + 1].rotation()));
  }
}

Time PoseSpline::end() const {
  return begin_ + knot_interval_ * static_cast<std::int64_t>(control_poses_.size() - 3);
}

PoseSpline::Segment PoseSpline::SegmentAt(Time time) const {
  MLVI_CHECK(time >= begin_ && time <= end(), "{} outside of [{}, {}]", ToString(time),
             ToString(begin_), ToString(end()));
  const std::int64_t ns = (time - begin_).nanoseconds(), dt = knot_interval_.nanoseconds();
  const std::int64_t last = static_cast<std::int64_t>(control_poses_.size()) - 4;
  const std::int64_t first = std::min(ns / dt, last);
  return {.first = static_cast<std::size_t>(first),
          .u = static_cast<double>(ns - first * dt) / static_cast<double>(dt)};
}

Pose3 PoseSpline::PoseAt(Time time) const {
  const Segment segment = SegmentAt(time);
  const auto basis = CumulativeBasisAt(segment.u).value;
  Eigen::Vector3d position = control_poses_[segment.first].translation();
  Eigen::Quaterniond rotation = control_poses_[segment.first].rotation();
  for (std::size_t j = 0; j < 3; ++j) {
    const std::size_t i = segment.first + j;
    position += basis[j] * (control_poses_[i + 1].translation() - control_poses_[i].translation());
    rotation = rotation * ExpSo3(basis[j] * rotation_steps_[i]);
  }
  return Pose3(rotation, position);
}

MotionSample PoseSpline::At(Time time) const {
  const Segment segment = SegmentAt(time);
  const CumulativeBasis basis = CumulativeBasisAt(segment.u);
  const double rate = 1.0 / knot_interval_.seconds(), rate2 = rate * rate;
  Eigen::Vector3d position = control_poses_[segment.first].translation();
  Eigen::Quaterniond rotation = control_poses_[segment.first].rotation();
  MotionSample sample;
  for (std::size_t j = 0; j < 3; ++j) {
    const std::size_t i = segment.first + j;
    const Eigen::Vector3d step =
        control_poses_[i + 1].translation() - control_poses_[i].translation();
    position += basis.value[j] * step;
    sample.velocity += rate * basis.first[j] * step;
    sample.acceleration += rate2 * basis.second[j] * step;
    // The recursions of Sommer et al. 2020 (angular velocity and acceleration of a product of
    // exponentials).
    const Eigen::Vector3d& d = rotation_steps_[i];
    const Eigen::Quaterniond A = ExpSo3(basis.value[j] * d);
    const Eigen::Quaterniond A_inverse = A.conjugate();
    const double d_rate = rate * basis.first[j];
    rotation = rotation * A;
    sample.angular_velocity = A_inverse * sample.angular_velocity + d_rate * d;
    sample.angular_acceleration = A_inverse * sample.angular_acceleration +
                                  d_rate * sample.angular_velocity.cross(d) +
                                  rate2 * basis.second[j] * d;
  }
  sample.T_world_body = Pose3(rotation, position);
  return sample;
}

PoseSpline PoseSpline::Transformed(const Pose3& T_new_world) const {
  std::vector<Pose3> controls = control_poses_;
  for (Pose3& pose : controls) pose = T_new_world * pose;
  return PoseSpline(begin_, knot_interval_, std::move(controls));
}

Expected<PoseSpline> FitPoseSpline(std::span<const Time> stamps, std::span<const Pose3> poses,
                                   const SplineFitOptions& options) {
  if (auto ok = CheckFitInput(stamps, poses, options); !ok) return tl::unexpected(ok.error());
  const FitProblem problem(stamps, options);
  if (!problem.solvable()) {
    return MakeError(
        ErrorKind::kInput,
        "the spline through {} poses with knots every {} s is undetermined; use longer "
        "knot intervals",
        poses.size(), options.knot_interval.seconds());
  }
  const Positions positions = FitPositions(problem, poses);
  std::vector<Pose3> controls =
      InitialControls(stamps, poses, problem.controls(), options.knot_interval);
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (CorrectRotations(problem, stamps, poses, options.knot_interval, controls) < 1e-10) break;
  }
  for (std::size_t i = 0; i < controls.size(); ++i) {
    controls[i] =
        Pose3(controls[i].rotation(), positions.row(static_cast<Eigen::Index>(i)).transpose());
  }
  return PoseSpline(stamps[0], options.knot_interval, std::move(controls));
}

}  // namespace mlvi
