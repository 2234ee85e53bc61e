// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What comes back from one pulse of a LiDAR: diffuse surfaces, retro-reflectors, panes and mirrors,
// and what of it a receiver makes one range of.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/sim/lidar_pattern.h"
#include "mlvi/sim/world.h"

namespace mlvi {

// What light has met on its way to what it came back from.
enum class EchoPath : std::uint8_t {
  kDirect = 0,
  kTransmitted = 1,  // panes
  kMirrored = 2,     // a mirror or a pane at least once: appears where nothing is
};

struct LidarEcho {
  double range = 0.0;         // m, the way of the light, one way
  double reflectivity = 0.0;  // of a surface under normal incidence that returns as much
  double cosine = 1.0;        // of the angle of incidence
  EchoPath path = EchoPath::kDirect;
  double weight = 1.0;  // share of the pulse
  double relief = 0.0;  // m, by which `range` ends before the mesh (Material::relief)
  double spread = 0.0;  // rad, one sigma: the relief is its mean over a beam of that width
  double power() const { return weight * reflectivity / (range * range); }
};

// Echoes that a receiver takes for one, and the truth about them.
struct LidarReturn {
  double range = 0.0;                    // m, their mean by power; 0: nothing came back
  double nearest = 0.0, farthest = 0.0;  // m, of the echoes joined
  double reflectivity = 0.0;             // of all together
  double cosine = 1.0;                   // of the strongest
  EchoPath path = EchoPath::kDirect;     // of the strongest
  double relief = 0.0, spread = 0.0;     // m, rad, of the strongest
  int echoes = 0;

  // Of several places: lies between its surfaces, on none of them.
  bool mixed() const { return echoes > 1; }
};

// The echo of a surface that the ray along `direction` meets `range` m on its way, with `energy` of
// the pulse left. Diffuse: reflectivity times cosine. Retro-reflective: 300 times that (sheeting of
// ASTM D4956 type I: 70 cd/(lx m^2), a white Lambertian surface 0.8 / pi). Smooth: beside it the
// glint of a pane that faces the sensor, of slope deviation s = 0.5 deg (waviness, and the beam's
// width): mirror exp(-tan(a)^2 / (2 s^2)) / (8 s^2 cos(a)^4), the backscatter of Beckmann &
// Spizzichino 1963. Light passes each pane twice, there and back: energy counts squared.
LidarEcho EchoOf(const Material& material, double cosine, double range, double energy);

// Appends the echoes of everything along a ray of share `weight` of the pulse: through panes
// (Material::transmission) and, mirrored by them and by mirrors (Material::lidar_mirror),
// elsewhere, where what returns looks as if it stood behind them. At most three surfaces deep, up
// to physics.max_range. Ranges end on the relief of static surfaces, unless physics.plane_surfaces.
void TracePulse(const WorldSnapshot& world, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction, const LidarPhysics& physics, double weight,
                std::vector<LidarEcho>& echoes);

// The strongest return: echoes within `pulse_length` (m) of the first of them come back as one
// pulse, at their mean by power. These are the mixed pixels at the edges of things. None without
// echoes. Sorts them.
std::optional<LidarReturn> StrongestReturn(std::vector<LidarEcho>& echoes, double pulse_length);

// A beam as rays: a Gaussian of deviation s is its middle, of weight 1/2, and four rays 2 s away,
// of 1/8 each, which has its moments up to the third.
constexpr std::size_t kBeamRays = 5;
constexpr double BeamWeight(std::size_t ray) { return ray == 0 ? 0.5 : 0.125; }
// rad; `divergence` as in LidarPhysics.
constexpr double BeamDeviation(double divergence) {
  return divergence / 2.35482;  // 2 sqrt(2 ln 2)
}
// Unit vectors.
std::array<Eigen::Vector3d, kBeamRays> BeamDirections(const Eigen::Vector3d& direction,
                                                      double divergence);

// A pulse that is sent out.
struct Pulse {
  Eigen::Vector3d origin, direction;  // world; the direction is a unit vector
  const WorldSnapshot* world;         // at its instant
  // What the beam itself may meet of it: the same, or World::StaticSnapshot() where nothing that
  // moves is on its way (but may be on the way of what panes mirror).
  const WorldSnapshot* ahead;
};

// What the receiver makes a range of, up to physics.max_range, before errors of range: of up to so
// many pulses in one world, which are traced at once (quickest where they run much the same way).
// Where the whole beam meets one diffuse plane, that is the echo of its middle, on the mean of the
// relief over the beam.
constexpr std::size_t kPulsesTogether = 3;
using PulseReturns = std::array<std::optional<LidarReturn>, kPulsesTogether>;
PulseReturns ReceivePulses(std::span<const Pulse> pulses, const LidarPhysics& physics);

}  // namespace mlvi
