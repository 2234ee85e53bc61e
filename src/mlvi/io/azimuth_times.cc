// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/azimuth_times.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

constexpr double kPi = std::numbers::pi;
// Blocks of consecutive points: long enough to average over the beams of a column, short against a
// turn.
constexpr std::size_t kBlocks = 72;
constexpr std::size_t kFewestPoints = 20 * kBlocks;

double Wrap(double angle) { return std::remainder(angle, 2.0 * kPi); }
double AzimuthOf(const LidarPoint& point) {
  return std::atan2(point.position.y(), point.position.x());
}

// Unwrapped mean azimuth of each block, along the order of the points.
std::vector<double> BlockAzimuths(const std::vector<LidarPoint>& points) {
  std::vector<double> azimuths;
  for (std::size_t block = 0; block < kBlocks; ++block) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (std::size_t i = block * points.size() / kBlocks; i < (block + 1) * points.size() / kBlocks;
         ++i) {
      sum += points[i].position.head<2>().cast<double>().normalized();
    }
    const double azimuth = std::atan2(sum.y(), sum.x());
    azimuths.push_back(azimuths.empty() ? azimuth
                                        : azimuths.back() + Wrap(azimuth - azimuths.back()));
  }
  return azimuths;
}

// Whether the blocks go round about once and (nearly) always in the same direction.
bool GoesRoundOnce(const std::vector<double>& azimuths) {
  const double turn = azimuths.back() - azimuths.front();
  std::size_t against = 0;
  for (std::size_t i = 1; i < azimuths.size(); ++i) {
    against += (azimuths[i] - azimuths[i - 1]) * turn <= 0.0 ? 1 : 0;
  }
  return std::abs(turn) > kPi && std::abs(turn) < 2.2 * kPi && against <= kBlocks / 10;
}

}  // namespace

std::optional<AzimuthTimes> TimesFromAzimuth(const std::vector<LidarPoint>& points,
                                             Duration period) {
  if (points.size() < kFewestPoints) return std::nullopt;
  const std::vector<double> blocks = BlockAzimuths(points);
  if (!GoesRoundOnce(blocks)) return std::nullopt;
  AzimuthTimes times;
  times.clockwise = blocks.back() < blocks.front();
  const double direction = times.clockwise ? -1.0 : 1.0;
  std::vector<double> angles(points.size());
  for (std::size_t block = 0; block < kBlocks; ++block) {
    for (std::size_t i = block * points.size() / kBlocks; i < (block + 1) * points.size() / kBlocks;
         ++i) {
      angles[i] = direction * (blocks[block] + Wrap(AzimuthOf(points[i]) - blocks[block]));
    }
  }
  const double first = *std::min_element(angles.begin(), angles.end());
  const double ns_per_radian = static_cast<double>(period.nanoseconds()) / (2.0 * kPi);
  times.offsets.resize(points.size());
  std::transform(angles.begin(), angles.end(), times.offsets.begin(), [&](double angle) {
    const double ns =
        std::min((angle - first) * ns_per_radian, static_cast<double>(period.nanoseconds()));
    return static_cast<std::int32_t>(ns);
  });
  return times;
}

std::vector<std::int32_t> TimesFromColumns(const std::vector<std::uint32_t>& columns,
                                           std::uint32_t column_count, Duration period) {
  const std::uint32_t first = *std::min_element(columns.begin(), columns.end());
  std::vector<std::int32_t> offsets(columns.size());
  std::transform(columns.begin(), columns.end(), offsets.begin(), [&](std::uint32_t column) {
    return static_cast<std::int32_t>(period.nanoseconds() * (column - first) / column_count);
  });
  return offsets;
}

}  // namespace mlvi
