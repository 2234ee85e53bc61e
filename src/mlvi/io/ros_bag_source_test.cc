// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_bag_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mlvi/io/bag_fixtures.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

using test::kStart;
using test::MakeRig;
using test::MakeSweep;
using test::TemporaryPath;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

test::Content Read(const std::vector<std::string>& paths, const Rig& rig,
                   const RosBagSourceOptions& options = {}) {
  auto source = RosBagSource::Open(paths, rig, options);
  EXPECT_TRUE(source) << source.error().message;
  return source ? test::ReadAll(**source) : test::Content();
}

Error OpenError(const std::vector<std::string>& paths, const Rig& rig,
                const RosBagSourceOptions& options = {}) {
  const auto source = RosBagSource::Open(paths, rig, options);
  EXPECT_FALSE(source);
  return source ? Error() : source.error();
}

// The points of `sent` that are returns, by ring and firing time, against what was read.
void ExpectSameSweep(const LidarSweep& sent, const LidarSweep& read, Duration time_tolerance) {
  using Key = std::pair<int, std::int64_t>;  // ring, time rounded to 10 us
  const auto key = [](const LidarSweep& sweep, const LidarPoint& point) {
    const std::int64_t ns = (sweep.stamp - kStart).nanoseconds() + point.offset_ns;
    return Key(point.ring, (ns + 5000) / 10000);
  };
  std::map<Key, const LidarPoint*> expected;
  for (const LidarPoint& point : sent.points) {
    if (!point.position.isZero()) expected[key(sent, point)] = &point;
  }
  ASSERT_EQ(read.points.size(), expected.size());
  std::int32_t first = std::numeric_limits<std::int32_t>::max(), last = 0;
  for (const LidarPoint& point : read.points) {
    const auto found = expected.find(key(read, point));
    ASSERT_NE(found, expected.end());
    ASSERT_EQ(point.position, found->second->position);
    ASSERT_EQ(point.intensity, found->second->intensity);
    const Time time = read.stamp + Duration::FromNanoseconds(point.offset_ns);
    const Time exact = sent.stamp + Duration::FromNanoseconds(found->second->offset_ns);
    ASSERT_LE(std::abs((time - exact).nanoseconds()), time_tolerance.nanoseconds());
    first = std::min(first, point.offset_ns);
    last = std::max(last, point.offset_ns);
  }
  EXPECT_EQ(first, 0);
  EXPECT_EQ(read.span.nanoseconds(), last);
  EXPECT_TRUE(read.has_times && read.has_rings && read.has_intensity);
}

struct LayoutCase {
  std::string model;
  int rings = 0;
  int columns = 0;
  VelodyneStamp stamp = VelodyneStamp::kFirstPacket;
  BagCompression compression = BagCompression::kNone;
  Duration tolerance;  // what the layout's number format can hold
};

class Layouts : public ::testing::TestWithParam<LayoutCase> {};

TEST_P(Layouts, RoundTrip) {
  const LayoutCase& c = GetParam();
  Rig rig = MakeRig(c.model, c.rings);
  const std::string path = TemporaryPath("round_trip.bag");
  std::vector<LidarSweep> sent;
  test::WriteRecording(path, rig, {.compression = c.compression, .velodyne_stamp = c.stamp}, 0.2,
                       [&](int index, Time stamp) {
                         sent.push_back(MakeSweep(stamp, c.rings, c.columns, 0.2, 100 + index));
                         return sent.back();
                       });
  const test::Content content = Read({path}, rig);
  EXPECT_EQ(content.error, "");
  ASSERT_EQ(content.imu.size(), 40u);
  for (int i = 0; i < 40; ++i) {
    const ImuSample expected = test::MakeImu(i);
    EXPECT_EQ(content.imu[i].stamp, expected.stamp);
    EXPECT_EQ(content.imu[i].angular_velocity, expected.angular_velocity);
    EXPECT_EQ(content.imu[i].linear_acceleration, expected.linear_acceleration);
  }
  ASSERT_EQ(content.sweeps.size(), 2u);
  for (std::size_t i = 0; i < sent.size(); ++i)
    ExpectSameSweep(sent[i], content.sweeps[i], c.tolerance);
  EXPECT_EQ(content.counts.at("/points").delivered, 2);
  EXPECT_EQ(content.counts.at("/imu").messages, 40);
}

INSTANTIATE_TEST_SUITE_P(
    All, Layouts,
    ::testing::Values(LayoutCase{"OS0-128", 128, 1024, VelodyneStamp::kFirstPacket,
                                 BagCompression::kNone, Duration()},
                      LayoutCase{"OS0-128", 128, 1024, VelodyneStamp::kFirstPacket,
                                 BagCompression::kLz4, Duration()},
                      // Half a unit in the last place of a float at 0.1: 4 ns.
                      LayoutCase{"VLP-32C", 32, 1808, VelodyneStamp::kFirstPacket,
                                 BagCompression::kBz2, Duration::FromNanoseconds(5)},
                      LayoutCase{"VLP-32C", 32, 1808, VelodyneStamp::kLastPacket,
                                 BagCompression::kNone, Duration::FromNanoseconds(9)},
                      // Of a double at 1.6e9: 119 ns, and rounding to nanoseconds twice.
                      LayoutCase{"PandarXT-32", 32, 2000, VelodyneStamp::kFirstPacket,
                                 BagCompression::kLz4, Duration::FromNanoseconds(121)}),
    [](const auto& layout) {
      std::string name = layout.param.model +
                         (layout.param.stamp == VelodyneStamp::kLastPacket ? "End" : "") +
                         std::to_string(static_cast<int>(layout.param.compression));
      std::erase(name, '-');
      return name;
    });

TEST(RosBagSource, SweepsThatAreAllDroppedAreAnErrorWithItsReason) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("all_dropped.bag");
  test::WriteRecording(path, rig, {}, 0.2,
                       [](int index, Time stamp) { return MakeSweep(stamp, 128, 64, 0.2, index); });
  Rig wrong = rig;
  wrong.lidar->rate_hz = 1000.0;
  auto source = RosBagSource::Open({path}, wrong);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT(test::ReadAll(**source).error, HasSubstr("Is lidar.rate_hz right?"));
  EXPECT_EQ((*source)->ending(), RosBagSource::Ending::kUnusable);
  EXPECT_EQ((*source)->Dropped().at("lidar").size(), 1U);
}

TEST(RosBagSource, NotesTellTheConventionOfTimes) {
  const Rig rig = MakeRig("VLP-32C", 32);
  const std::string path = TemporaryPath("velodyne.bag");
  test::WriteRecording(path, rig, {.velodyne_stamp = VelodyneStamp::kLastPacket}, 0.2,
                       [](int, Time stamp) { return MakeSweep(stamp, 32, 1808, 0.1); });
  EXPECT_THAT(
      Read({path}, rig).notes,
      Contains(HasSubstr(
          "'time' holds times in s, back from the header's stamp, which is the sweep's end")));
}

TEST(RosBagSource, TimeOffsetsOfTheRigMoveStamps) {
  Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("offsets.bag");
  test::WriteRecording(path, rig, {}, 0.1,
                       [](int, Time stamp) { return MakeSweep(stamp, 128, 1024, 0.0); });
  rig.imu.time_offset = Duration::FromMilliseconds(3);
  rig.lidar->time_offset = Duration::FromMilliseconds(-7);
  const test::Content content = Read({path}, rig);
  ASSERT_EQ(content.sweeps.size(), 1u);
  EXPECT_EQ(content.imu.front().stamp, kStart + Duration::FromMilliseconds(3));
  EXPECT_EQ(content.sweeps.front().stamp, kStart - Duration::FromMilliseconds(7));
}

TEST(RosBagSource, ImuInGIsConverted) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("g.bag");
  test::WriteRecording(
      path, rig, {}, 1.5, [](int, Time stamp) { return MakeSweep(stamp, 128, 64, 0.0); },
      1.0 / kStandardGravity);
  const test::Content content = Read({path}, rig);
  ASSERT_EQ(content.imu.size(), 300u);
  for (int i = 0; i < 300; ++i) {
    EXPECT_LT((content.imu[i].linear_acceleration - test::MakeImu(i).linear_acceleration).norm(),
              1e-12);
  }
  EXPECT_THAT(content.notes, Contains(HasSubstr("taken as g and converted to m/s^2")));
  EXPECT_EQ(content.counts.at("/imu").repaired.at("messages: g converted to m/s^2"), 300);
}

TEST(RosBagSource, BadImuSamplesAreDroppedAndCounted) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("imu.bag");
  auto writer = BagWriter::Create(path, rig);
  ASSERT_TRUE(writer);
  for (int i = 0; i < 50; ++i) {
    ImuSample sample = test::MakeImu(i);
    if (i == 10) sample.angular_velocity.y() = std::numeric_limits<double>::quiet_NaN();
    if (i == 20) sample.linear_acceleration.x() = std::numeric_limits<double>::infinity();
    ASSERT_TRUE((*writer)->Write(sample));
    for (int again = 0; again < (i == 30 ? 1 : 0); ++again) ASSERT_TRUE((*writer)->Write(sample));
  }
  ASSERT_TRUE((*writer)->Close());
  const test::Content content = Read({path}, rig, {.use_lidar = false, .cameras = {}});
  EXPECT_EQ(content.imu.size(), 48u);
  EXPECT_EQ(content.counts.at("/imu").dropped.at("NaN or infinite"), 2);
  EXPECT_EQ(content.counts.at("/imu").dropped.at("duplicate stamp"), 1);
}

TEST(RosBagSource, BadPointsAndEmptySweepsAreCounted) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("points.bag");
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  test::WriteRecording(path, rig, {}, 0.3, [&](int index, Time stamp) {
    LidarSweep sweep = MakeSweep(stamp, 128, 1024, index == 1 ? 1.0 : 0.0);
    if (index == 0) {
      sweep.points[5].position.x() = nan;
      sweep.points[6].position.y() = inf;
      sweep.points[7].position = {0.1F, 0.1F, 0.1F};
      sweep.points[8].position = {200.0F, 0.0F, 0.0F};
      sweep.points[9].position.setZero();
    }
    return sweep;
  });
  const test::Content content = Read({path}, rig);
  ASSERT_EQ(content.sweeps.size(), 2u);
  EXPECT_EQ(content.sweeps[0].points.size(), 128u * 1024u - 5u);
  for (const LidarPoint& point : content.sweeps[0].points) EXPECT_TRUE(point.position.allFinite());
  const StreamCounts& counts = content.counts.at("/points");
  EXPECT_EQ(counts.dropped.at("no valid point"), 1);
  EXPECT_EQ(counts.repaired.at("points: NaN or infinite"), 2);
  EXPECT_EQ(counts.repaired.at("points: nearer than lidar.min_range"), 1);
  EXPECT_EQ(counts.repaired.at("points: beyond lidar.max_range"), 1);
  EXPECT_EQ(counts.repaired.at("points: no return (0, 0, 0)"), 1 + 128 * 1024);
}

TEST(RosBagSource, PartsOfARecordingFollowOneAnother) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string first = TemporaryPath("a.bag"), second = TemporaryPath("b.bag");
  test::WriteRecording(first, rig, {}, 0.2,
                       [](int, Time stamp) { return MakeSweep(stamp, 128, 1024, 0.0); });
  auto writer = BagWriter::Create(second, rig);
  ASSERT_TRUE(writer);
  for (int i = 40; i < 60; ++i) ASSERT_TRUE((*writer)->Write(test::MakeImu(i)));
  ASSERT_TRUE((*writer)->Close());
  const test::Content content = Read({first, second}, rig);
  EXPECT_EQ(content.error, "");
  ASSERT_EQ(content.imu.size(), 60u);
  for (std::size_t i = 1; i < content.imu.size(); ++i)
    EXPECT_LT(content.imu[i - 1].stamp, content.imu[i].stamp);
}

TEST(RosBagSource, FilesThatAreNoBags) {
  const Rig rig = MakeRig("OS0-128", 128);
  EXPECT_THAT(OpenError({TemporaryPath("nowhere.bag")}, rig).message,
              HasSubstr("does the file exist"));
  EXPECT_THAT(OpenError({::testing::TempDir()}, rig).message, HasSubstr("is a folder"));
  const std::string path = TemporaryPath("bad.bag");
  test::WriteBytes(path, {});
  EXPECT_THAT(OpenError({path}, rig).message, HasSubstr("is empty (0 bytes)"));
  const std::string html = "<!DOCTYPE html><html>quota exceeded</html>";
  test::WriteBytes(path, {html.begin(), html.end()});
  EXPECT_THAT(OpenError({path}, rig).message, HasSubstr("is no ROS 1 bag"));
  const std::string sqlite = "SQLite format 3";
  test::WriteBytes(path, {sqlite.begin(), sqlite.end()});
  EXPECT_THAT(OpenError({path}, rig).message, HasSubstr("ROS 2 bag"));
  EXPECT_EQ(OpenError({path}, rig).kind, ErrorKind::kInput);
}

TEST(RosBagSource, MissingTopicNamesThoseThereAndTheField) {
  Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("topics.bag");
  test::WriteRecording(path, rig, {}, 0.1,
                       [](int, Time stamp) { return MakeSweep(stamp, 128, 64, 0.0); });
  rig.lidar->topic = "/os_cloud_node/points";
  const std::string message = OpenError({path}, rig).message;
  EXPECT_THAT(message, HasSubstr("LiDAR topic '/os_cloud_node/points'"));
  EXPECT_THAT(message, HasSubstr("; did you mean '/points'? Check lidar.topic"));
  EXPECT_THAT(message, HasSubstr("/imu (sensor_msgs/Imu)"));
  EXPECT_THAT(message, HasSubstr("/points (sensor_msgs/PointCloud2)"));
  rig.lidar->topic = "/points";
  rig.imu.topic = "/points2";
  EXPECT_THAT(OpenError({path}, rig).message, HasSubstr("; did you mean '/imu'? Check imu.topic"));
  rig.imu.topic = "/points";
  rig.lidar->topic = "/imu";
  EXPECT_THAT(OpenError({path}, rig).message, HasSubstr("is no message of that sensor"));
  rig.lidar.reset();
  EXPECT_EQ(OpenError({path}, rig).kind, ErrorKind::kConfiguration);
  EXPECT_THAT(OpenError({path}, MakeRig("OS0-128", 128), {.cameras = {"cam7"}}).message,
              HasSubstr("no camera 'cam7'"));
}

TEST(RosBagSource, UnknownLayoutNamesTheFieldsFound) {
  const Rig rig = MakeRig("OS0-128", 128);
  const std::string path = TemporaryPath("layout.bag");
  auto writer = RawBagWriter::Create(path, BagCompression::kNone);
  ASSERT_TRUE(writer);
  PointCloud2Data cloud;
  cloud.fields = {{"range", 0, PointDatatype::kFloat32, 1},
                  {"azimuth", 4, PointDatatype::kUint16, 1}};
  cloud.point_step = 6;
  cloud.width = 10;
  cloud.data.resize(60);
  for (int i = 0; i < 30; ++i) {
    cloud.stamp = kStart + Duration::FromMilliseconds(100) * i;
    ASSERT_TRUE((*writer)->Write("/points", cloud.stamp, PointCloud2Message(cloud)));
    ASSERT_TRUE((*writer)->Write("/imu", cloud.stamp, ImuMessage(test::MakeImu(i))));
  }
  ASSERT_TRUE((*writer)->Close());
  const test::Content content = Read({path}, rig);
  EXPECT_THAT(content.error, HasSubstr("its fields are: range float32@0, azimuth uint16@4"));
  EXPECT_LT(content.imu.size(), 30u);  // it does not read on in vain
}

TEST(RosBagSource, ImagesAreDecodedWhenAskedFor) {
  Rig rig = MakeRig("OS0-128", 128);
  CameraSpec camera;
  camera.name = "cam0";
  camera.topic = "/cam0";
  camera.model = *MakeCameraModel("equidistant", 12, 8, {350, 350, 6, 4}, {0, 0, 0, 0});
  camera.time_offset = Duration::FromMilliseconds(2);
  rig.cameras.push_back(camera);
  Image image;
  image.stamp = kStart;
  image.width = 12;
  image.height = 8;
  for (int i = 0; i < 96; ++i) image.pixels.push_back(static_cast<std::uint8_t>(i));
  const std::string path = TemporaryPath("image.bag");
  auto writer = BagWriter::Create(path, rig);
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->Write(test::MakeImu(0)));
  ASSERT_TRUE((*writer)->Write(image));
  ASSERT_TRUE((*writer)->Close());
  const test::Content content = Read({path}, rig, {.use_lidar = false, .cameras = {"cam0"}});
  ASSERT_EQ(content.images.size(), 1u);
  EXPECT_EQ(content.images[0].pixels, image.pixels);
  EXPECT_EQ(content.images[0].width, 12);
  EXPECT_EQ(content.images[0].stamp, kStart + Duration::FromMilliseconds(2));
  EXPECT_TRUE(Read({path}, rig, {.use_lidar = false, .cameras = {}}).images.empty());
}

TEST(RosBagSource, ReadsTheWalk) {
  const std::string bag = test::SharedData("walk_os0/walk_os0.bag");
  MLVI_SKIP_WITHOUT(bag);
  const auto rig = LoadRig("walk_os0");
  ASSERT_TRUE(rig) << rig.error().message;
  const test::Content content = Read({bag}, *rig);
  EXPECT_EQ(content.error, "");
  ASSERT_EQ(content.sweeps.size(), 76u);
  ASSERT_EQ(content.imu.size(), 7705u);
  double norm = 0.0;
  for (const ImuSample& sample : content.imu) norm += sample.linear_acceleration.norm() / 7705.0;
  EXPECT_NEAR(norm, 9.8, 0.05);
  for (const LidarSweep& sweep : content.sweeps) {
    EXPECT_GT(sweep.points.size(), 60000u);
    EXPECT_FALSE(sweep.has_times || sweep.has_rings);
    EXPECT_EQ(sweep.span, Duration());
  }
  EXPECT_NEAR((content.sweeps.back().stamp - content.sweeps.front().stamp).seconds(), 37.5, 0.1);
}

}  // namespace
}  // namespace mlvi
