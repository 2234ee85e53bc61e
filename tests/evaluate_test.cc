// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Evaluation to the digit: the results that evo (github.com/MichaelGrupp/evo) stored with its test
// data, figures that its version 1.38.1 gives for the other pairs of that data, and the command
// line around them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "mlvi/base/random.h"
#include "mlvi/eval/evaluation.h"
#include "mlvi/io/text_table.h"
#include "mlvi/io/tum.h"
#include "run_mlvi.h"
#include "temporary_folder.h"

namespace mlvi {
namespace {

using nlohmann::json;
constexpr double kDegrees = 180.0 / std::numbers::pi;
const std::string kFolder = std::string(MLVI_SHARED_DATA_DIR) + "/evo/";

std::string ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::uint32_t Little(const std::string& bytes, std::size_t at, int size) {
  std::uint32_t value = 0;
  for (int i = size; i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes.at(at + static_cast<std::size_t>(i)));
  return value;
}

// A member of a zip archive whose members are stored, not compressed.
std::string ZipMember(const std::string& archive, const std::string& name) {
  for (std::size_t at = 0; at + 30 < archive.size() && archive.compare(at, 4, "PK\3\4") == 0;) {
    MLVI_CHECK(Little(archive, at + 8, 2) == 0, "a member of the archive is compressed");
    const std::size_t size = Little(archive, at + 18, 4), name_size = Little(archive, at + 26, 2);
    const std::size_t data = at + 30 + name_size + Little(archive, at + 28, 2);
    if (archive.substr(at + 30, name_size) == name) return archive.substr(data, size);
    at = data + size;
  }
  throw std::out_of_range(name);
}

// The doubles of a one-dimensional NumPy array, version 1.0.
std::vector<double> NumpyArray(const std::string& bytes) {
  const std::size_t header = 10 + Little(bytes, 8, 2);
  std::vector<double> values((bytes.size() - header) / sizeof(double));
  std::memcpy(values.data(), bytes.data() + header, values.size() * sizeof(double));
  return values;
}

PoseMatrices ReadKitti(const std::string& path) {
  PoseMatrices poses;
  for (const TableLine& line : SplitTable(ReadFile(path))) {
    const std::vector<double> v = Numbers(line, 0, 12, path).value();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v.data());
    poses.push_back(pose);
  }
  return poses;
}

Trajectory ReadEuroc(const std::string& path) {
  Trajectory trajectory;
  for (const TableLine& line : SplitTable(ReadFile(path))) {
    const std::vector<double> v = Numbers(line, 1, 7, path).value();
    trajectory.push_back(
        {.stamp = Time::FromNanoseconds(std::stoll(line.words[0])),
         .pose = Pose3(Eigen::Quaterniond(v[3], v[4], v[5], v[6]), {v[0], v[1], v[2]})});
  }
  return trajectory;
}

void ExpectRelative(double value, double expected, double tolerance, const std::string& what) {
  EXPECT_LE(std::abs(value - expected), tolerance * std::abs(expected))
      << what << ": " << value << " vs " << expected;
}

// All statistics and every single error, as stored.
void ExpectStored(const std::string& archive, const ErrorStatistics& statistics,
                  const std::vector<double>& errors) {
  const std::string bytes = ReadFile(kFolder + "expected/" + archive);
  const json stored = json::parse(ZipMember(bytes, "stats.json"));
  ASSERT_EQ(stored.size(), 7U);
  const std::map<std::string, double> found = {
      {"rmse", statistics.rmse}, {"mean", statistics.mean}, {"median", statistics.median},
      {"std", statistics.std},   {"min", statistics.min},   {"max", statistics.max},
      {"sse", statistics.sse}};
  for (const auto& [name, value] : stored.items())
    ExpectRelative(found.at(name), value, 1e-9, archive + " " + name);
  const std::vector<double> array = NumpyArray(ZipMember(bytes, "error_array.npz"));
  ASSERT_EQ(errors.size(), array.size());
  for (std::size_t i = 0; i < array.size(); ++i)
    ExpectRelative(errors[i], array[i], 1e-9, fmt::format("error {}", i));
}

class EvoData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kFolder + "KITTI_00_gt.txt")) GTEST_SKIP() << "no " << kFolder;
  }
};

TEST_F(EvoData, ReproducesTheStoredResultsOfKitti00) {
  EvaluationOptions options;
  options.relative = {.delta = 10.0, .unit = DeltaUnit::kMetres, .skip_first = true};
  const auto result = Evaluate(ReadKitti(kFolder + "KITTI_00_ORB.txt"),
                               ReadKitti(kFolder + "KITTI_00_gt.txt"), options)
                          .value();
  ASSERT_EQ(result.matched, 4541U);
  ExpectStored("orb_ape.zip", result.absolute_translation, result.absolute_errors.translation);
  ExpectStored("orb_rpe.zip", result.relative_translation.value(),
               result.relative_errors.translation);
  // The same as text, so that the figures stand in view.
  EXPECT_NEAR(result.absolute_translation.rmse, 1.3034497145650266, 1e-12);
  EXPECT_NEAR(result.relative_translation->rmse, 0.22626134329310163, 1e-12);
}

// One run of evo 1.38.1: evo_ape / evo_rpe on associated poses (nearest stamp within 0.01 s).
struct OracleRow {
  std::string data;
  AlignmentKind alignment;
  RelativeErrorOptions relative;
  std::size_t matched;
  double ape_translation, ape_rotation_deg;  // rmse
  std::size_t pairs;
  double rpe_translation, rpe_rotation_deg;
};

constexpr RelativeErrorOptions Consecutive(double delta, DeltaUnit unit) {
  return {.delta = delta, .unit = unit};
}
constexpr RelativeErrorOptions All(double delta, DeltaUnit unit) {
  return {.delta = delta, .unit = unit, .all_pairs = true};
}
constexpr RelativeErrorOptions AlongTruth(double delta) {
  return {.delta = delta, .pairs_from_truth = true};
}

std::vector<OracleRow> OracleRows() {
  constexpr AlignmentKind kSe3 = AlignmentKind::kSe3, kSim3 = AlignmentKind::kSim3,
                          kNone = AlignmentKind::kNone;
  constexpr DeltaUnit kM = DeltaUnit::kMetres, kF = DeltaUnit::kFrames, kR = DeltaUnit::kRadians;
  const double ten = 10.0 / kDegrees;
  return {
      {"V102", kSe3, Consecutive(1, kF), 798, 0.09172711520685733, 2.71677136027806, 797,
       0.015076710159641309, 0.35761559488592853},
      {"V102", kSe3, All(5, kF), 798, 0.09172711520685733, 2.71677136027806, 793,
       0.03623388607126947, 0.7656122065057072},
      {"V102", kSe3, Consecutive(0.5, kM), 798, 0.09172711520685733, 2.71677136027806, 138,
       0.040346473307590267, 0.990689481951647},
      {"V102", kSe3, All(0.5, kM), 798, 0.09172711520685733, 2.71677136027806, 671,
       0.03736459499474491, 1.0978176884264252},
      {"V102", kSe3, AlongTruth(0.5), 798, 0.09172711520685733, 2.71677136027806, 135,
       0.036312089103389594, 0.9798558924095916},
      {"V102", kSe3, Consecutive(ten, kR), 798, 0.09172711520685733, 2.71677136027806, 220,
       0.027283219606314062, 0.7015114451376615},
      {"V102", kSe3, All(ten, kR), 798, 0.09172711520685733, 2.71677136027806, 5149,
       0.13557189053658358, 4.092080210185462},
      {"V102", kSim3, Consecutive(0.5, kM), 798, 0.08384138804295284, 2.71677136027806, 136,
       0.03961017407024456, 1.0194204351633984},
      {"V102", kNone, Consecutive(0.5, kM), 798, 2.5541740462181335, 27.815578896381005, 138,
       0.04034647330759034, 0.9906894819516472},
      {"fr1_xyz", kSe3, Consecutive(1, kF), 785, 0.013470088849733695, 2.057699602015454, 784,
       0.005764370848928318, 0.3536131610447985},
      {"fr1_xyz", kSe3, All(5, kF), 785, 0.013470088849733695, 2.057699602015454, 780,
       0.011195153862283754, 0.5695175379943073},
      {"fr1_xyz", kSe3, All(0.5, kM), 785, 0.013470088849733695, 2.057699602015454, 697,
       0.024810984195724764, 1.0482761128747007},
      {"fr1_xyz", kSim3, AlongTruth(0.5), 785, 0.013389384904168217, 2.057699602015454, 15,
       0.033554658523907314, 1.5729548582993038},
      {"fr1_xyz", kSe3, Consecutive(ten, kR), 785, 0.013470088849733695, 2.057699602015454, 44,
       0.017900039411121588, 0.7574407438874025},
      // With stamps as integers: in double precision evo breaks one exact tie the other way.
      {"fr2_desk", kSe3, Consecutive(0.5, kM), 2174, 0.008118925607062889, 0.9890400316766846, 36,
       0.009616655960823927, 0.5574720721534395},
      {"fr2_desk", kSim3, Consecutive(0.5, kM), 2174, 0.00612316075967703, 0.9890400316766846, 36,
       0.009446119004201815, 0.607134710706089},
      {"fr2_desk", kNone, Consecutive(0.5, kM), 2174, 3.1739938084398425, 132.47858088969306, 36,
       0.009616655960823981, 0.5574720721534395},
  };
}

std::pair<Trajectory, Trajectory> ReadPair(const std::string& data) {
  if (data == "V102")
    return {ReadTum(kFolder + "V102.txt").value(), ReadEuroc(kFolder + "V102_groundtruth.csv")};
  if (data == "fr1_xyz") {
    return {ReadTum(kFolder + "freiburg1_xyz-rgbdslam.txt").value(),
            ReadTum(kFolder + "freiburg1_xyz-groundtruth.txt").value()};
  }
  return {ReadTum(kFolder + "fr2_desk_ORB.txt").value(),
          ReadTum(kFolder + "fr2_desk_groundtruth.txt").value()};
}

TEST_F(EvoData, AgreesWithEvoOnStampedTrajectories) {
  std::map<std::string, std::pair<Trajectory, Trajectory>> pairs;
  for (const std::string data : {"V102", "fr1_xyz", "fr2_desk"}) pairs[data] = ReadPair(data);
  for (const OracleRow& row : OracleRows()) {
    const auto& [estimate, truth] = pairs.at(row.data);
    EvaluationOptions options;
    options.association.kind = AssociationKind::kNearest;
    options.alignment = row.alignment;
    options.relative = row.relative;
    const Evaluation result = Evaluate(estimate, truth, options).value();
    const std::string what = fmt::format(
        "{} alignment {} delta {} unit {} all {}", row.data, static_cast<int>(row.alignment),
        row.relative.delta, static_cast<int>(row.relative.unit), row.relative.all_pairs);
    ASSERT_EQ(result.matched, row.matched) << what;
    ASSERT_EQ(result.relative_pairs.size(), row.pairs) << what;
    // Files give six to nine digits of the rotation; what normalising them by other means may
    // differ by.
    constexpr double kTolerance = 1e-6;
    ExpectRelative(result.absolute_translation.rmse, row.ape_translation, kTolerance, what);
    ExpectRelative(kDegrees * result.absolute_rotation->rmse, row.ape_rotation_deg, kTolerance,
                   what);
    ExpectRelative(result.relative_translation->rmse, row.rpe_translation, kTolerance, what);
    ExpectRelative(kDegrees * result.relative_rotation->rmse, row.rpe_rotation_deg, kTolerance,
                   what);
  }
}

// Interpolation takes the errors of time out: never worse than the nearest pose by more than what
// sampling noise makes.
TEST_F(EvoData, InterpolationAgreesWithNearestUpToTheMotionBetweenStamps) {
  for (const std::string data : {"V102", "fr1_xyz", "fr2_desk"}) {
    const auto [estimate, truth] = ReadPair(data);
    EvaluationOptions options;
    const Evaluation interpolated = Evaluate(estimate, truth, options).value();
    options.association.kind = AssociationKind::kNearest;
    const Evaluation nearest = Evaluate(estimate, truth, options).value();
    EXPECT_NEAR(interpolated.absolute_translation.rmse, nearest.absolute_translation.rmse,
                0.05 * nearest.absolute_translation.rmse)
        << data;
  }
}

#ifdef MLVI_BINARY
using Outcome = test::ProcessResult;

Outcome RunEvaluate(const std::string& arguments) { return test::RunMlvi("evaluate " + arguments); }

class EvaluateCommand : public ::testing::Test {
 protected:
  // A helix at 10 Hz, started at `start` s, with errors of `noise` m.
  std::string Write(const std::string& name, double start, double noise) const {
    RandomStream random(1, name);
    Trajectory trajectory;
    for (int i = 0; i < 300; ++i) {
      const double t = 0.1 * i;
      const Eigen::Vector3d p(5.0 * std::cos(0.3 * t), 5.0 * std::sin(0.3 * t), 0.1 * t);
      const Eigen::Vector3d e(random.Normal(), random.Normal(), random.Normal());
      trajectory.push_back({.stamp = Time::FromSeconds(start + t),
                            .pose = Pose3(ExpSo3({0.0, 0.0, 0.3 * t}), p + noise * e)});
    }
    const std::string path = (folder_.path() / name).string();
    EXPECT_TRUE(WriteTum(trajectory, path));
    return path;
  }
  test::TemporaryFolder folder_{"evaluate"};
};

TEST_F(EvaluateCommand, PrintsTheErrorsAsJson) {
  const Outcome outcome =
      RunEvaluate(Write("a", 100.0, 0.1) + " " + Write("b", 100.0, 0.0) + " --json --align none");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const json result = json::parse(outcome.output);
  EXPECT_EQ(result["association"]["matched_poses"], 300);
  EXPECT_EQ(result["association"]["first_stamp"], "100.000000000");
  // 0.1 m per axis: sqrt(3) 0.1 m, known to 1 / sqrt(2 * 900); four sigma.
  EXPECT_NEAR(result["ape"]["translation_m"]["rmse"].get<double>(), std::sqrt(3.0) * 0.1,
              0.1732 * 4.0 / std::sqrt(1800.0));
  EXPECT_LT(result["ape"]["rotation_deg"]["max"].get<double>(), 1e-4);
  EXPECT_EQ(result["coverage"]["share"], 1.0);
  EXPECT_EQ(result["drift"].size(), 5U);
}

TEST_F(EvaluateCommand, TableNamesWhatItCompared) {
  const Outcome outcome = RunEvaluate(Write("a", 100.0, 0.01) + " " + Write("b", 100.02, 0.0));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  for (const char* text : {"APE trans [m]", "RPE rot [deg]", "coverage", "drift over",
                           "matched 299 of 300", "from 100.1", "frame of the truth"}) {
    EXPECT_THAT(outcome.output, ::testing::HasSubstr(text));
  }
}

TEST_F(EvaluateCommand, RefusesToCompareNothing) {
  const std::string a = Write("a", 100.0, 0.1);
  const Outcome apart = RunEvaluate(a + " " + Write("b", 5000.0, 0.0));
  EXPECT_EQ(apart.exit_code, 2);
  for (const char* text :
       {"no overlap in time", "[100.000000000, 129.900000000]", "[5000.000000000", "clock"}) {
    EXPECT_THAT(apart.output, ::testing::HasSubstr(text));
  }
  const Outcome unmatched =
      RunEvaluate(a + " " + Write("c", 100.05, 0.0) + " --association nearest");
  EXPECT_EQ(unmatched.exit_code, 2);
  EXPECT_THAT(unmatched.output, ::testing::HasSubstr("none of 300 poses"));
  EXPECT_EQ(RunEvaluate(a + " " + (folder_.path() / "missing").string()).exit_code, 2);
  EXPECT_EQ(RunEvaluate(a).exit_code, 1);
  EXPECT_EQ(RunEvaluate(a + " " + a + " --align se4").exit_code, 1);
  EXPECT_EQ(RunEvaluate(a + " " + a + " --rpe-unit frames --rpe-delta 1.5").exit_code, 1);
}

TEST_F(EvaluateCommand, ATimeOffsetBringsClocksTogether) {
  const Outcome outcome = RunEvaluate(Write("a", 100.0, 0.0) + " " + Write("b", 5000.0, 0.0) +
                                      " --time-offset 4900 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_LT(json::parse(outcome.output)["ape"]["translation_m"]["max"].get<double>(), 1e-5);
}

TEST_F(EvoData, CommandReadsKittiAndEurocFiles) {
  const Outcome kitti = RunEvaluate(kFolder + "KITTI_00_ORB.txt " + kFolder +
                                    "KITTI_00_gt.txt --json --rpe-delta 10 --rpe-skip-first");
  ASSERT_EQ(kitti.exit_code, 0) << kitti.output;
  ExpectRelative(json::parse(kitti.output)["ape"]["translation_m"]["rmse"], 1.3034497145650266,
                 1e-9, "KITTI");
  ExpectRelative(json::parse(kitti.output)["rpe"]["translation_m"]["rmse"], 0.22626134329310163,
                 1e-9, "KITTI");
  const Outcome euroc = RunEvaluate(kFolder + "V102.txt " + kFolder +
                                    "V102_groundtruth.csv --json --association nearest");
  ASSERT_EQ(euroc.exit_code, 0) << euroc.output;
  ExpectRelative(json::parse(euroc.output)["ape"]["translation_m"]["rmse"], 0.09172711520685733,
                 1e-6, "EuRoC");
  EXPECT_EQ(RunEvaluate(kFolder + "V102.txt " + kFolder + "KITTI_00_gt.txt").exit_code, 2);
}
#endif

}  // namespace
}  // namespace mlvi
