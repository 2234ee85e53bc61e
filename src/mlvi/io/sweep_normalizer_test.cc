// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/sweep_normalizer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mlvi/io/bag_fixtures.h"
#include "mlvi/io/livox.h"
#include "mlvi/io/sweep_messages.h"

namespace mlvi {
namespace {

using test::kStart;
using test::MakeSweep;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kRings = 16, kColumns = 900;

// A sweep as a cloud with x, y, z, ring and one time field written by `put_time(bytes, offset in
// s)`.
PointCloud2Data CloudWithTime(const LidarSweep& sweep, const std::string& name, PointDatatype type,
                              const std::function<void(std::uint8_t*, double)>& put_time) {
  PointCloud2Data cloud;
  cloud.stamp = sweep.stamp;
  cloud.fields = {{"z", 0, PointDatatype::kFloat32, 1},
                  {"x", 4, PointDatatype::kFloat32, 1},
                  {"y", 8, PointDatatype::kFloat32, 1},
                  {name, 12, type, 1},
                  {"ring", 21, PointDatatype::kInt32, 1}};
  cloud.point_step = 27;  // neither order nor alignment is a given
  cloud.width = static_cast<std::uint32_t>(sweep.points.size());
  cloud.data.resize(std::size_t{cloud.width} * cloud.point_step);
  std::uint8_t* bytes = cloud.data.data();
  for (const LidarPoint& point : sweep.points) {
    std::memcpy(bytes, &point.position.z(), 4);
    std::memcpy(bytes + 4, &point.position.x(), 4);
    std::memcpy(bytes + 8, &point.position.y(), 4);
    put_time(bytes + 12, point.offset_ns * 1e-9);
    const std::int32_t ring = point.ring;
    std::memcpy(bytes + 21, &ring, 4);
    bytes += cloud.point_step;
  }
  return cloud;
}

template <typename T>
std::function<void(std::uint8_t*, double)> Put(double scale, double shift = 0.0) {
  return [=](std::uint8_t* bytes, double seconds) {
    const T value = static_cast<T>((seconds + shift) * scale);
    std::memcpy(bytes, &value, sizeof(T));
  };
}

Expected<LidarSweep> Normalize(SweepNormalizer& normalizer, const PointCloud2Data& cloud) {
  const RosMessage message = PointCloud2Message(cloud);
  return ParsePointCloud2(message.bytes)
      .and_then(
          [&](const PointCloud2View& view) { return ExtractPoints(view, normalizer.filter()); })
      .and_then([&](RawSweep raw) { return normalizer.Normalize(std::move(raw)); });
}

LidarSpec Spec(int rings = kRings) { return *test::MakeRig("", rings).lidar; }

struct TimeCase {
  const char* name;
  PointDatatype type;
  std::function<void(std::uint8_t*, double)> put;
  double shift;      // of the expected first firing against the header's stamp, s
  double tolerance;  // s
  const char* note;
};

class TimeEncodings : public ::testing::TestWithParam<TimeCase> {};

TEST_P(TimeEncodings, GiveTheSameSweep) {
  const TimeCase& c = GetParam();
  const LidarSweep sent = MakeSweep(kStart, kRings, kColumns, 0.0);
  SweepNormalizer normalizer(Spec());
  const auto read = Normalize(normalizer, CloudWithTime(sent, c.name, c.type, c.put));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->points.size(), sent.points.size());
  EXPECT_TRUE(read->has_times && read->has_rings);
  EXPECT_NEAR((read->stamp - sent.stamp).seconds(), c.shift, c.tolerance);
  std::int32_t first = 1;
  for (std::size_t i = 0; i < sent.points.size(); ++i) {
    EXPECT_NEAR(read->points[i].offset_ns, sent.points[i].offset_ns, 2e9 * c.tolerance);
    EXPECT_EQ(read->points[i].ring, sent.points[i].ring);
    EXPECT_EQ(read->points[i].position, sent.points[i].position);
    first = std::min(first, read->points[i].offset_ns);
  }
  EXPECT_EQ(first, 0);
  EXPECT_THAT(normalizer.notes(), Contains(HasSubstr(c.note)));
}

INSTANTIATE_TEST_SUITE_P(
    All, TimeEncodings,
    ::testing::Values(TimeCase{"t", PointDatatype::kUint32, Put<std::uint32_t>(1e9), 0.0, 1.1e-9,
                               "'t' holds times in ns"},
                      TimeCase{"t", PointDatatype::kUint32, Put<std::uint32_t>(1e6), 0.0, 1e-6,
                               "'t' holds times in us"},
                      TimeCase{"time", PointDatatype::kFloat32, Put<float>(1.0), 0.0, 5e-9,
                               "in s, from the header's stamp on"},
                      TimeCase{"time", PointDatatype::kFloat32, Put<float>(1e3), 0.0, 5e-9,
                               "in ms"},
                      TimeCase{"time", PointDatatype::kFloat32, Put<float>(1.0, -0.1), -0.1, 9e-9,
                               "the sweep's end"},
                      TimeCase{"timestamp", PointDatatype::kFloat64,
                               Put<double>(1.0, kStart.seconds()), 0.0, 4e-7, "in s, absolute"},
                      TimeCase{"timestamp", PointDatatype::kFloat64,
                               Put<double>(1e9, kStart.seconds()), 0.0, 4e-7, "in ns, absolute"},
                      TimeCase{"timestamp", PointDatatype::kFloat64, Put<double>(1.0, 4321.0), 0.0,
                               1e-9, "another clock"},
                      TimeCase{"offset_time", PointDatatype::kUint32, Put<std::uint32_t>(1e9), 0.0,
                               1.1e-9, "in ns"}));

TEST(SweepNormalizer, AShortSweepKeepsTheUnitOfTheOthers) {
  SweepNormalizer normalizer(Spec());
  LidarSweep sent = MakeSweep(kStart, kRings, kColumns, 0.0);
  ASSERT_TRUE(Normalize(normalizer,
                        CloudWithTime(sent, "t", PointDatatype::kUint32, Put<std::uint32_t>(1e6))));
  // Two columns: 111 us, by itself nearer to 0.1 s when taken as ms.
  sent.points.resize(2 * kRings);
  const auto read = Normalize(
      normalizer, CloudWithTime(sent, "t", PointDatatype::kUint32, Put<std::uint32_t>(1e6)));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->span.nanoseconds(), 111'000);
}

TEST(SweepNormalizer, ConstantTimesAreDerivedFromAzimuth) {
  // Absolute times in a float32 come out equal.
  const LidarSweep sent = MakeSweep(kStart, kRings, kColumns, 0.0);
  SweepNormalizer normalizer(Spec());
  const auto read = Normalize(normalizer, CloudWithTime(sent, "timestamp", PointDatatype::kFloat32,
                                                        Put<float>(1.0, kStart.seconds())));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->has_times);
  for (std::size_t i = 0; i < sent.points.size(); ++i) {
    // Ranges are float: azimuth within 1e-6.
    EXPECT_NEAR(read->points[i].offset_ns, sent.points[i].offset_ns, 2e4);
  }
  EXPECT_THAT(normalizer.notes(), Contains(HasSubstr("is the same for all points")));
  EXPECT_THAT(normalizer.notes(), Contains(HasSubstr("turning clockwise")));
}

TEST(SweepNormalizer, TimesInDisorderAreNotBelieved) {
  RandomStream random(2);
  SweepNormalizer normalizer(Spec());
  const auto read = Normalize(
      normalizer, CloudWithTime(MakeSweep(kStart, kRings, kColumns, 0.0), "t",
                                PointDatatype::kUint32, [&](std::uint8_t* bytes, double) {
                                  const auto value =
                                      static_cast<std::uint32_t>(random.Uniform(0.0, 1e8));
                                  std::memcpy(bytes, &value, 4);
                                }));
  ASSERT_TRUE(read);
  EXPECT_THAT(normalizer.notes(), Contains(HasSubstr("jumps back and forth")));
  EXPECT_EQ(normalizer.repaired().at("sweeps: point times in disorder, times derived"), 1);
}

TEST(SweepNormalizer, AFewStaleTimesAreDropped) {
  int index = 0;
  SweepNormalizer normalizer(Spec());
  const auto read = Normalize(
      normalizer, CloudWithTime(MakeSweep(kStart, kRings, kColumns, 0.0), "timestamp",
                                PointDatatype::kFloat64, [&](std::uint8_t* bytes, double s) {
                                  const double t = index++ % 1000 == 0 ? 0.0 : kStart.seconds() + s;
                                  std::memcpy(bytes, &t, 8);
                                }));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->points.size(), static_cast<std::size_t>(kRings * kColumns - 15));
  EXPECT_EQ(normalizer.repaired().at("points: time far outside of the sweep"), 15);
  EXPECT_NEAR(read->span.seconds(), 0.1, 1e-3);
}

TEST(SweepNormalizer, SpansThatDoNotFitTheRate) {
  LidarSpec spec = Spec();
  spec.rate_hz = 20.0;
  SweepNormalizer twice(spec);
  const LidarSweep sent = MakeSweep(kStart, kRings, kColumns, 0.0);
  const auto read =
      Normalize(twice, CloudWithTime(sent, "time", PointDatatype::kFloat32, Put<float>(1.0)));
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->span.seconds(), 0.1, 1e-3);
  EXPECT_THAT(twice.notes(), Contains(HasSubstr("set lidar.rate_hz to about 10")));
  SweepNormalizer much(Spec());
  EXPECT_FALSE(
      Normalize(much, CloudWithTime(sent, "time", PointDatatype::kFloat32, Put<float>(15.0))));
  EXPECT_THAT(much.notes(), Contains(HasSubstr("Is lidar.rate_hz right?")));
}

TEST(SweepNormalizer, OrganisedCloudsWithoutTimesUseColumns) {
  LidarSweep sent = MakeSweep(kStart, 128, 1024, 0.3);
  PointCloud2Data cloud = OusterCloud(sent, Duration::FromMilliseconds(100));
  std::erase_if(cloud.fields,
                [](const PointField& field) { return field.name == "t" || field.name == "ring"; });
  SweepNormalizer normalizer(Spec(128));
  const auto read = Normalize(normalizer, cloud);
  ASSERT_TRUE(read);
  ASSERT_TRUE(read->has_times && read->has_rings);
  std::map<std::pair<int, std::int32_t>, Eigen::Vector3f> expected;
  for (const LidarPoint& p : sent.points) expected[{p.ring, p.offset_ns / 1000}] = p.position;
  for (const LidarPoint& p : read->points) {
    const auto found = expected.find({p.ring, p.offset_ns / 1000});
    ASSERT_NE(found, expected.end());
    ASSERT_EQ(found->second, p.position);
  }
}

TEST(SweepNormalizer, PointsByRingWithoutTimesAreInstantaneous) {
  LidarSweep sent = MakeSweep(kStart, kRings, kColumns, 0.0);
  std::stable_sort(sent.points.begin(), sent.points.end(),
                   [](const LidarPoint& a, const LidarPoint& b) { return a.ring < b.ring; });
  PointCloud2Data cloud = CloudWithTime(sent, "nothing", PointDatatype::kFloat32, Put<float>(1.0));
  SweepNormalizer normalizer(Spec());
  const auto read = Normalize(normalizer, cloud);
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->has_times);
  EXPECT_EQ(read->span, Duration());
  EXPECT_THAT(normalizer.notes(), Contains(HasSubstr("taken as instantaneous")));
}

TEST(SweepNormalizer, MotionCompensatedCloudsIgnoreTimes) {
  LidarSpec spec = Spec();
  spec.point_timing = PointTiming::kInstantaneous;
  SweepNormalizer normalizer(spec);
  const auto read =
      Normalize(normalizer, CloudWithTime(MakeSweep(kStart, kRings, kColumns, 0.0), "time",
                                          PointDatatype::kFloat32, Put<float>(1.0)));
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->has_times);
  EXPECT_EQ(read->stamp, kStart);
  for (const LidarPoint& point : read->points) ASSERT_EQ(point.offset_ns, 0);
}

TEST(ExtractPoints, LayoutsThatCannotBeRead) {
  SweepNormalizer normalizer(Spec());
  PointCloud2Data cloud = CloudWithTime(MakeSweep(kStart, 2, 10, 0.0), "t", PointDatatype::kUint32,
                                        Put<std::uint32_t>(1e9));
  PointCloud2Data bad = cloud;
  bad.big_endian = true;
  EXPECT_THAT(Normalize(normalizer, bad).error().message, HasSubstr("big-endian"));
  bad = cloud;
  bad.fields[1].datatype = PointDatatype::kInt16;
  EXPECT_THAT(Normalize(normalizer, bad).error().message,
              HasSubstr("z float32@0, x int16@4, y float32@8, t uint32@12"));
  bad = cloud;
  bad.fields[3].offset = 24;
  EXPECT_THAT(Normalize(normalizer, bad).error().message,
              HasSubstr("'t' (uint32 at offset 24) does not fit into points of 27"));
  bad = cloud;
  bad.fields[3].offset = 0xfffffffe;
  EXPECT_THAT(Normalize(normalizer, bad).error().message, HasSubstr("does not fit"));
  bad = cloud;
  bad.width *= 2;
  EXPECT_THAT(Normalize(normalizer, bad).error().message, HasSubstr("does not fit its"));
}

TEST(Livox, CustomMsgIsReadByItsDefinition) {
  const std::string definition =
      "# comment\nHeader header\nuint64 timebase  # ns\nuint32 point_num\nuint8 lidar_id\nuint8[3] "
      "rsvd\nCustomPoint[] points\n"
      "====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
      "====\nMSG: livox_ros_driver/CustomPoint\nuint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 "
      "z\nuint8 reflectivity\n"
      "uint8 tag\nuint8 line\n";
  WireWriter writer;
  writer.PutHeader(kStart, "livox");
  writer.Put(std::uint64_t{12});
  writer.Put(std::uint32_t{200});
  for (int i = 0; i < 4; ++i) writer.Put(std::uint8_t{0});
  writer.Put(std::uint32_t{200});
  for (int i = 0; i < 200; ++i) {
    writer.Put(static_cast<std::uint32_t>(i * 500'000));
    for (const float v : {1.0F + static_cast<float>(i), 2.0F, 3.0F}) writer.Put(v);
    for (const int v : {77, 0, i % 6}) writer.Put(static_cast<std::uint8_t>(v));
  }
  const std::vector<std::uint8_t> message = writer.Take();
  const auto view = ViewLivoxPoints(message, definition);
  ASSERT_TRUE(view) << view.error().message;
  SweepNormalizer normalizer(Spec(6));
  LidarSpec spec = Spec(6);
  spec.max_range = 1e3;
  SweepNormalizer far(spec);
  auto raw = ExtractPoints(*view, far.filter());
  ASSERT_TRUE(raw) << raw.error().message;
  const auto sweep = far.Normalize(std::move(*raw));
  ASSERT_TRUE(sweep);
  ASSERT_EQ(sweep->points.size(), 200u);
  EXPECT_EQ(sweep->points[199].offset_ns, 199 * 500'000);
  EXPECT_EQ(sweep->points[7].ring, 1);
  EXPECT_EQ(sweep->points[7].intensity, 77.0F);
  EXPECT_EQ(sweep->points[7].position, Eigen::Vector3f(8.0F, 2.0F, 3.0F));
  for (std::size_t size = 0; size < message.size(); size += 13) {
    EXPECT_FALSE(ViewLivoxPoints(ByteSpan(message).first(size), definition));
  }
  EXPECT_FALSE(ViewLivoxPoints(message, "Header header\nfloat32 x\n"));
}

// Any bytes are either a sweep that keeps its promises or an Error.
TEST(ExtractPoints, SurvivesMutatedMessages) {
  const RosMessage message = PointCloud2Message(CloudWithTime(
      MakeSweep(kStart, kRings, 100, 0.1), "time", PointDatatype::kFloat32, Put<float>(1.0)));
  RandomStream random(7);
  int errors = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::uint8_t> bytes = message.bytes;
    for (int i = 0; i < 3; ++i) {
      // The first 200 bytes hold sizes and fields.
      const double range = round % 4 == 0 ? static_cast<double>(bytes.size()) : 200.0;
      bytes[static_cast<std::size_t>(random.Uniform(0.0, range))] =
          static_cast<std::uint8_t>(random.NextBits());
    }
    if (round % 5 == 0)
      bytes.resize(
          static_cast<std::size_t>(random.Uniform(0.0, static_cast<double>(bytes.size()))));
    SweepNormalizer normalizer(Spec());
    const auto view = ParsePointCloud2(bytes);
    const auto sweep =
        view.and_then(
                [&](const PointCloud2View& v) { return ExtractPoints(v, normalizer.filter()); })
            .and_then([&](RawSweep raw) { return normalizer.Normalize(std::move(raw)); });
    errors += sweep ? 0 : 1;
    if (!sweep) continue;
    ASSERT_FALSE(sweep->points.empty());
    for (const LidarPoint& point : sweep->points) {
      ASSERT_TRUE(point.position.allFinite());
      ASSERT_GE(point.offset_ns, 0);
      ASSERT_LE(point.offset_ns, sweep->span.nanoseconds());
    }
  }
  EXPECT_GT(errors, 100);
}

}  // namespace
}  // namespace mlvi
