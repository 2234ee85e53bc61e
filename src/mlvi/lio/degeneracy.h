// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "mlvi/lio/lio_config.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// The directions that a registration cannot tell, as motions of the whole pose.
struct DegenerateDirections {
  Degeneracy report;  // without the information, which depends on what is made of these directions
  // Six-vectors [world translation; body rotation], translations first.
  std::vector<Vector6d> motions;
  // The axis when it is the only degenerate translation, for the next sweep.
  std::optional<Eigen::Vector3d> lone_axis;
};

// `information` (chart: world position, body rotation) is H^T W H over all constraints; `feigned`
// is the part of it that comes from the noise of the normals: E[n n^T] = n0 n0^T + Cov(n), so a
// corridor whose walls are fitted with normals 2 degrees off seems to be known lengthwise to
// centimetres.
//
// Translation and rotation are judged apart, in their own units, each with the other one
// marginalised (Schur complement): a direction is degenerate when its standard deviation by the
// information that is not feigned exceeds the limit, or when more than max_noise_share of its
// information is feigned.
//
// `last_axis` is the lone axis of the previous sweep, with which a lone axis of this one is
// averaged. Were it taken anew each time, its small random turns would leak lateral information
// into the axis: 1 mm across, seen under directions that differ by 1e-3, feigns 1 m lengthwise per
// sweep, 6 cm after 300 sweeps.
DegenerateDirections FindDegeneracy(const Matrix6d& information, const Matrix6d& feigned,
                                    const Eigen::Quaterniond& R_world_body,
                                    const std::optional<Eigen::Vector3d>& last_axis,
                                    const DegeneracyConfig& config);

// Takes the translation at place `translation` of the report out of the degenerate ones; its axis
// moves behind those that remain.
void Strike(int translation, DegenerateDirections& directions);

// Takes the information along the degenerate motions out of the normal equations A x = -b:
//   A <- A - A v v^T A / (v^T A v),  b <- b - A v (v^T b) / (v^T A v).
// What is known about the directions conjugate to v stays as it was, and along v only a prior
// decides.
void Deflate(const std::vector<Vector6d>& motions, Matrix6d& A, Vector6d& b);

}  // namespace mlvi
