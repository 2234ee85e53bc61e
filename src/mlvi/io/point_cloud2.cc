// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/point_cloud2.h"

#include <cmath>
#include <cstring>
#include <initializer_list>

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

// Names that drivers use, in order of preference.
// Ouster: t. Velodyne: time. Hesai, Robosense: timestamp. Livox as PointCloud2: offset_time or
// timestamp.
constexpr std::initializer_list<const char*> kTimeNames = {"t", "time", "timestamp", "offset_time",
                                                           "time_stamp"};
constexpr std::initializer_list<const char*> kRingNames = {"ring", "line", "channel", "laser_id"};
constexpr std::initializer_list<const char*> kIntensityNames = {"intensity", "reflectivity",
                                                                "signal"};

template <typename T>
double Load(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

// One field of the points of a message.
class FieldReader {
 public:
  FieldReader() = default;
  explicit FieldReader(const PointField& field)
      : offset_(field.offset), datatype_(field.datatype) {}

  bool present() const { return datatype_ != PointDatatype{0}; }
  double operator()(const std::uint8_t* point) const {
    const std::uint8_t* bytes = point + offset_;
    switch (datatype_) {
      case PointDatatype::kFloat32: return Load<float>(bytes);
      case PointDatatype::kFloat64: return Load<double>(bytes);
      case PointDatatype::kUint8: return Load<std::uint8_t>(bytes);
      case PointDatatype::kUint16: return Load<std::uint16_t>(bytes);
      case PointDatatype::kUint32: return Load<std::uint32_t>(bytes);
      case PointDatatype::kInt8: return Load<std::int8_t>(bytes);
      case PointDatatype::kInt16: return Load<std::int16_t>(bytes);
      case PointDatatype::kInt32: return Load<std::int32_t>(bytes);
    }
    return 0.0;  // absent
  }

 private:
  std::size_t offset_ = 0;
  PointDatatype datatype_ = PointDatatype{0};
};

struct Layout {
  FieldReader x, y, z, intensity, time, ring;
  std::string time_field;
};

const PointField* FindAny(const PointCloud2View& cloud, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (const PointField* field = cloud.Find(name)) return field;
  }
  return nullptr;
}

bool IsFloat(const PointField& field) {
  return field.datatype == PointDatatype::kFloat32 || field.datatype == PointDatatype::kFloat64;
}

Expected<void> CheckField(const PointCloud2View& cloud, const PointField& field) {
  const std::size_t size = SizeOf(field.datatype);
  if (size != 0 && field.count >= 1 && field.offset + size <= cloud.point_step) return {};
  return MakeError(kKind,
                   "PointCloud2 field '{}' ({} at offset {}) does not fit into points of {} bytes; "
                   "fields are: {}",
                   field.name, NameOf(field.datatype), field.offset, cloud.point_step,
                   cloud.FieldList());
}

Expected<Layout> BindLayout(const PointCloud2View& cloud, bool read_times) {
  Layout layout;
  const auto bind = [&](const PointField* field, FieldReader& reader) -> Expected<void> {
    if (field == nullptr) return {};
    auto fits = CheckField(cloud, *field);
    if (fits) reader = FieldReader(*field);
    return fits;
  };
  const PointField *x = cloud.Find("x"), *y = cloud.Find("y"), *z = cloud.Find("z");
  if (!x || !y || !z || !IsFloat(*x) || !IsFloat(*y) || !IsFloat(*z)) {
    return MakeError(
        kKind,
        "PointCloud2 without float fields x, y, z; its fields are: {}. Is this the topic of the "
        "LiDAR's points (rig field lidar.topic)?",
        cloud.fields.empty() ? "none" : cloud.FieldList());
  }
  const PointField* time = read_times ? FindAny(cloud, kTimeNames) : nullptr;
  const PointField* fields[] = {
      x, y, z, time, FindAny(cloud, kRingNames), FindAny(cloud, kIntensityNames)};
  FieldReader* readers[] = {&layout.x,    &layout.y,    &layout.z,
                            &layout.time, &layout.ring, &layout.intensity};
  for (std::size_t i = 0; i < std::size(fields); ++i) {
    if (auto bound = bind(fields[i], *readers[i]); !bound) return tl::unexpected(bound.error());
  }
  if (time != nullptr) layout.time_field = time->name;
  return layout;
}

// Which dimension of an organised cloud counts the lasers: the one of that size, else the smaller
// one (drivers differ).
enum class Organisation { kNone, kRowsAreRings, kColumnsAreRings };
Organisation OrganisationOf(const PointCloud2View& cloud, int rings) {
  if (cloud.height <= 1 || cloud.width <= 1) return Organisation::kNone;
  if (rings > 0 && cloud.height == static_cast<std::uint32_t>(rings))
    return Organisation::kRowsAreRings;
  if (rings > 0 && cloud.width == static_cast<std::uint32_t>(rings))
    return Organisation::kColumnsAreRings;
  if (rings > 0) return Organisation::kNone;
  return cloud.height <= cloud.width ? Organisation::kRowsAreRings : Organisation::kColumnsAreRings;
}

}  // namespace

PointSink::PointSink(const PointFilter& filter, RawSweep& sweep)
    : sweep_(sweep),
      with_times_(!sweep.time_field.empty()),
      min_squared_(static_cast<float>(filter.min_range * filter.min_range)),
      max_squared_(static_cast<float>(filter.max_range * filter.max_range)) {}

bool PointSink::Add(const LidarPoint& point, double time) {
  const float squared = point.position.squaredNorm();
  // Written so that NaN fails every test.
  if (!(squared <= std::numeric_limits<float>::max())) return ++not_finite_, false;
  if (squared == 0.0F) return ++no_return_, false;
  if (squared < min_squared_) return ++too_near_, false;
  if (squared > max_squared_) return ++too_far_, false;
  if (with_times_ && !std::isfinite(time)) return ++bad_time_, false;
  sweep_.points.push_back(point);
  if (with_times_) sweep_.times.push_back(time);
  return true;
}

void PointSink::FlushCounts() {
  const auto count = [&](const char* reason, std::int64_t points) {
    if (points > 0) sweep_.dropped[reason] += points;
  };
  count("points: NaN or infinite", not_finite_);
  count("points: no return (0, 0, 0)", no_return_);
  count("points: nearer than lidar.min_range", too_near_);
  count("points: beyond lidar.max_range", too_far_);
  count("points: time is not finite", bad_time_);
}

Expected<RawSweep> ExtractPoints(const PointCloud2View& cloud, const PointFilter& filter) {
  if (cloud.big_endian) {
    return MakeError(
        kKind,
        "PointCloud2 with is_bigendian = true: big-endian clouds are not supported; fields are: {}",
        cloud.FieldList());
  }
  const auto layout = BindLayout(cloud, filter.read_times);
  if (!layout) return tl::unexpected(layout.error());
  const Organisation organisation = OrganisationOf(cloud, filter.rings);
  RawSweep sweep;
  sweep.header_stamp = cloud.header.stamp;
  sweep.time_field = layout->time_field;
  sweep.has_intensity = layout->intensity.present();
  sweep.has_rings = layout->ring.present() || organisation != Organisation::kNone;
  sweep.column_count = organisation == Organisation::kColumnsAreRings ? cloud.height : cloud.width;
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  sweep.points.reserve(count);
  if (layout->time.present()) sweep.times.reserve(count);
  const std::size_t row_step = cloud.height > 1 ? cloud.row_step : 0;
  PointSink sink(filter, sweep);
  for (std::uint32_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* bytes = cloud.data.data() + row * row_step;
    for (std::uint32_t column = 0; column < cloud.width; ++column, bytes += cloud.point_step) {
      const bool rows_are_rings = organisation != Organisation::kColumnsAreRings;
      LidarPoint point;
      point.position =
          Eigen::Vector3d(layout->x(bytes), layout->y(bytes), layout->z(bytes)).cast<float>();
      point.intensity = static_cast<float>(layout->intensity(bytes));
      const double ring =
          layout->ring.present() ? layout->ring(bytes) : (rows_are_rings ? row : column);
      point.ring = static_cast<std::uint16_t>(std::clamp(ring, 0.0, 65535.0));
      if (sink.Add(point, layout->time(bytes)) && organisation != Organisation::kNone) {
        sweep.columns.push_back(rows_are_rings ? column : row);
      }
    }
  }
  sink.FlushCounts();
  return sweep;
}

}  // namespace mlvi
