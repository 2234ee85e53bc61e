// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// `mlvi run` with cameras, as its users meet it: one recording with two small cameras, played whole
// and with faults.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "mlvi/eval/evaluation.h"
#include "mlvi/io/bag_writer.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/tum.h"
#include "mlvi/sensors/camera_model.h"
#include "mlvi/sim/recording.h"
#include "run_mlvi.h"
#include "summary_keys.h"
#include "temporary_folder.h"

namespace mlvi {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kSeconds = 7.0;  // 2 of them at rest
constexpr double kImageRate = 10.0;

// The M2DGR rig with two of its lenses at a quarter of their resolution.
Rig SmallRig() {
  Rig rig = *LoadRig("m2dgr");
  rig.cameras.resize(2);
  rig.cameras[0].name = "left";
  rig.cameras[1].name = "right";
  for (CameraSpec& camera : rig.cameras) {
    camera.topic = "/" + camera.name;  // raw images: a JPEG of this size shows its blocks
    camera.model = *MakeCameraModel("equidistant", 320, 256, {135, 135, 157, 127},
                                    {-0.07, 0.0086, -0.022, 0.0074});
    camera.valid_radius_px = 0.0;
    camera.rate_hz = kImageRate;
  }
  return rig;
}

SequenceOptions Options() {
  SequenceOptions options = StandardSequence("courtyard-easy", SmallRig(), kSeconds, 5);
  options.rig = MakeSimulatedRig(SmallRig(), false, 5);  // exact mounts
  options.cameras = {"left", "right"};
  options.image_rate = kImageRate;
  return options;
}

// One recording for all tests of the program: tracing it takes seconds.
struct Played {
  Rig rig;
  std::vector<Measurement> measurements;
  Trajectory truth;  // 100 Hz
};

const Played& Original() {
  static const Played played = [] {
    Recording recording(Options());
    Played result{.rig = recording.rig()};
    for (auto next = recording.Next(); next && *next; next = recording.Next()) {
      result.measurements.push_back(std::move(**next));
    }
    for (Time t = recording.begin(); t < recording.end(); t = t + Duration::FromMilliseconds(10)) {
      result.truth.push_back({t, recording.GroundTruth(t).T_world_body});
    }
    return result;
  }();
  return played;
}

class VisualRun : public ::testing::Test {
 protected:
  // Writes the recording; `change` sees each image with its time since the beginning (s), may alter
  // it, and tells whether it is kept; of those that `is_cut_off` the messages hold half of the data.
  using Choice = std::function<bool(Image&, double)>;
  void Write(
      const Choice& change = [](Image&, double) { return true; },
      const Choice& is_cut_off = [](Image&, double) { return false; }) {
    auto writer = BagWriter::Create(Path("recording.bag"), Original().rig);
    ASSERT_TRUE(writer) << writer.error().message;
    for (Measurement measurement : Original().measurements) {
      auto* image = std::get_if<Image>(&measurement);
      const double seconds =
          image != nullptr ? (image->stamp - Options().begin).seconds() : std::nan("");
      if (image != nullptr && !change(*image, seconds)) continue;
      const bool cut_off = image != nullptr && is_cut_off(*image, seconds);
      ASSERT_TRUE(cut_off ? (*writer)->WriteCutOff(measurement) : (*writer)->Write(measurement));
    }
    ASSERT_TRUE((*writer)->Close());
    ASSERT_TRUE(SaveRig(Original().rig, Path("rig.yaml")));
  }

  // Half a second without images.
  void WriteWithoutImages() {
    SequenceOptions options = Options();
    options.cameras.clear();
    options.seconds = 0.5;
    Recording recording(options);
    auto writer = BagWriter::Create(Path("recording.bag"), recording.rig());
    ASSERT_TRUE(writer) << writer.error().message;
    for (auto next = recording.Next(); next && *next; next = recording.Next()) {
      ASSERT_TRUE((*writer)->Write(**next));
    }
    ASSERT_TRUE((*writer)->Close());
    ASSERT_TRUE(SaveRig(recording.rig(), Path("rig.yaml")));
  }

  int Run(const std::string& arguments) {
    const test::ProcessResult result =
        test::RunMlvi("run " + Path("recording.bag") + " --rig " + Path("rig.yaml") + " -o " +
                      Path("result") + " " + arguments);
    output_ = result.output;
    summary_ = nlohmann::json::parse(Read("summary.json"), nullptr, false);
    return result.exit_code;
  }

  // Of the left camera only so many columns are visible.
  void UseMask(int columns) {
    Rig rig = Original().rig;
    rig.cameras[0].mask_file = Path("left.pgm");
    std::string pgm = "P5\n320 256\n255\n";
    for (int i = 0; i < 320 * 256; ++i) pgm += i % 320 < columns ? '\xff' : '\0';
    std::ofstream(Path("left.pgm"), std::ios::binary) << pgm;
    ASSERT_TRUE(SaveRig(rig, Path("rig.yaml")));
  }

  void ExpectCamerasAloneToDo();
  void ExpectFaultsToBeReportedAndSurvived();
  void ExpectUnreadableImagesToBeCountedAndSurvived();
  void ExpectAWrongMountToBeFoundAndNamed();
  void ExpectNoChangeOfTheLidarsEstimate();
  void ExpectANearlyBlackMaskToBeNamed();
  void ExpectDepthToBeDrawn();

  std::string Path(const std::string& name) const { return (temporary_.path() / name).string(); }
  std::string Read(const std::string& name) const {
    std::ifstream file(temporary_.path() / "result" / name, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  // se3-aligned rmse of a trajectory of at least `poses` poses, m.
  double Ate(const std::string& name, std::size_t poses) const {
    const auto estimate = ReadTum(Path("result/" + name));
    if (!estimate || estimate->size() < poses) return 1e9;
    const auto evaluation = Evaluate(*estimate, Original().truth, {});
    return evaluation ? evaluation->absolute_translation.rmse : 1e9;
  }

  test::TemporaryFolder temporary_{"visual_run"};
  std::string output_;
  nlohmann::json summary_;
};

void VisualRun::ExpectCamerasAloneToDo() {
  Write();
  ASSERT_EQ(Run("--no-lidar --cameras all --threads 1"), 0) << output_;
  EXPECT_EQ(summary_["status"], "ok") << summary_["reason"];
  // 5 % of 5 m: pixels of 0.4 degrees, and the scale comes from five seconds of a calm walk.
  EXPECT_LT(Ate("odometry.tum", 40), 0.25);
  EXPECT_LT(Ate("trajectory.tum", 40), 0.25);
  EXPECT_GT(summary_["keyframes"].get<double>(), 3.0);
  EXPECT_EQ(summary_["visual"]["failures"], 0);
  EXPECT_THAT(test::UndocumentedKeys(summary_), ::testing::IsEmpty());
  EXPECT_THAT(test::UnwrittenKeys(summary_, "visual"), ::testing::IsEmpty());
  EXPECT_THAT(test::UnwrittenKeys(summary_, "calibration.cameras"), ::testing::IsEmpty());
  EXPECT_GT(summary_["stages_ms"]["image_set"]["count"].get<int>(), 60);
  const std::string odometry = Read("odometry.tum"), trajectory = Read("trajectory.tum");
  ASSERT_EQ(Run("--no-lidar --cameras all --threads 2"), 0) << output_;
  EXPECT_TRUE(odometry == Read("odometry.tum"));
  EXPECT_TRUE(trajectory == Read("trajectory.tum"));
  // One camera is enough.
  ASSERT_EQ(Run("--no-lidar --cameras left"), 0) << output_;
  EXPECT_LT(Ate("trajectory.tum", 40), 0.4);
  EXPECT_FALSE(summary_["streams"].contains("right"));
}

void VisualRun::ExpectFaultsToBeReportedAndSurvived() {
  Write([](Image& image, double t) { return image.camera != 1 || t < 3.5; });
  ASSERT_EQ(Run("--no-lidar --cameras all"), 0) << output_;
  EXPECT_EQ(summary_["status"], "degraded");
  EXPECT_EQ(summary_["streams"]["right"]["health"], "failed");
  EXPECT_EQ(summary_["streams"]["left"]["health"], "healthy");
  EXPECT_THAT(output_, HasSubstr("silent"));
  EXPECT_LT(Ate("trajectory.tum", 40), 0.4);

  Write([](Image&, double t) { return t < 3.5 || t > 5.5; });
  ASSERT_EQ(Run("--no-lidar --cameras all"), 0) << output_;
  EXPECT_EQ(summary_["status"], "degraded");
  EXPECT_EQ(summary_["streams"]["left"]["gaps"], 1);
  EXPECT_LT(Ate("trajectory.tum", 25), 0.5);

  Image frozen;
  Write([&](Image& image, double t) {
    if (image.camera != 1 || t < 3.5) return true;
    if (frozen.pixels.empty()) frozen = image;
    image.pixels = frozen.pixels;
    return true;
  });
  ASSERT_EQ(Run("--no-lidar --cameras all"), 0) << output_;
  EXPECT_THAT(summary_["streams"]["right"]["reason"].get<std::string>(), HasSubstr("frozen in"));
  EXPECT_LT(Ate("trajectory.tum", 40), 0.4);
}

void VisualRun::ExpectUnreadableImagesToBeCountedAndSurvived() {
  int cut_off = 0;
  Write([](Image&, double) { return true; },
        [&](Image& image, double t) {
          const bool is = image.camera == 1 && t > 3.45 && t < 4.45;
          cut_off += is;
          return is;
        });
  EXPECT_EQ(cut_off, 10);
  ASSERT_EQ(Run("--no-lidar --cameras all"), 0) << output_;
  EXPECT_EQ(summary_["streams"]["right"]["dropped"]["unreadable message"], cut_off);
  EXPECT_FALSE(summary_["streams"]["left"]["dropped"].contains("unreadable message"));
  EXPECT_THAT(output_,
              HasSubstr("right: of 70 messages these were dropped: 'unreadable message' 10"));
  EXPECT_THAT(output_, HasSubstr("image of 320 x 256 pixels with step 320 does not fit its 40960 "
                                 "bytes of data"));
  EXPECT_NE(summary_["streams"]["right"]["health"], "healthy");
  EXPECT_LT(Ate("trajectory.tum", 40), 0.4);
}

void VisualRun::ExpectAWrongMountToBeFoundAndNamed() {
  Write();
  Rig wrong = Original().rig;
  Pose3& T_body_camera = wrong.cameras[1].T_body_camera;
  const Eigen::Vector3d turn(0.0, 3.0 * std::numbers::pi / 180.0, 0.0);
  T_body_camera = T_body_camera * Pose3(ExpSo3(turn), Eigen::Vector3d::Zero());
  ASSERT_TRUE(SaveRig(wrong, Path("rig.yaml")));
  ASSERT_EQ(Run("--no-lidar --cameras all"), 0) << output_;
  EXPECT_EQ(summary_["status"], "degraded");
  // Which of two cameras is wrong is not told by five seconds; how they are turned to each other is.
  EXPECT_THAT(output_, HasSubstr("does not fit the rig file: turned by"));
  const auto R_left_right = [](const Rig& rig) {
    return rig.cameras[0].T_body_camera.rotation().conjugate() *
           rig.cameras[1].T_body_camera.rotation();
  };
  const auto calibrated = LoadRig(Path("result/calibrated_rig.yaml"));
  ASSERT_TRUE(calibrated.has_value()) << calibrated.error().message;
  EXPECT_LT(R_left_right(Original().rig).angularDistance(R_left_right(*calibrated)),
            0.5 * std::numbers::pi / 180.0);
  EXPECT_LT(Ate("trajectory.tum", 40), 0.25);
}

void VisualRun::ExpectNoChangeOfTheLidarsEstimate() {
  Write();
  ASSERT_EQ(Run(""), 0) << output_;
  EXPECT_TRUE(summary_["visual"].is_null());
  const std::string odometry = Read("odometry.tum"), trajectory = Read("trajectory.tum");
  ASSERT_EQ(Run("--cameras all"), 0) << output_;
  EXPECT_TRUE(odometry == Read("odometry.tum"));
  EXPECT_TRUE(trajectory == Read("trajectory.tum"));
  EXPECT_GT(summary_["visual"]["image_sets_tracking"].get<int>(), 40);
}

void VisualRun::ExpectANearlyBlackMaskToBeNamed() {
  Write([](Image&, double t) { return t < 0.5; });
  UseMask(2);
  ASSERT_EQ(Run("--cameras all"), 0) << output_;
  EXPECT_THAT(output_, HasSubstr("left: mask and valid radius leave 0.62 % of its images visible"));
  UseMask(320);
  ASSERT_EQ(Run("--cameras all"), 0) << output_;
  EXPECT_THAT(output_, ::testing::Not(HasSubstr("images visible")));
}

// Pictures of both cameras every two of seven seconds, but for the first, before the odometry's
// start. They are the images with points drawn in, of the colour of their distance.
void VisualRun::ExpectDepthToBeDrawn() {
  Write();
  ASSERT_EQ(Run("--cameras all --depth-pictures 2"), 0) << output_;
  std::map<std::string, int> pictures;
  for (const auto& entry : fs::directory_iterator(Path("result/depth_pictures"))) {
    const std::string name = entry.path().filename().string();
    ++pictures[name.substr(0, name.find('_'))];
    EXPECT_EQ(entry.path().extension(), ".png");
    const cv::Mat picture = cv::imread(entry.path().string(), cv::IMREAD_COLOR);
    ASSERT_EQ(picture.size(), cv::Size(320, 256)) << name;
    int drawn = 0;
    for (const cv::Vec3b& p : cv::Mat_<cv::Vec3b>(picture)) drawn += p[0] != p[1] || p[1] != p[2];
    EXPECT_GT(drawn, 0.02 * 320 * 256) << name;
    EXPECT_LT(drawn, 0.98 * 320 * 256) << name;
  }
  EXPECT_THAT(pictures,
              ::testing::ElementsAre(
                  ::testing::Pair("left", ::testing::AllOf(::testing::Ge(3), ::testing::Le(4))),
                  ::testing::Pair("right", ::testing::AllOf(::testing::Ge(3), ::testing::Le(4)))));
  EXPECT_EQ(Run("--cameras all --no-lidar --depth-pictures 2"), 1);
  EXPECT_THAT(output_, HasSubstr("--depth-pictures draws what the LiDAR sees over images"));
}

// ctest runs every case in a process of its own, and tracing the recording is what takes the time:
// one case.
TEST_F(VisualRun, AloneWithFaultsAndBesideALidar) {
  ExpectCamerasAloneToDo();
  ExpectFaultsToBeReportedAndSurvived();
  ExpectUnreadableImagesToBeCountedAndSurvived();
  ExpectAWrongMountToBeFoundAndNamed();
  ExpectNoChangeOfTheLidarsEstimate();
  ExpectANearlyBlackMaskToBeNamed();
  ExpectDepthToBeDrawn();
}

TEST_F(VisualRun, ChoicesOfSensorsThatCannotBeAreErrorsThatSayWhy) {
  WriteWithoutImages();
  EXPECT_EQ(Run("--cameras lefft"), 1);
  EXPECT_THAT(output_,
              HasSubstr("has no camera 'lefft', it has left, right; did you mean 'left'?"));
  EXPECT_EQ(Run("--cameras left,left"), 1);
  EXPECT_THAT(output_, HasSubstr("'left' is given twice"));
  EXPECT_EQ(Run("--no-lidar"), 1);
  EXPECT_THAT(output_, HasSubstr("leaves nothing to see with"));
  EXPECT_EQ(Run("--cameras left"), 2);
  EXPECT_THAT(output_, HasSubstr("camera topic '/left'"));
  EXPECT_EQ(Run("--cameras all --no-lidar"), 2);
  EXPECT_THAT(output_, HasSubstr("none of the topics of rig"));
  Run("--cameras all");  // beside the LiDAR they are left out, and nobody misses them
  EXPECT_THAT(output_,
              HasSubstr("left: topic '/left' is not in the recording; the camera is not used"));
  EXPECT_FALSE(summary_["streams"].contains("left"));
  EXPECT_EQ(Run("--cameras all --set vio.tracker.refinement.patch.size_px=12"), 1);
  EXPECT_THAT(output_, HasSubstr("patch.size_px = 12: must be odd"));
  EXPECT_EQ(Run("--cameras all --compensation sphere"), 1);
  EXPECT_THAT(output_, HasSubstr("sphere"));
}

TEST_F(VisualRun, AMaskThatLeavesNothingIsRefused) {
  WriteWithoutImages();
  UseMask(0);
  EXPECT_EQ(Run("--cameras all"), 1);
  EXPECT_THAT(output_, HasSubstr("the mask of left leaves nothing visible: 0 of its 320 x 256 px"));
}

}  // namespace
}  // namespace mlvi
