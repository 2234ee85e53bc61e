// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/rig_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "mlvi/io/bag_fixtures.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

constexpr char kGood[] = R"(
name: small
imu:
  topic: /imu
  rate_hz: 200
  noise: {accelerometer_density: 1e-3, gyroscope_density: 2e-4, accelerometer_random_walk: 3e-5, gyroscope_random_walk: 8e-6}
lidar:
  topic: /points
  rate_hz: 10
  T_body_lidar: {t: [0.1, 0.2, 0.3], R: [0, -1, 0, 1, 0, 0, 0, 0, 1]}
cameras:
  - name: cam0
    topic: /cam0
    model: mei
    intrinsics: [1.9, 670.0, 669.0, 378.0, 280.0]
    distortion: [-0.04, 0.15, 1.8e-4, -1.2e-3]
    size: [720, 540]
    T_body_camera: [0, 0, 1, 0.05, -1, 0, 0, 0, 0, -1, 0, 0.01, 0, 0, 0, 1]
    time_offset_s: 0.0018
)";

// kGood with one piece of text replaced.
std::string With(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string ErrorOf(const std::string& yaml) {
  const auto rig = ParseRig(yaml, "small.yaml");
  EXPECT_FALSE(rig) << yaml;
  if (rig) return "";
  EXPECT_EQ(rig.error().kind, ErrorKind::kConfiguration);
  return rig.error().message;
}

void ExpectSamePose(const Pose3& a, const Pose3& b) {
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-15);
  // The arc cosine near 1 loses half of the digits.
  EXPECT_LT(a.rotation().angularDistance(b.rotation()), 1e-7);
  EXPECT_LT((a.R() - b.R()).cwiseAbs().maxCoeff(), 1e-14);
}

void ExpectSameRig(const Rig& a, const Rig& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.gravity, b.gravity);
  EXPECT_EQ(a.imu.topic, b.imu.topic);
  EXPECT_EQ(a.imu.rate_hz, b.imu.rate_hz);
  EXPECT_EQ(a.imu.noise.accelerometer_density, b.imu.noise.accelerometer_density);
  EXPECT_EQ(a.imu.noise.gyroscope_density, b.imu.noise.gyroscope_density);
  EXPECT_EQ(a.imu.noise.accelerometer_random_walk, b.imu.noise.accelerometer_random_walk);
  EXPECT_EQ(a.imu.noise.gyroscope_random_walk, b.imu.noise.gyroscope_random_walk);
  EXPECT_EQ(a.imu.initial_accelerometer_bias_sigma, b.imu.initial_accelerometer_bias_sigma);
  EXPECT_EQ(a.imu.initial_gyroscope_bias_sigma, b.imu.initial_gyroscope_bias_sigma);
  EXPECT_EQ(a.imu.accelerometer_saturation, b.imu.accelerometer_saturation);
  EXPECT_EQ(a.imu.gyroscope_saturation, b.imu.gyroscope_saturation);
  EXPECT_EQ(a.imu.acceleration_unit, b.imu.acceleration_unit);
  EXPECT_EQ(a.imu.time_offset, b.imu.time_offset);
  ASSERT_EQ(a.lidar.has_value(), b.lidar.has_value());
  if (a.lidar) {
    EXPECT_EQ(a.lidar->topic, b.lidar->topic);
    EXPECT_EQ(a.lidar->model, b.lidar->model);
    ExpectSamePose(a.lidar->T_body_lidar, b.lidar->T_body_lidar);
    EXPECT_EQ(a.lidar->rings, b.lidar->rings);
    EXPECT_EQ(a.lidar->rate_hz, b.lidar->rate_hz);
    EXPECT_EQ(a.lidar->min_range, b.lidar->min_range);
    EXPECT_EQ(a.lidar->max_range, b.lidar->max_range);
    EXPECT_EQ(a.lidar->range_noise, b.lidar->range_noise);
    EXPECT_EQ(a.lidar->beam_noise, b.lidar->beam_noise);
    EXPECT_EQ(a.lidar->point_timing, b.lidar->point_timing);
    EXPECT_EQ(a.lidar->time_offset, b.lidar->time_offset);
  }
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    const CameraSpec &c = a.cameras[i], &d = b.cameras[i];
    EXPECT_EQ(c.name, d.name);
    EXPECT_EQ(c.topic, d.topic);
    EXPECT_EQ(c.model->name(), d.model->name());
    EXPECT_EQ(c.model->parameters(), d.model->parameters());
    EXPECT_EQ(c.model->width(), d.model->width());
    EXPECT_EQ(c.model->height(), d.model->height());
    ExpectSamePose(c.T_body_camera, d.T_body_camera);
    EXPECT_EQ(c.rate_hz, d.rate_hz);
    EXPECT_EQ(c.time_offset, d.time_offset);
    EXPECT_EQ(c.valid_radius_px, d.valid_radius_px);
    EXPECT_EQ(c.mask_file, d.mask_file);
  }
  EXPECT_EQ(a.p_body_pano, b.p_body_pano);
  ExpectSamePose(a.T_body_groundtruth, b.T_body_groundtruth);
}

TEST(RigFile, ReadsAllFields) {
  const auto rig = ParseRig(kGood, "small.yaml");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->imu.noise.gyroscope_random_walk, 8e-6);
  EXPECT_EQ(rig->lidar->T_body_lidar.translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
  const Eigen::Vector3d x_in_body = rig->lidar->T_body_lidar.rotation() * Eigen::Vector3d::UnitX();
  EXPECT_LT((x_in_body - Eigen::Vector3d::UnitY()).norm(), 1e-15);  // rows, not columns
  EXPECT_EQ(rig->cameras[0].time_offset.nanoseconds(), 1'800'000);
  EXPECT_EQ(rig->cameras[0].model->name(), "mei");
}

TEST(RigFile, ErrorsNameFileLineAndField) {
  EXPECT_THAT(ErrorOf(With("rate_hz: 200", "rate_hertz: 200")),
              HasSubstr("missing field 'imu.rate_hz'"));
  EXPECT_THAT(ErrorOf(With("name: small", "name: small\ngravty: 9.8")),
              HasSubstr("small.yaml:3: unknown key 'gravty'; did you mean 'gravity'?"));
  EXPECT_THAT(ErrorOf(With("R: [0, -1, 0, 1, 0, 0, 0, 0, 1]", "R: [0, -1, 0, 1, 0, 0, 0, 0, -1]")),
              HasSubstr("lidar.T_body_lidar.R: determinant -1.0000"));
  EXPECT_THAT(ErrorOf(With("R: [0, -1, 0, 1, 0, 0, 0, 0, 1]", "R: [0, -1, 0, 1, 0, 0, 0, 0]")),
              HasSubstr("expected a list of 9 finite numbers, found 8"));
  EXPECT_THAT(ErrorOf(With("R: [0, -1, 0, 1, 0, 0, 0, 0, 1]", "q_xyzw: [0, 0, 0, 2]")),
              HasSubstr("norm 2 is not 1"));
  EXPECT_THAT(ErrorOf(With(", R: [0, -1, 0, 1, 0, 0, 0, 0, 1]", "")), HasSubstr("give either R"));
  EXPECT_THAT(ErrorOf(With("rate_hz: 10", "rate_hz: ten")),
              HasSubstr("lidar.rate_hz: expected a number"));
  EXPECT_THAT(ErrorOf(With("rate_hz: 10", "rate_hz: .nan")), HasSubstr("must be finite"));
  EXPECT_THAT(ErrorOf(With("rate_hz: 10", "rate_hz: -10")),
              HasSubstr("lidar.rate_hz = -10: must be in"));
  EXPECT_THAT(ErrorOf(With("rate_hz: 10", "rate_hz: 10\n  point_timing: sometimes")),
              HasSubstr("expected one of auto, instantaneous"));
  EXPECT_THAT(ErrorOf(With("model: mei", "model: mai")), HasSubstr("did you mean 'mei'"));
  EXPECT_THAT(ErrorOf(With("size: [720, 540]", "size: [720]")), HasSubstr("cameras[0].size"));
  EXPECT_THAT(ErrorOf(With("name: small", "name: small\nname: large")), HasSubstr("given twice"));
  EXPECT_THAT(ErrorOf("[1, 2"), HasSubstr("not valid YAML"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("expected a map"));
  EXPECT_THAT(ErrorOf("name: x"), HasSubstr("missing field 'imu'"));
}

TEST(RigFile, BuiltinRigsAreValidAndComeBackFromAFile) {
  ASSERT_THAT(BuiltinRigNames(), ::testing::ElementsAre("euroc_os0", "hilti_2022", "m2dgr",
                                                        "newer_college", "walk_os0"));
  for (const std::string& name : BuiltinRigNames()) {
    SCOPED_TRACE(name);
    const auto rig = LoadRig(name);
    ASSERT_TRUE(rig) << rig.error().message;
    EXPECT_EQ(rig->name, name);
    // The shipped file and the compiled-in text are one.
    const auto from_source =
        LoadRig(std::string(MLVI_SOURCE_DIR) + "/config/rigs/" + name + ".yaml");
    ASSERT_TRUE(from_source) << from_source.error().message;
    ExpectSameRig(*rig, *from_source);
    const std::string path = test::TemporaryPath(name + ".yaml");
    ASSERT_TRUE(SaveRig(*rig, path));
    const auto read = LoadRig(path);
    ASSERT_TRUE(read) << read.error().message;
    ExpectSameRig(*rig, *read);
  }
}

class RigMasks : public ::testing::Test {
 protected:
  RigMasks() {
    std::filesystem::create_directories(folder_);
    rig_ = *ParseRig(kGood, "small.yaml");
    rig_.cameras[0].mask_file = "left.pgm";
  }
  ~RigMasks() override { std::filesystem::remove_all(folder_); }

  // A rig file beside its mask, a PGM whose left column is zero.
  Expected<Rig> Load(int width, int height) {
    std::string pgm = fmt::format("P5\n{} {}\n255\n", width, height);
    for (int i = 0; i < width * height; ++i) pgm += i % width == 0 ? '\0' : '\xff';
    std::ofstream(folder_ + "/left.pgm", std::ios::binary) << pgm;
    EXPECT_TRUE(SaveRig(rig_, folder_ + "/rig.yaml"));
    return LoadRig(folder_ + "/rig.yaml");
  }

  std::string folder_ = ::testing::TempDir() + "mlvi_rig_masks_" + std::to_string(getpid());
  Rig rig_;
};

TEST_F(RigMasks, AreReadFromBesideTheRigFile) {
  const CameraModel& lens = *rig_.cameras[0].model;
  const auto rig = Load(lens.width(), lens.height());
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_TRUE(rig->cameras[0].mask);
  EXPECT_EQ(rig->cameras[0].mask->pixels[0], 0);
  EXPECT_EQ(rig->cameras[0].mask->pixels[1], 255);
}

TEST_F(RigMasks, AreFoundFromACopyOfTheRigElsewhere) {
  const CameraModel& lens = *rig_.cameras[0].model;
  const auto rig = Load(lens.width(), lens.height());
  ASSERT_TRUE(rig) << rig.error().message;
  std::filesystem::create_directories(folder_ + "/results/today");
  ASSERT_TRUE(SaveRig(*rig, folder_ + "/results/today/rig.yaml"));
  const auto copy = LoadRig(folder_ + "/results/today/rig.yaml");
  ASSERT_TRUE(copy) << copy.error().message;
  ASSERT_TRUE(copy->cameras[0].mask);
  EXPECT_EQ(copy->cameras[0].mask->pixels, rig->cameras[0].mask->pixels);
}

TEST_F(RigMasks, OfTheWrongSizeOrUnreadableAreErrorsThatSaySo) {
  const auto small = Load(10, 8);
  ASSERT_FALSE(small);
  EXPECT_THAT(small.error().message, HasSubstr("is 10 x 8 px, its images are"));
  rig_.cameras[0].mask_file = "rig.yaml";
  const auto text = Load(10, 8);
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().message, HasSubstr("is no image that can be read"));
  rig_.cameras[0].mask_file = "nowhere.png";
  const auto absent = Load(10, 8);
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("nowhere.png"));
}

TEST(RigFile, EveryValueComesBackFromAFile) {
  auto rig = ParseRig(kGood, "small.yaml");
  ASSERT_TRUE(rig);
  rig->name = "quote \" and \\ in a name";
  rig->imu.acceleration_unit = AccelerationUnit::kGravities;
  rig->imu.time_offset = Duration::FromNanoseconds(-1'234'567);
  rig->lidar->point_timing = PointTiming::kInstantaneous;
  rig->lidar->time_offset = Duration::FromNanoseconds(1);
  rig->lidar->beam_noise = 1.0 / 3.0 * 1e-3;
  rig->p_body_pano = Eigen::Vector3d(0.1, 1.0 / 3.0, -0.2);
  rig->cameras[0].mask_file = "/masks/cam0.png";
  for (const auto& [model, intrinsics, distortion] :
       std::vector<std::tuple<std::string, std::vector<double>, std::vector<double>>>{
           {"equidistant", {350, 351, 360, 270}, {-0.04, -0.01, 0.005, -0.001}},
           {"mei", {1.9, 670, 669, 378, 280}, {-0.04, 0.15, 1.8e-4, -1.2e-3}},
           {"double_sphere", {-0.2, 0.6, 300, 301, 360, 270}, {}},
           {"pinhole_radtan", {600, 601, 320, 240}, {0.1, -0.2, 1e-4, 1e-5}}}) {
    const auto made = MakeCameraModel(model, 720, 540, intrinsics, distortion);
    ASSERT_TRUE(made) << made.error().message;
    rig->cameras[0].model = *made;
    const auto read = ParseRig(RigToYaml(*rig), "written");
    ASSERT_TRUE(read) << read.error().message << RigToYaml(*rig);
    ExpectSameRig(*rig, *read);
  }
}

// Optical axes and gravity-related signs as RIGS describes the real devices.
TEST(RigFile, CamerasLookWhereTheDatasetsSay) {
  const auto axis = [](const Rig& rig, const std::string& name) {
    for (const CameraSpec& camera : rig.cameras) {
      if (camera.name == name) {
        return Eigen::Vector3d(rig.lidar->T_body_lidar.inverse().rotation() *
                               camera.T_body_camera.rotation() * Eigen::Vector3d::UnitZ());
      }
    }
    ADD_FAILURE() << "no camera " << name;
    return Eigen::Vector3d::Zero().eval();
  };
  const auto ncd = LoadRig("newer_college"), m2dgr = LoadRig("m2dgr"),
             hilti = LoadRig("hilti_2022");
  ASSERT_TRUE(ncd && m2dgr && hilti);
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  EXPECT_GT(axis(*ncd, "cam0").dot(x), 0.99);
  EXPECT_GT(axis(*ncd, "cam3").dot(-y), 0.99);
  EXPECT_GT(axis(*ncd, "cam4").dot(y), 0.99);
  EXPECT_GT(axis(*m2dgr, "left").dot(x), 0.99);
  EXPECT_GT(axis(*m2dgr, "third").dot(y), 0.99);
  EXPECT_GT(axis(*m2dgr, "sixth").dot(-x), 0.99);
  EXPECT_GT(axis(*hilti, "cam0").dot(-y), 0.99);
  EXPECT_GT(axis(*hilti, "cam2").dot(z), 0.99);
  EXPECT_GT(axis(*hilti, "cam3").dot(-x), 0.99);
  EXPECT_GT(axis(*hilti, "cam4").dot(x), 0.99);
}

TEST(RigFile, UnknownNameSuggestsOne) {
  const auto rig = LoadRig("newer_colege");
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().message, HasSubstr("did you mean 'newer_college'?"));
}

}  // namespace
}  // namespace mlvi
