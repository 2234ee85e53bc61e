// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/operator.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "mlvi/sim/places/bodies.h"
#include "mlvi/sim/walking_path.h"

namespace mlvi {
namespace {

constexpr Duration kKnots = Duration::FromMilliseconds(100);
constexpr double kFollow = 0.3, kTurn = 0.4;  // s, over which trunk and heading follow the rig
constexpr double kStride = 1.45;              // m, two steps

// A limb that hangs along -z in its own frame, from `joint` towards `end`.
Pose3 Hanging(const Eigen::Vector3d& joint, const Eigen::Vector3d& end) {
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  return Pose3(Eigen::Quaterniond::FromTwoVectors(down, end - joint), joint);
}

// Where the elbow hangs between shoulder and hand.
Eigen::Vector3d Elbow(const Eigen::Vector3d& shoulder, const Eigen::Vector3d& hand, double upper,
                      double lower) {
  const Eigen::Vector3d reach = hand - shoulder;
  const double distance = std::clamp(reach.norm(), std::abs(upper - lower), upper + lower);
  const Eigen::Vector3d along = reach.normalized();
  const double a = (upper * upper - lower * lower + distance * distance) / (2.0 * distance);
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d across = (down - down.dot(along) * along).normalized();
  return shoulder + a * along + std::sqrt(std::max(0.0, upper * upper - a * a)) * across;
}

// T_world_hips on the ground behind the rig, and the way walked until every knot.
struct Track {
  PoseSpline hips;
  std::vector<double> walked;  // m

  // m, from half a knot before to half a knot behind.
  double StepAt(std::size_t knot) const {
    const std::size_t next = std::min(knot + 1, walked.size() - 1),
                      last = knot - std::min<std::size_t>(knot, 1);
    return (walked[next] - walked[last]) / static_cast<double>(next - last);
  }
};

// The height of the ground under a place at the height of the rig, as a walker expects it.
double GroundUnder(const World& world, const Eigen::Vector3d& place, const Carrying& carrying) {
  constexpr double kStep = 0.35;  // m: treads behind; what stands higher is no ground
  const auto hit = world.Cast(place, -Eigen::Vector3d::UnitZ(), carrying.height + kStep);
  const bool ground = hit && hit->range > carrying.height - kStep;
  return place.z() - (ground ? hit->range : carrying.height);
}

Track Follow(const World& world, const PoseSpline& motion, const Eigen::Quaterniond& R_carrier_body,
             const Carrying& carrying, double hips) {
  const double dt = kKnots.seconds();
  const auto knots =
      static_cast<std::size_t>(std::ceil((motion.end() - motion.begin()).seconds() / dt)) + 4;
  std::vector<double> x, y, z, heading, ground;
  for (std::size_t i = 0; i < knots; ++i) {
    const Time time = motion.begin() + kKnots * (static_cast<std::int64_t>(i) - 1);
    const Pose3 T_world_body = motion.PoseAt(std::clamp(time, motion.begin(), motion.end()));
    const Eigen::Vector3d ahead =
        T_world_body.rotation() * R_carrier_body.conjugate() * Eigen::Vector3d::UnitX();
    const double angle = std::atan2(ahead.y(), ahead.x());
    const double last = heading.empty() ? angle : heading.back();
    heading.push_back(last + std::remainder(angle - last, 2.0 * std::numbers::pi));
    x.push_back(T_world_body.translation().x());
    y.push_back(T_world_body.translation().y());
    z.push_back(T_world_body.translation().z());
  }
  for (std::vector<double>* values : {&x, &y, &z}) *values = SmoothOpen(*values, kFollow / dt);
  heading = SmoothOpen(heading, kTurn / dt);
  const auto place = [&](std::size_t i) -> Eigen::Vector3d {
    const Eigen::Vector3d behind =
        ExpSo3({0.0, 0.0, heading[i]}) * Eigen::Vector3d(-carrying.distance, 0.0, 0.0);
    return Eigen::Vector3d(x[i], y[i], z[i]) + behind;
  };
  for (std::size_t i = 0; i < knots; ++i) ground.push_back(GroundUnder(world, place(i), carrying));
  ground = SmoothOpen(ground, kFollow / dt);
  std::vector<Pose3> poses;
  std::vector<double> walked = {0.0};
  for (std::size_t i = 0; i < knots; ++i) {
    if (i > 0) walked.push_back(walked.back() + std::hypot(x[i] - x[i - 1], y[i] - y[i - 1]));
    const Eigen::Vector3d at = place(i);
    poses.emplace_back(ExpSo3({0.0, 0.0, heading[i]}),
                       Eigen::Vector3d(at.x(), at.y(), ground[i] + hips));
  }
  return {.hips = PoseSpline(motion.begin(), kKnots, std::move(poses)),
          .walked = std::move(walked)};
}

class Bearer {
 public:
  Bearer(const World& world, const PoseSpline& motion, const Eigen::Quaterniond& R_carrier_body,
         const Carrying& carrying, const Build& build)
      : motion_(motion),
        R_carrier_body_(R_carrier_body),
        carrying_(carrying),
        build_(build),
        track_(Follow(world, motion, R_carrier_body, carrying, build.hips())) {}

  void Poses(double seconds, std::span<Pose3> T_world_part) const {
    const Time time = std::clamp(motion_.begin() + Duration::FromSeconds(seconds), motion_.begin(),
                                 motion_.end());
    const double knot = 1.0 + (time - motion_.begin()).seconds() / kKnots.seconds();
    const auto i = std::min(static_cast<std::size_t>(knot), track_.walked.size() - 2);
    const double share = knot - static_cast<double>(i);
    const double walked = std::lerp(track_.walked[i], track_.walked[i + 1], share);
    const double phase = 2.0 * std::numbers::pi / kStride * walked;
    const double step = std::lerp(track_.StepAt(i), track_.StepAt(i + 1), share);
    const double pace = std::min(1.0, step / kKnots.seconds() / 1.2);
    const Pose3 T_world_hips = track_.hips.PoseAt(time);
    const Pose3 sway(ExpSo3({0.05 * pace * std::sin(phase), 0.03, 0.06 * pace * std::sin(phase)}),
                     {0.0, 0.02 * pace * std::sin(phase), 0.0});
    T_world_part[kTrunk] = T_world_part[kHead] = T_world_hips * sway;
    PlaceLegs(T_world_hips, phase, pace, T_world_part);
    PlaceArms(T_world_hips * sway, motion_.PoseAt(time), T_world_part);
  }

 private:
  void PlaceLegs(const Pose3& T_world_hips, double phase, double pace,
                 std::span<Pose3> T_world_part) const {
    for (const std::size_t side : {0, 1}) {
      const double across = side == 0 ? 1.0 : -1.0,
                   own = phase + (side == 0 ? 0.0 : std::numbers::pi);
      const Pose3 thigh =
          Bent(0.42 * pace * std::sin(own), {0.0, 0.45 * across * build_.girth, 0.0});
      const double knee = 0.08 + 0.7 * pace * std::max(0.0, std::cos(own));
      T_world_part[kThighs + side] = T_world_hips * thigh;
      T_world_part[kShins + side] = T_world_hips * thigh * Bent(-knee, {0.0, 0.0, -build_.thigh});
    }
  }

  void PlaceArms(const Pose3& T_world_trunk, const Pose3& T_world_body,
                 std::span<Pose3> T_world_part) const {
    const Eigen::Vector3d handle =
        T_world_body * (R_carrier_body_.conjugate() * Eigen::Vector3d(0.0, 0.0, -carrying_.handle));
    for (const std::size_t side : {0, 1}) {
      const double across = side == 0 ? 1.0 : -1.0;
      const Eigen::Vector3d shoulder =
          T_world_trunk * Eigen::Vector3d(0.0, 1.45 * across * build_.girth, 0.9 * build_.trunk);
      const Eigen::Vector3d elbow = Elbow(shoulder, handle, build_.upper_arm, build_.forearm);
      T_world_part[kUpperArms + side] = Hanging(shoulder, elbow);
      T_world_part[kForearms + side] = Hanging(elbow, handle);
    }
  }

  PoseSpline motion_;
  Eigen::Quaterniond R_carrier_body_;
  Carrying carrying_;
  Build build_;
  Track track_;
};

}  // namespace

MovingObject MakeOperator(const World& world, const PoseSpline& motion,
                          const Eigen::Quaterniond& R_carrier_body, const Carrying& carrying,
                          RandomStream random) {
  const Build build = BuildOf(random.Uniform(1.7, 1.85), random.Uniform(0.14, 0.16));
  MovingObject person{.name = "operator", .parts = BodyMeshes(build, ClothesOf(random))};
  const auto bearer =
      std::make_shared<const Bearer>(world, motion, R_carrier_body, carrying, build);
  person.poses = [bearer](double seconds, std::span<Pose3> T_world_part) {
    bearer->Poses(seconds, T_world_part);
  };
  return person;
}

}  // namespace mlvi
