// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Bodies of people as rigid parts.
#pragma once

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

// Measures of a body, m.
struct Build {
  double thigh, shin, trunk, upper_arm, forearm, head, girth;

  double hips() const { return thigh + shin + 0.07; }
};

// Of a person `height` m tall; `girth` is the radius of the trunk.
Build BuildOf(double height, double girth);

struct Clothes {
  Material skin, hair, top, trousers, shoes;
};

Clothes ClothesOf(RandomStream& random);

// The parts of a body: trunk and head in the frame of the hips (x ahead, z up), limbs hanging from
// the origins of their own frames. Those of pairs: left, right.
enum BodyPart : std::size_t {
  kTrunk,
  kHead,
  kUpperArms,
  kForearms = kUpperArms + 2,
  kThighs = kForearms + 2,
  kShins = kThighs + 2,
  kBodyParts = kShins + 2
};

std::vector<TriangleMesh> BodyMeshes(const Build& build, const Clothes& clothes);

// Of a limb whose joint is at `at`, its lower end `forward_angle` rad ahead.
Pose3 Bent(double forward_angle, const Eigen::Vector3d& at);

}  // namespace mlvi
