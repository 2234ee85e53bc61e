// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A room of 8 x 6 x 3 m in the formats that are tried, written by the test.
#include "mlvi/sim/scene_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

// y is up; a picture with a red left and a blue right half.
std::string WriteObj(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  cv::Mat picture(64, 64, CV_8UC3, cv::Scalar(255, 0, 0));
  picture(cv::Rect(0, 0, 32, 64)) = cv::Scalar(0, 0, 255);
  cv::imwrite((folder / "wall.png").string(), picture);
  std::ofstream(folder / "room.mtl") << "newmtl wall\nKd 1 1 1\nmap_Kd wall.png\n";
  std::ofstream file(folder / "room.obj");
  file << "mtllib room.mtl\nusemtl wall\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  for (int i = 0; i < 8; ++i)
    file << "v " << (i & 1 ? 4 : -4) << " " << (i & 2 ? 3 : 0) << " " << (i & 4 ? 3 : -3) << "\n";
  for (const char* face : {"1 2 4 3", "5 6 8 7", "1 2 6 5", "3 4 8 7", "1 3 7 5", "2 4 8 6"}) {
    int a = 0, b = 0, c = 0, d = 0;
    std::sscanf(face, "%d %d %d %d", &a, &b, &c, &d);
    file << "f " << a << "/1 " << b << "/2 " << c << "/3 " << d << "/4\n";
  }
  return (folder / "room.obj").string();
}

class SceneImport : public ::testing::TestWithParam<std::string> {
 protected:
  // The room in the format of the parameter.
  std::string Write() const {
    const std::filesystem::path folder =
        std::filesystem::path(::testing::TempDir()) / ("mlvi_scene_" + GetParam());
    const std::string obj = WriteObj(folder);
    if (GetParam() == "obj") return obj;
    Assimp::Importer importer;
    const std::string path = (folder / ("room." + GetParam())).string();
    const std::string format = GetParam() == "dae" ? "collada" : "gltf2";
    EXPECT_EQ(Assimp::Exporter().Export(importer.ReadFile(obj, 0), format, path), aiReturn_SUCCESS);
    return path;
  }
};

TEST_P(SceneImport, ReadsARoomWithItsPicture) {
  const auto mesh = ImportScene(Write(), {.scale = 2.0, .relief = {.fine = 0.004}});
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 12U);
  EXPECT_EQ(mesh->texture_coordinates.size(), mesh->vertices.size());
  Eigen::Vector3f low = mesh->vertices[0], high = low;
  for (const Eigen::Vector3f& v : mesh->vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  EXPECT_LT((low - Eigen::Vector3f(-8.0F, -6.0F, 0.0F)).norm(), 1e-4F);
  EXPECT_LT((high - Eigen::Vector3f(8.0F, 6.0F, 6.0F)).norm(), 1e-4F);
  const Material& wall = mesh->materials[mesh->triangle_materials[0]];
  EXPECT_EQ(wall.relief.fine, 0.004);
  EXPECT_EQ(wall.relief.coarse, 0.0);
  ASSERT_NE(wall.image, nullptr);
  EXPECT_EQ(wall.mapping, TextureMapping::kVertex);
  EXPECT_GT(wall.image->Sample(0.25F, 0.5F, 0.0F).x(), 0.95F);  // red
  EXPECT_GT(wall.image->Sample(0.75F, 0.5F, 0.0F).z(), 0.95F);  // blue
}

INSTANTIATE_TEST_SUITE_P(Formats, SceneImport, ::testing::Values("obj", "gltf", "dae"),
                         [](const auto& instance) { return instance.param; });

TEST(SceneImport, SaysWhatIsWrong) {
  EXPECT_THAT(ImportScene("/nowhere/room.obj", {}).error().message, HasSubstr("/nowhere/room.obj"));
  const std::string path =
      WriteObj(std::filesystem::path(::testing::TempDir()) / "mlvi_scene_errors");
  EXPECT_THAT(ImportScene(path, {.scale = 1e5}).error().message, HasSubstr("scale"));
  EXPECT_FALSE(ImportScene(path, {.scale = -1.0}).has_value());
  std::filesystem::remove(std::filesystem::path(path).parent_path() / "wall.png");
  EXPECT_THAT(ImportScene(path, {}).error().message, HasSubstr("wall.png"));
}

// A walk in an own world: as long as it fits, with the sweeps of a closed room.
TEST(Recording, WalksThroughAnOwnWorld) {
  const std::string path =
      WriteObj(std::filesystem::path(::testing::TempDir()) / "mlvi_scene_walk");
  auto world = std::make_shared<OwnWorld>();
  world->mesh = ImportScene(path, {}).value();
  SequenceOptions options = StandardSequence("courtyard-easy", test::Hilti(), 5.0);
  options.own_world = world;
  EXPECT_THAT(CheckOptions(options).error().message, HasSubstr("waypoints"));
  world->waypoints = {{-2.0, -1.0, 1.4}, {2.0, -1.0, 1.4}, {2.0, 1.0, 1.4}, {-2.0, 1.0, 1.4}};
  Recording recording(options);
  EXPECT_GT(recording.Clearance(), 1.0);
  const LidarSweep sweep =
      recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 0);
  std::size_t returns = 0;
  for (const LidarPoint& p : sweep.points) returns += !p.position.isZero(0.0F);
  EXPECT_GT(returns, 0.98 * static_cast<double>(sweep.points.size()));
}

}  // namespace
}  // namespace mlvi
