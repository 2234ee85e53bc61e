// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Real fisheye images beside real LiDAR scans with a published calibration: scans drawn into the
// images must lie on their edges, and must leave them when the calibration is turned by a degree.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "mlvi/panorama/panorama_model.h"
#include "mlvi/sensors/camera_model.h"
#include "mlvi/vio/depth_association.h"
#include "mlvi/vio/depth_picture.h"

namespace mlvi {
namespace {

const std::vector<int> kPoses = {1, 5, 10, 15, 20, 25, 30, 35};

std::string Folder() { return std::string(MLVI_SHARED_DATA_DIR) + "/fisheye_lidar_pairs"; }

struct ScanPoint {
  Eigen::Vector3d position;  // lidar frame, m
  int ring = 0;
};

// x y z intensity ring, ASCII PCD.
std::vector<ScanPoint> ReadScan(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line != "DATA ascii") {
  }
  std::vector<ScanPoint> points;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    ScanPoint point;
    double intensity = 0.0;
    words >> point.position.x() >> point.position.y() >> point.position.z() >> intensity >>
        point.ring;
    if (words && point.position.norm() > 0.5) points.push_back(point);
  }
  return points;
}

// roll, pitch, yaw, x, y, z of the camera in the lidar frame: R = Rz(yaw) Ry(pitch) Rx(roll).
Pose3 PoseFromRow(const std::vector<double>& row) {
  const Eigen::Quaterniond R = Eigen::AngleAxisd(row[2], Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(row[1], Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(row[0], Eigen::Vector3d::UnitX());
  return Pose3(R, {row[3], row[4], row[5]});
}

// All calibrations of the file.
std::vector<Pose3> ReadCalibrations() {
  std::ifstream file(Folder() + "/calibration_quickstart.csv");
  std::string line;
  std::getline(file, line);  // names
  std::vector<Pose3> poses;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row(6);
    for (double& value : row) words >> value;
    if (words) poses.push_back(PoseFromRow(row));
  }
  return poses;
}

Rig MakeRig(const Pose3& T_lidar_camera) {
  Rig rig;
  rig.name = "fisheye_lidar_pairs";
  CameraSpec camera;
  camera.name = "cam0";
  camera.model = *MakeCameraModel("equidistant", 1920, 1208, {1176.93, 1177.72, 962.275, 612.725},
                                  {-0.0540096, -0.0784275, 0.0959641, -0.0515253});
  camera.T_body_camera = T_lidar_camera;  // body: the lidar
  rig.cameras.push_back(camera);
  rig.p_body_pano = Eigen::Vector3d::Zero();  // S: the lidar, so that the camera has its offset
  return rig;
}

PanoramaModel MakeModel(const Pose3& T_lidar_camera) {
  auto model = PanoramaModel::FromRig(MakeRig(T_lidar_camera), {.radius = 5.0, .border_px = 8.0});
  EXPECT_TRUE(model.has_value());
  return *model;
}

// Points in front of a jump in depth along their ring: the near side of an occlusion edge.
std::vector<Eigen::Vector3d> DepthEdges(const std::vector<ScanPoint>& scan) {
  std::vector<std::vector<Eigen::Vector3d>> rings(64);
  for (const ScanPoint& point : scan)
    rings[static_cast<std::size_t>(point.ring)].push_back(point.position);
  std::vector<Eigen::Vector3d> edges;
  for (auto& ring : rings) {
    std::sort(ring.begin(), ring.end(), [](const auto& a, const auto& b) {
      return std::atan2(a.y(), a.x()) < std::atan2(b.y(), b.x());
    });
    for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
      const double here = ring[i].norm();
      const double jump = std::max(ring[i - 1].norm(), ring[i + 1].norm()) - here;
      if (jump > 0.3 + 0.1 * here) edges.push_back(ring[i]);
    }
  }
  return edges;
}

// How strong the picture's edges are at every pixel, spread over a few pixels and with bright
// contrasts held back.
cv::Mat1f EdgeStrength(const cv::Mat& grey) {
  cv::Mat1f dx, dy, strength;
  cv::Mat smooth;
  cv::GaussianBlur(grey, smooth, {0, 0}, 1.5);
  cv::Sobel(smooth, dx, CV_32F, 1, 0);
  cv::Sobel(smooth, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, strength);
  cv::min(strength, 100.0, strength);
  cv::GaussianBlur(strength, strength, {0, 0}, 3.0);
  return strength;
}

struct Frame {
  std::vector<ScanPoint> scan;
  std::vector<Eigen::Vector3d> edges;
  cv::Mat image;  // colour
  cv::Mat1f strength;
};

Frame ReadFrame(int pose) {
  Frame frame;
  frame.scan = ReadScan(Folder() + "/pose" + std::to_string(pose) + "_full.pcd");
  frame.edges = DepthEdges(frame.scan);
  frame.image = cv::imread(Folder() + "/pose" + std::to_string(pose) + ".png", cv::IMREAD_COLOR);
  cv::Mat grey;
  cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
  frame.strength = EdgeStrength(grey);
  return frame;
}

// Edge strength of the pictures at the scans' depth edges, over its mean: 1 by chance.
double AlignmentScore(const std::vector<Frame>& frames, const Pose3& T_lidar_camera) {
  const PanoramaModel model = MakeModel(T_lidar_camera);
  double at_edges = 0.0, anywhere = 0.0;
  int count = 0;
  for (const Frame& frame : frames) {
    const double mean = cv::mean(frame.strength)[0];
    for (const Eigen::Vector3d& edge : frame.edges) {
      const auto pixel = model.ProjectPoint(0, edge);
      if (!pixel) continue;
      at_edges += frame.strength(static_cast<int>(std::lround(pixel->y())),
                                 static_cast<int>(std::lround(pixel->x())));
      anywhere += mean;
      ++count;
    }
  }
  return count > 0 ? at_edges / anywhere : 0.0;
}

class FisheyeLidarPairs : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(Folder())) GTEST_SKIP() << Folder() << " is not on this machine";
    for (const int pose : kPoses) frames_.push_back(ReadFrame(pose));
    for (const Pose3& calibration : ReadCalibrations()) {
      const double score = AlignmentScore(frames_, calibration);
      if (score <= best_score_) continue;
      best_score_ = score;
      best_ = calibration;
    }
  }

  std::vector<Frame> frames_;
  Pose3 best_;
  double best_score_ = 0.0;
};

TEST_F(FisheyeLidarPairs, EdgesAlignAndLeaveWhenTheCalibrationIsTurned) {
  EXPECT_GT(best_score_, 2.2);
  for (int axis = 0; axis < 6; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vector6d delta = Vector6d::Zero();
      delta[axis] = sign * (axis < 3 ? 0.05 : std::numbers::pi / 180.0);
      const double score = AlignmentScore(frames_, BoxPlus(best_, delta));
      EXPECT_LT(score, 0.97 * best_score_) << "axis " << axis << ", sign " << sign;
    }
  }
}

// Depth by association against the point that was left out of the map: rays from the camera, 0.2 m
// off the LiDAR.
TEST_F(FisheyeLidarPairs, DepthIsThatOfThePointLeftOut) {
  DepthConfig config;
  config.max_neighbor_angle = 0.05;  // 16 rings, 2 degrees apart
  const PanoramaModel model = MakeModel(best_);
  const Eigen::Vector3d center = model.T_pano_camera(0).translation();
  std::vector<double> errors;
  int asked = 0;
  for (const Frame& frame : frames_) {
    PointCloud kept;
    std::vector<Eigen::Vector3d> left_out;
    for (std::size_t i = 0; i < frame.scan.size(); ++i) {
      const Eigen::Vector3d& point = frame.scan[i].position;
      if (i % 20 != 0) {
        kept.push_back(point.cast<float>());
      } else if (model.ProjectPoint(0, point)) {
        left_out.push_back(point);
      }
    }
    const SphericalDepthMap map(kept, Pose3(), config);
    for (const Eigen::Vector3d& point : left_out) {
      const double truth = (point - center).norm();
      if (truth > config.max_depth) continue;
      ++asked;
      const auto depth = AssociateDepth(map, {center, (point - center).normalized()}, config);
      if (depth.status == DepthStatus::kFound)
        errors.push_back(std::abs(depth.depth - truth) / truth);
    }
  }
  ASSERT_GT(asked, 1000);
  ASSERT_GT(static_cast<double>(errors.size()), 0.5 * asked);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.005);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.02);
}

void Draw(const Frame& frame, const PanoramaModel& model, const std::string& path) {
  std::vector<Eigen::Vector3d> points;
  for (const ScanPoint& point : frame.scan) points.push_back(point.position);
  const DepthPicture picture = DrawDepthPictures(model, points).at(0);
  cv::Mat drawn = frame.image.clone();
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (picture.At(x, y) == 0.0F) continue;
      const auto hue = static_cast<unsigned char>(
          std::clamp(120.0 * std::log2(picture.At(x, y)) / 4.5, 0.0, 170.0));
      cv::Mat3b color(1, 1, cv::Vec3b(hue, 255, 255));
      cv::cvtColor(color, color, cv::COLOR_HSV2BGR);
      cv::circle(drawn, {x, y}, 2, color(0, 0), cv::FILLED);
    }
  }
  cv::imwrite(path, drawn);
}

// The pictures themselves, for the eye.
TEST_F(FisheyeLidarPairs, DepthPictures) {
  const char* folder = std::getenv("MLVI_PICTURES");
  if (folder == nullptr) GTEST_SKIP() << "set MLVI_PICTURES to a folder to see the pictures";
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    Draw(frames_[i], MakeModel(best_),
         std::string(folder) + "/pose" + std::to_string(kPoses[i]) + ".png");
  }
}

}  // namespace
}  // namespace mlvi
