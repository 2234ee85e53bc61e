// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/sweep_normalizer.h"

#include <algorithm>

#include "mlvi/io/azimuth_times.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;
// Times of a sensor are in order within a ring; a field that is none scores about 0.5
// (DisorderOfTimes).
constexpr double kLargestDisorder = 0.2;

void SetOffsets(const std::vector<std::int32_t>& offsets, LidarSweep& sweep) {
  std::int32_t last = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    sweep.points[i].offset_ns = offsets[i];
    last = std::max(last, offsets[i]);
  }
  sweep.span = Duration::FromNanoseconds(last);
  sweep.has_times = true;
}

std::vector<std::uint16_t> RingsOf(const std::vector<LidarPoint>& points) {
  std::vector<std::uint16_t> rings;
  rings.reserve(points.size());
  for (const LidarPoint& point : points) rings.push_back(point.ring);
  return rings;
}

}  // namespace

SweepNormalizer::SweepNormalizer(const LidarSpec& spec)
    : spec_(spec),
      filter_{.min_range = spec.min_range,
              .max_range = spec.max_range,
              .rings = spec.rings,
              .read_times = spec.point_timing == PointTiming::kAuto},
      period_(Duration::FromSeconds(1.0 / spec.rate_hz)),
      timer_(period_) {}

Expected<LidarSweep> SweepNormalizer::Normalize(RawSweep&& raw) {
  for (const auto& [reason, points] : raw.dropped) repaired_[reason] += points;
  if (raw.points.empty()) return MakeError(kKind, "no valid point");
  LidarSweep sweep;
  sweep.stamp = raw.header_stamp;
  sweep.points = std::move(raw.points);
  sweep.has_rings = raw.has_rings;
  sweep.has_intensity = raw.has_intensity;
  if (spec_.point_timing == PointTiming::kAuto) {
    const bool measured = !raw.times.empty() && ApplyMeasuredTimes(raw, sweep);
    if (!measured && timer_.failure() == TimesFailure::kTooLong) {
      return MakeError(kKind, "point times spread over several periods");
    }
    if (!measured) ApplyDerivedTimes(raw, sweep);
  }
  sweep.stamp = sweep.stamp + spec_.time_offset;
  return sweep;
}

bool SweepNormalizer::ApplyMeasuredTimes(const RawSweep& raw, LidarSweep& sweep) {
  const auto times = timer_.Interpret(raw.times, raw.header_stamp);
  if (!times && timer_.failure() == TimesFailure::kTooLong) {
    Note("too long",
         fmt::format(
             "lidar: point field '{}' spreads over {:.3f} s in one sweep, but the rig says {:g} "
             "sweeps per second; such sweeps are dropped. Is lidar.rate_hz right?",
             raw.time_field, timer_.failed_span().seconds(), spec_.rate_hz));
  }
  if (!times && timer_.failure() == TimesFailure::kConstant) {
    ++repaired_["sweeps: all point times equal, times derived"];
    Note("constant",
         fmt::format(
             "lidar: point field '{}' is the same for all points (a float32 cannot hold absolute "
             "times); firing times are derived instead",
             raw.time_field));
  }
  if (!times) return false;
  if (raw.has_rings && DisorderOfTimes(raw.times, RingsOf(sweep.points)) > kLargestDisorder) {
    ++repaired_["sweeps: point times in disorder, times derived"];
    Note("disorder",
         fmt::format(
             "lidar: point field '{}' jumps back and forth along the rings, so it is no firing "
             "time; firing times are derived instead",
             raw.time_field));
    return false;
  }
  NoteTimes(raw, *times);
  sweep.stamp = times->stamp;
  SetOffsets(times->offsets, sweep);
  sweep.span = times->span;
  if (times->outliers > 0) {
    repaired_["points: time far outside of the sweep"] += times->outliers;
    std::erase_if(sweep.points, [](const LidarPoint& point) { return point.offset_ns < 0; });
  }
  return true;
}

void SweepNormalizer::NoteTimes(const RawSweep& raw, const PointTimes& times) {
  constexpr const char* kOrigins[] = {
      "from the header's stamp on", "back from the header's stamp, which is the sweep's end",
      "absolute", "on another clock: the header's stamp is taken as the sweep's start"};
  // Short sweeps at the ends of a recording say little about the unit.
  if (times.span.seconds() > 0.5 * period_.seconds()) {
    Note("times", fmt::format("lidar: point field '{}' holds times in {}, {}; span {:.4f} s",
                              raw.time_field, NameOf(times.unit),
                              kOrigins[static_cast<int>(times.origin)], times.span.seconds()));
  }
  if (times.longer_than_period) {
    ++repaired_["sweeps: longer than the period"];
    Note("longer", fmt::format("lidar: a sweep lasts {:.3f} s, but the rig says {:g} sweeps per "
                               "second; set lidar.rate_hz to "
                               "about {:.2g}",
                               times.span.seconds(), spec_.rate_hz, 1.0 / times.span.seconds()));
  }
}

void SweepNormalizer::ApplyDerivedTimes(const RawSweep& raw, LidarSweep& sweep) {
  if (!raw.columns.empty()) {
    SetOffsets(TimesFromColumns(raw.columns, raw.column_count, period_), sweep);
    Note("columns",
         "lidar: points have no times; the column of the organised cloud gives the firing time, "
         "the header's "
         "stamp is taken as the sweep's start");
    ++repaired_["sweeps: times derived from columns"];
  } else if (const auto times = TimesFromAzimuth(sweep.points, period_)) {
    SetOffsets(times->offsets, sweep);
    Note(
        "azimuth",
        fmt::format(
            "lidar: points have no times; they lie in firing order, so that their azimuth gives it "
            "(turning {}), the header's stamp is taken as the sweep's start",
            times->clockwise ? "clockwise" : "counter-clockwise"));
    ++repaired_["sweeps: times derived from azimuth"];
  } else {
    Note("none",
         "lidar: points have no times and no firing order to derive them from: sweeps are taken as "
         "instantaneous, "
         "so motion within a sweep distorts it. If they are motion-compensated already, say "
         "lidar.point_timing: "
         "instantaneous");
    ++repaired_["sweeps: no times, taken as instantaneous"];
  }
}

void SweepNormalizer::Note(const std::string& topic, std::string text) {
  if (noted_.insert(topic).second) notes_.push_back(std::move(text));
}

}  // namespace mlvi
