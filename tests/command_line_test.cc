// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What all subcommands share: names, options that take numbers, files that are folders, outputs
// that cannot be written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "run_mlvi.h"
#include "temporary_folder.h"

#ifdef MLVI_BINARY

namespace mlvi {
namespace {

using test::ProcessResult;
using test::RunMlvi;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class CommandLine : public ::testing::Test {
 protected:
  CommandLine() {
    std::ofstream file(Path("walk.tum"));
    for (int i = 0; i < 100; ++i)
      file << 100 + 0.1 * i << ' ' << std::cos(0.1 * i) << ' ' << std::sin(0.1 * i) << ' '
           << 0.1 * i << " 0 0 0 1\n";
  }
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }
  // One simulated sweep, into the folder "out".
  ProcessResult Simulate(const std::string& arguments) const {
    return RunMlvi("simulate courtyard-easy --cameras none --seconds 0.1 -o " + Path("out") + " " +
                   arguments);
  }
  ProcessResult Evaluate(const std::string& arguments) const {
    return RunMlvi("evaluate " + Path("walk.tum") + " " + Path("walk.tum") + " " + arguments);
  }

  test::TemporaryFolder folder_{"command_line"};
};

void ExpectUsageError(const ProcessResult& result, const std::string& text) {
  EXPECT_EQ(result.exit_code, 1) << text << ": " << result.output;
  EXPECT_THAT(result.output, AllOf(HasSubstr(text), Not(HasSubstr("internal error"))));
}

TEST_F(CommandLine, UnknownSubcommandsAreNamed) {
  ExpectUsageError(RunMlvi("rub"), "no subcommand is called 'rub'");
  EXPECT_THAT(RunMlvi("rub").output, HasSubstr("did you mean 'run'?"));
  EXPECT_THAT(RunMlvi("aviate").output,
              AllOf(HasSubstr("'aviate'"), HasSubstr("simulate, info, run, evaluate")));
  EXPECT_THAT(RunMlvi("aviate").output, Not(HasSubstr("did you mean")));
  ExpectUsageError(RunMlvi(""), "subcommand is required");
}

TEST_F(CommandLine, NumbersOfSimulateMustBeFiniteAndInRange) {
  for (const char* option :
       {"--seconds", "--rest", "--image-rate", "--extrinsics-error 0,", "--time-jump 1,",
        "--lidar-gap 1,", "--exposure-jump 1,1,", "--imu-saturation 10,", "--imu-vibration 1,",
        "--imu-warm-up 0.1,0.1,", "--imu-scale 0.01,"}) {
    const std::string separator = std::string(option).ends_with(',') ? "" : " ";
    for (const char* value : {"nan", "inf", "-1e12"}) {
      ExpectUsageError(Simulate(option + separator + value), "");
    }
  }
  ExpectUsageError(Simulate("--clock lidar,nan"), "the clock of lidar");
  ExpectUsageError(Simulate("--lidar-gap -1,-1"), "LiDAR gap");
  EXPECT_FALSE(std::filesystem::exists(Path("out")));
}

TEST_F(CommandLine, NumbersOfEvaluateMustBeFiniteAndInRange) {
  for (const char* option : {"--segments", "--time-offset", "--max-gap", "--max-difference",
                             "--rpe-delta", "--coverage-gap", "--truth-frame 0 0 0 0 0 0"}) {
    for (const char* value : {"nan", "inf", "1e300", "3m"}) {
      ExpectUsageError(Evaluate(std::string(option) + " " + value),
                       std::string(value) + " is no finite number");
    }
  }
}

TEST_F(CommandLine, OptionsWithoutTheirPartnerAreRefused) {
  for (const std::string option :
       {"--waypoint 1,2,3", "--scene-up z", "--scene-scale 2", "--scene-relief 0,0"}) {
    ExpectUsageError(Simulate(option), "requires --scene");
  }
  ExpectUsageError(Simulate("--start 0,0,0,0"), "requires --trajectory");
  ExpectUsageError(Simulate("--imu " + Path("walk.tum")), "requires --trajectory");
  ExpectUsageError(Simulate("--rest 1 --trajectory " + Path("walk.tum")), " excludes ");
  ExpectUsageError(Simulate("--scene " + Path("walk.tum") + " --waypoint 1,2,3junk"),
                   "--waypoint 1,2,3junk: expected X,Y,Z");
}

TEST_F(CommandLine, ChoicesAreNames) {
  ExpectUsageError(Simulate("--compression 1"), "not in {none,bz2,lz4}");
  ExpectUsageError(Simulate("--threads -1"), "not in range 0 to 1024");
  ExpectUsageError(Evaluate("--align se4"), "not in {none,se3,sim3,yaw}");
  const std::string help = RunMlvi("simulate --help").output;
  EXPECT_THAT(help, AllOf(HasSubstr("{none,bz2,lz4}"), Not(HasSubstr("->"))));
}

// A folder is no file, and the messages say so; evaluation reads input (2), the others
// configuration (1).
TEST_F(CommandLine, FoldersInPlaceOfFiles) {
  const std::string folder = folder_.path().string();
  ExpectUsageError(RunMlvi("run a.bag --rig m2dgr -o " + Path("out") + " --config " + folder),
                   "it is a folder");
  ExpectUsageError(RunMlvi("run a.bag --rig " + folder + " -o " + Path("out")), "it is a folder");
  EXPECT_FALSE(std::filesystem::exists(Path("out")));
  const ProcessResult evaluation = RunMlvi("evaluate " + folder + " " + Path("walk.tum"));
  EXPECT_EQ(evaluation.exit_code, 2);
  EXPECT_THAT(evaluation.output, HasSubstr("it is a folder"));
}

// /dev/full takes nothing, as a full disk.
class FullDisk : public CommandLine {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  }
  // Makes "out" a folder that takes everything but the file `name`.
  void Fill(const std::string& name) const {
    std::filesystem::remove_all(Path("out"));
    std::filesystem::create_directories(Path("out"));
    std::filesystem::create_symlink("/dev/full", Path("out/" + name));
  }
};

TEST_F(FullDisk, EveryResultOfSimulateIsChecked) {
  for (const std::string name :
       {"courtyard-easy.bag", "rig.yaml", "groundtruth.tum", "sequence.json"}) {
    Fill(name);
    ExpectUsageError(Simulate("--threads 1"), "cannot write '" + Path("out/" + name) + "'");
  }
}

// The rest is written all the same, and the report says what is missing.
TEST_F(FullDisk, EveryResultOfRunIsCheckedAndTheOthersAreKept) {
  const ProcessResult simulation = RunMlvi(
      "simulate courtyard-easy --rig hilti_2022 --cameras none --seconds 2.5 -o " + Path("out"));
  ASSERT_EQ(simulation.exit_code, 0) << simulation.output;
  const std::string run = "run " + Path("out/courtyard-easy.bag") + " --rig " +
                          Path("out/rig.yaml") + " -o " + Path("result");
  const std::vector<std::string> all = {"odometry.tum", "trajectory.tum", "map.ply", "map.png",
                                        "calibrated_rig.yaml"};
  for (const std::set<std::string>& full : {std::set<std::string>{"map.ply"},
                                            {"odometry.tum", "trajectory.tum"},
                                            {"map.png", "calibrated_rig.yaml"}}) {
    std::filesystem::remove_all(Path("result"));
    std::filesystem::create_directories(Path("result"));
    for (const std::string& name : full)
      std::filesystem::create_symlink("/dev/full", Path("result/" + name));
    const ProcessResult result = RunMlvi(run);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.output, HasSubstr("status "));
    const auto summary = nlohmann::json::parse(std::ifstream(Path("result/summary.json")));
    EXPECT_EQ(summary.at("not_written").size(), full.size());
    const std::string missing = summary.at("not_written").dump();
    for (const std::string& name : all) {
      EXPECT_EQ(missing.find(name) != std::string::npos, full.contains(name)) << name;
      if (full.contains(name)) continue;
      EXPECT_TRUE(std::filesystem::exists(Path("result/" + name))) << name;
    }
    EXPECT_FALSE(std::filesystem::exists(Path("result/summary.json.new")));
  }
}

TEST_F(FullDisk, StandardOutputIsChecked) {
  ExpectUsageError(Evaluate("--json >/dev/full"), "standard output");
  ExpectUsageError(RunMlvi("rig --base newer_college >/dev/full"), "standard output");
}

TEST_F(CommandLine, AFolderThatCannotBeMade) {
  std::ofstream(Path("out")) << "a file";
  ExpectUsageError(Simulate("--threads 1"), "out");
}

}  // namespace
}  // namespace mlvi

#endif
