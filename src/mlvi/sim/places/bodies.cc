// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/bodies.h"

#include <array>

#include "mlvi/sim/places/shapes.h"

namespace mlvi {
namespace {

Material Cloth(const std::string& name, const Eigen::Vector3f& colour, std::uint64_t seed) {
  return {.name = name,
          .reflectivity = 0.5,
          .texture = {.pattern = TexturePattern::kFabric,
                      .seed = seed,
                      .light = colour,
                      .dark = 0.35F * colour},
          .tile = 0.8};
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

}  // namespace

Build BuildOf(double height, double girth) {
  return {.thigh = 0.245 * height,
          .shin = 0.246 * height,
          .trunk = 0.30 * height,
          .upper_arm = 0.186 * height,
          .forearm = 0.22 * height,
          .head = 0.125 * height,
          .girth = girth};
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

std::vector<TriangleMesh> BodyMeshes(const Build& build, const Clothes& clothes) {
  std::vector<TriangleMesh> parts(kBodyParts);
  parts[kTrunk] = Trunk(build, clothes.top);
  parts[kHead] = Head(build, clothes);
  for (const std::size_t side : {0, 1}) {
    parts[kUpperArms + side] = Limb(build.upper_arm, 0.05, clothes.top);
    parts[kForearms + side] = Limb(build.forearm, 0.042, clothes.skin);
    parts[kThighs + side] = Limb(build.thigh, 0.085, clothes.trousers);
    parts[kShins + side] = Limb(build.shin, 0.06, clothes.trousers, &clothes.shoes);
  }
  return parts;
}

Pose3 Bent(double forward_angle, const Eigen::Vector3d& at) {
  return Pose3(ExpSo3({0.0, -forward_angle, 0.0}), at);
}

}  // namespace mlvi
