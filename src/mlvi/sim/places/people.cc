// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "mlvi/sim/places/bodies.h"
#include "mlvi/sim/places/vehicles.h"

namespace mlvi {
namespace {

// The walking person at `t` s: a cycle of two steps per stride of 0.85 times the height.
class Gait {
 public:
  Gait(Way way, const Build& build, double height)
      : way_(std::move(way)), build_(build), stride_(0.85 * height) {}

  void Poses(double t, std::span<Pose3> T_world_part) const {
    const double s = way_.start + way_.speed * t;
    const PathPoint at = way_.path.At(s);
    const double phase = 2.0 * std::numbers::pi * s / stride_;
    const double swing = 0.42 * std::min(1.0, way_.speed / 1.2);
    const double bob = 0.02 * std::cos(2.0 * phase) - 0.03;
    const Pose3 T_world_hips(ExpSo3({0.0, 0.0, at.heading}),
                             at.position + Eigen::Vector3d(0.0, 0.0, build_.hips() + bob));
    const auto place = [&](std::size_t part, const Pose3& T_hips_part) {
      T_world_part[part] = T_world_hips * T_hips_part;
    };
    place(kTrunk, Pose3(ExpSo3({0.0, 0.04, 0.06 * std::sin(phase)}), Eigen::Vector3d::Zero()));
    place(kHead, Pose3());
    for (const std::size_t side : {0, 1}) {
      const double across = side == 0 ? 1.0 : -1.0,
                   own = phase + (side == 0 ? 0.0 : std::numbers::pi);
      const Pose3 thigh = Bent(swing * std::sin(own), {0.0, 0.45 * across * build_.girth, 0.0});
      // The knee bends while the leg swings forward.
      const double knee = 0.08 + 0.85 * swing * 2.0 * std::max(0.0, std::cos(own));
      place(kThighs + side, thigh);
      place(kShins + side, thigh * Bent(-knee, {0.0, 0.0, -build_.thigh}));
      const Pose3 arm = Bent(-0.8 * swing * std::sin(own),
                             {0.0, 1.45 * across * build_.girth, 0.9 * build_.trunk});
      place(kUpperArms + side, arm);
      place(kForearms + side,
            arm * Bent(0.3 + 0.25 * std::max(0.0, -std::sin(own)), {0.0, 0.0, -build_.upper_arm}));
    }
  }

 private:
  Way way_;
  Build build_;
  double stride_;
};

}  // namespace

MovingObject MakePedestrian(const std::string& name, Way way, RandomStream& random) {
  const double height = random.Uniform(1.6, 1.9);
  const Build build = BuildOf(height, random.Uniform(0.13, 0.17));
  const Clothes clothes = ClothesOf(random);
  MovingObject person{.name = name};
  person.parts = BodyMeshes(build, clothes);
  const auto gait = std::make_shared<const Gait>(std::move(way), build, height);
  person.poses = [gait](double seconds, std::span<Pose3> T_world_part) {
    gait->Poses(seconds, T_world_part);
  };
  return person;
}

MovingObject MakeVehicle(const std::string& name, Way way, bool van, RandomStream& random) {
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const std::array<MaterialId, 4> paints = {m.red_car, m.silver_car, m.dark_car, m.white_metal};
  const MaterialId paint = paints[static_cast<std::size_t>(random.Uniform(0.0, 4.0))];
  if (van) AddVan(builder, {}, paint, m);
  if (!van) AddCar(builder, {}, paint, m);
  MovingObject vehicle{.name = name};
  vehicle.parts.push_back(std::move(builder).Finish());
  const auto shared = std::make_shared<const Way>(std::move(way));
  vehicle.poses = [shared](double seconds, std::span<Pose3> T_world_part) {
    const PathPoint at = shared->path.At(shared->start + shared->speed * seconds);
    T_world_part[0] = Pose3(ExpSo3({0.0, 0.0, at.heading}), at.position);
  };
  return vehicle;
}

Way ThereAndBack(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double apart, double speed,
                 double start) {
  const Eigen::Vector3d along = (to - from).normalized();
  const Eigen::Vector3d left = apart * Eigen::Vector3d(-along.y(), along.x(), 0.0);
  return {.path = WalkingPath({from, to, to + left, from + left}, 0.2 + 0.3 * apart),
          .speed = speed,
          .start = start};
}

}  // namespace mlvi
