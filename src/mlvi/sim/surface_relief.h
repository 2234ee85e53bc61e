// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// How far real surfaces are from the planes that meshes have in their places: render, joints, waves
// of plaster, pebbles, grass.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace mlvi {

// Of a material: bumps of two sizes, by the rms of their heights over the mesh. 0: exactly plane.
struct Relief {
  double fine = 0.0;         // m, rms
  double fine_size = 0.1;    // m, from one bump to the next
  double coarse = 0.0;       // m, rms
  double coarse_size = 0.8;  // m

  bool plane() const { return fine == 0.0 && coarse == 0.0; }
  // Heights stay below in magnitude.
  double bound() const;
};

// Heights as a function of the place in space: a bump stands where it stands, seen from anywhere and
// at any time, and does not average out. Value noise of normal lattice values joined by smoothsteps,
// on axes aslant to those of buildings: along the axes of the world it repeats nowhere within 1200
// bumps.
class SurfaceRelief {
 public:
  SurfaceRelief();

  // m, outwards, with the rms that `relief` says.
  double HeightAt(const Relief& relief, const Eigen::Vector3d& point) const;
  // By how much, in m, the ray along the unit vector `direction` ends before `point`, where it
  // meets the mesh under the angle of incidence with that `cosine`: at x = point - result *
  // direction it is HeightAt(x) away from the plane of the mesh there, and farther all the way
  // before. Below a cosine of 0.2 as if it were that: nothing is known of what shadows what.
  double ShortensBy(const Relief& relief, const Eigen::Vector3d& point,
                    const Eigen::Vector3d& direction, double cosine) const;

 private:
  struct Ray;
  double FineOn(const Relief& relief, const Ray& ray, double s) const;
  double CoarseOn(const Relief& relief, const Ray& ray, double s) const;
  double Noise(const Eigen::Vector3d& at) const;  // of variance 1

  // By place x, y, z: the values of four neighbours, at (y, z), (y + 1, z), (y, z + 1), (y + 1, z +
  // 1).
  std::vector<std::array<float, 4>> lattice_;
};

}  // namespace mlvi
