// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "mlvi/sim/places/vehicles.h"

namespace mlvi {
namespace {

// Measures of a body, m.
struct Build {
  double thigh, shin, trunk, upper_arm, forearm, head, girth;

  double hips() const { return thigh + shin + 0.07; }
};

Build BuildOf(double height, double girth) {
  return {.thigh = 0.245 * height,
          .shin = 0.246 * height,
          .trunk = 0.30 * height,
          .upper_arm = 0.186 * height,
          .forearm = 0.22 * height,
          .head = 0.125 * height,
          .girth = girth};
}

struct Clothes {
  Material skin, hair, top, trousers, shoes;
};

Material Cloth(const std::string& name, const Eigen::Vector3f& colour, std::uint64_t seed) {
  return {.name = name,
          .reflectivity = 0.5,
          .texture = {.pattern = TexturePattern::kFabric,
                      .seed = seed,
                      .light = colour,
                      .dark = 0.35F * colour},
          .tile = 0.8};
}

Clothes ClothesOf(RandomStream& random) {
  const std::array<Eigen::Vector3f, 6> colours = {
      Eigen::Vector3f(0.5F, 0.08F, 0.07F), Eigen::Vector3f(0.08F, 0.16F, 0.4F),
      Eigen::Vector3f(0.6F, 0.58F, 0.52F), Eigen::Vector3f(0.05F, 0.05F, 0.06F),
      Eigen::Vector3f(0.12F, 0.3F, 0.14F), Eigen::Vector3f(0.55F, 0.4F, 0.1F)};
  const auto colour = [&] { return colours[static_cast<std::size_t>(random.Uniform(0.0, 6.0))]; };
  const auto plain = [](const std::string& name, double reflectivity,
                        const Eigen::Vector3f& light) {
    return Material{.name = name, .reflectivity = reflectivity, .texture = {.light = light}};
  };
  const std::uint64_t seed = random.NextBits();
  return {.skin = plain("skin", 0.55, {0.5F, 0.33F, 0.25F}),
          .hair = plain("hair", 0.2, {0.06F, 0.04F, 0.03F}),
          .top = Cloth("top", colour(), seed),
          .trousers = Cloth("trousers", 0.5F * colour(), seed + 1),
          .shoes = plain("shoes", 0.2, {0.05F, 0.05F, 0.05F})};
}

// A limb that hangs from the origin of its part.
TriangleMesh Limb(double length, double radius, const Material& material,
                  const Material* foot = nullptr) {
  MeshBuilder builder;
  const MaterialId id = builder.AddMaterial(material);
  AddPipe(builder, Eigen::Vector3d::Zero(), {0.0, 0.0, -length}, radius, 0.75 * radius, 9, id);
  if (foot != nullptr) {
    builder.AddBox({0.06, 0.0, -length - 0.07}, {0.26, 0.09, 0.08}, 0.0,
                   builder.AddMaterial(*foot));
  }
  return std::move(builder).Finish();
}

TriangleMesh Trunk(const Build& build, const Material& material) {
  MeshBuilder builder;
  const MaterialId id = builder.AddMaterial(material);
  const double g = build.girth;
  AddPipe(builder, {0.0, 0.0, -0.1}, {0.0, 0.0, 0.55 * build.trunk}, 0.95 * g, g, 12, id);
  AddPipe(builder, {0.0, 0.0, 0.55 * build.trunk}, {0.0, 0.0, build.trunk}, g, 0.75 * g, 12, id);
  for (const double side : {-1.0, 1.0}) {  // shoulders
    AddPipe(builder, {0.0, 0.0, 0.93 * build.trunk}, {0.0, side * 1.35 * g, 0.9 * build.trunk},
            0.45 * g, 0.38 * g, 9, id);
  }
  return std::move(builder).Finish();
}

TriangleMesh Head(const Build& build, const Clothes& clothes) {
  MeshBuilder builder;
  const MaterialId skin = builder.AddMaterial(clothes.skin),
                   hair = builder.AddMaterial(clothes.hair);
  const double h = build.head, z = build.trunk;
  AddPipe(builder, {0.0, 0.0, z - 0.02}, {0.0, 0.0, z + 0.35 * h}, 0.06, 0.06, 9, skin);
  AddPipe(builder, {0.015, 0.0, z + 0.3 * h}, {0.015, 0.0, z + 0.75 * h}, 0.075, 0.095, 10, skin);
  AddPipe(builder, {0.0, 0.0, z + 0.75 * h}, {0.0, 0.0, z + 1.25 * h}, 0.105, 0.06, 10, hair);
  return std::move(builder).Finish();
}

enum Part : std::size_t {
  kTrunk,
  kHead,
  kUpperArms,  // left, right
  kForearms = kUpperArms + 2,
  kThighs = kForearms + 2,
  kShins = kThighs + 2,
  kParts = kShins + 2
};

Pose3 Bent(double forward_angle, const Eigen::Vector3d& at) {
  return Pose3(ExpSo3({0.0, -forward_angle, 0.0}), at);  // positive: the lower end goes ahead
}

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
  person.parts.resize(kParts);
  person.parts[kTrunk] = Trunk(build, clothes.top);
  person.parts[kHead] = Head(build, clothes);
  for (const std::size_t side : {0, 1}) {
    person.parts[kUpperArms + side] = Limb(build.upper_arm, 0.05, clothes.top);
    person.parts[kForearms + side] = Limb(build.forearm, 0.042, clothes.skin);
    person.parts[kThighs + side] = Limb(build.thigh, 0.085, clothes.trousers);
    person.parts[kShins + side] = Limb(build.shin, 0.06, clothes.trousers, &clothes.shoes);
  }
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
