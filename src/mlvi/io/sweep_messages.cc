// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/sweep_messages.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace mlvi {
namespace {

constexpr auto kFloat32 = PointDatatype::kFloat32, kFloat64 = PointDatatype::kFloat64,
               kUint8 = PointDatatype::kUint8, kUint16 = PointDatatype::kUint16,
               kUint32 = PointDatatype::kUint32;

PointCloud2Data EmptyCloud(Time stamp, const char* frame, std::uint32_t height, std::uint32_t width,
                           std::uint32_t point_step, std::vector<PointField> fields) {
  PointCloud2Data cloud;
  cloud.stamp = stamp;
  cloud.frame_id = frame;
  cloud.height = height;
  cloud.width = width;
  cloud.fields = std::move(fields);
  cloud.point_step = point_step;
  cloud.data.resize(std::size_t{height} * width * point_step);
  return cloud;
}

template <typename T>
void Put(std::uint8_t* point, std::size_t offset, T value) {
  std::memcpy(point + offset, &value, sizeof(T));
}

void PutPosition(std::uint8_t* bytes, const LidarPoint& point) {
  Put(bytes, 0, point.position.x());
  Put(bytes, 4, point.position.y());
  Put(bytes, 8, point.position.z());
}

template <typename Integer>
Integer Saturate(double value) {
  if (!(value > 0.0)) return 0;  // NaN, too
  return static_cast<Integer>(
      std::min(value, static_cast<double>(std::numeric_limits<Integer>::max())));
}

// The nearest double: whole seconds and the rest apart.
double AbsoluteSeconds(Time time) {
  const std::int64_t ns = time.nanoseconds();
  return static_cast<double>(ns / 1'000'000'000) + static_cast<double>(ns % 1'000'000'000) * 1e-9;
}

bool IsReturn(const LidarPoint& point) { return !(point.position.array() == 0.0F).all(); }

std::uint32_t CountReturns(const LidarSweep& sweep) {
  return static_cast<std::uint32_t>(
      std::count_if(sweep.points.begin(), sweep.points.end(), IsReturn));
}

}  // namespace

PointCloud2Data OusterCloud(const LidarSweep& sweep, Duration period) {
  constexpr std::uint32_t kRows = 128, kColumns = 1024;
  auto cloud = EmptyCloud(sweep.stamp, "os_sensor", kRows, kColumns, 48,
                          {{"x", 0, kFloat32},
                           {"y", 4, kFloat32},
                           {"z", 8, kFloat32},
                           {"intensity", 16, kFloat32},
                           {"t", 20, kUint32},
                           {"reflectivity", 24, kUint16},
                           {"ring", 26, kUint8},
                           {"noise", 28, kUint16},
                           {"range", 32, kUint32}});
  const double columns_per_ns = kColumns / static_cast<double>(period.nanoseconds());
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      std::uint8_t* bytes =
          cloud.data.data() + (std::size_t{row} * kColumns + column) * cloud.point_step;
      Put(bytes, 20, static_cast<std::uint32_t>(std::llround(column / columns_per_ns)));
      Put(bytes, 26, static_cast<std::uint8_t>(row));
    }
  }
  for (const LidarPoint& point : sweep.points) {
    const auto column = static_cast<std::uint32_t>(std::llround(point.offset_ns * columns_per_ns));
    if (point.ring >= kRows || column >= kColumns) continue;
    std::uint8_t* bytes =
        cloud.data.data() + (std::size_t{point.ring} * kColumns + column) * cloud.point_step;
    PutPosition(bytes, point);
    Put(bytes, 16, point.intensity);
    Put(bytes, 20, static_cast<std::uint32_t>(point.offset_ns));
    Put(bytes, 24, Saturate<std::uint16_t>(point.intensity));
    Put(bytes, 32, Saturate<std::uint32_t>(1000.0 * static_cast<double>(point.position.norm())));
  }
  return cloud;
}

PointCloud2Data VelodyneCloud(const LidarSweep& sweep, bool stamp_is_end) {
  const Duration shift = stamp_is_end ? sweep.span : Duration();
  auto cloud = EmptyCloud(sweep.stamp + shift, "velodyne", 1, CountReturns(sweep), 22,
                          {{"x", 0, kFloat32},
                           {"y", 4, kFloat32},
                           {"z", 8, kFloat32},
                           {"intensity", 12, kFloat32},
                           {"ring", 16, kUint16},
                           {"time", 18, kFloat32}});
  std::uint8_t* bytes = cloud.data.data();
  for (const LidarPoint& point : sweep.points) {
    if (!IsReturn(point)) continue;
    PutPosition(bytes, point);
    Put(bytes, 12, point.intensity);
    Put(bytes, 16, point.ring);
    Put(bytes, 18,
        static_cast<float>((Duration::FromNanoseconds(point.offset_ns) - shift).seconds()));
    bytes += cloud.point_step;
  }
  return cloud;
}

PointCloud2Data HesaiCloud(const LidarSweep& sweep) {
  auto cloud = EmptyCloud(sweep.stamp, "PandarXT-32", 1, CountReturns(sweep), 48,
                          {{"x", 0, kFloat32},
                           {"y", 4, kFloat32},
                           {"z", 8, kFloat32},
                           {"intensity", 16, kFloat32},
                           {"timestamp", 24, kFloat64},
                           {"ring", 32, kUint16}});
  std::uint8_t* bytes = cloud.data.data();
  for (const LidarPoint& point : sweep.points) {
    if (!IsReturn(point)) continue;
    PutPosition(bytes, point);
    Put(bytes, 16, point.intensity);
    Put(bytes, 24, AbsoluteSeconds(sweep.stamp + Duration::FromNanoseconds(point.offset_ns)));
    Put(bytes, 32, point.ring);
    bytes += cloud.point_step;
  }
  return cloud;
}

}  // namespace mlvi
