// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mlvi/base/suggestion.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

enum class Colour : int { kRed = 0, kGreen = 1, kBlue = 2 };

struct InnerConfig {
  double voxel_size = 0.5;
  Colour colour = Colour::kGreen;
  void Declare(ConfigDeclaration& d) {
    d.Field("voxel_size", voxel_size, "m", "Edge of a voxel", {0.01, 10.0});
    d.Field("colour", colour, {"red", "green", "blue"}, "Colour of the map");
  }
};

struct OuterConfig {
  bool enabled = true;
  int threads = 2;
  std::string name = "walk";
  InnerConfig map;
  InnerConfig far_map;
  double gain = 0.1;
  void Declare(ConfigDeclaration& d) {
    d.Field("enabled", enabled, "Whether to run");
    d.Field("threads", threads, "", "Number of threads", {1, 64});
    d.Field("name", name, "Label of the run");
    d.Section("map", map);
    d.Section("far_map", far_map);
    d.Field("gain", gain, "1/s", "Unbounded");
  }
};

class ConfigTest : public ::testing::Test {
 protected:
  std::string SetError(std::string_view key, std::string_view text) {
    const auto result = declaration_.Set(key, text);
    EXPECT_FALSE(result) << key << " = " << text;
    if (result) return "";
    EXPECT_EQ(result.error().kind, ErrorKind::kConfiguration);
    return result.error().message;
  }
  OuterConfig config_;
  ConfigDeclaration declaration_ = ConfigDeclaration::Of(config_);
};

TEST_F(ConfigTest, SetsEveryKindOfField) {
  EXPECT_TRUE(declaration_.Set("enabled", "false"));
  EXPECT_TRUE(declaration_.Set("threads", "8"));
  EXPECT_TRUE(declaration_.Set("name", "two words"));
  EXPECT_TRUE(declaration_.Set("map.voxel_size", "2.5e-1"));
  EXPECT_TRUE(declaration_.Set("far_map.colour", "blue"));
  EXPECT_TRUE(declaration_.SetAssignment("gain=+3"));
  EXPECT_FALSE(config_.enabled);
  EXPECT_EQ(config_.threads, 8);
  EXPECT_EQ(config_.name, "two words");
  EXPECT_EQ(config_.map.voxel_size, 0.25);
  EXPECT_EQ(config_.map.colour, Colour::kGreen);
  EXPECT_EQ(config_.far_map.colour, Colour::kBlue);
  EXPECT_EQ(config_.gain, 3.0);
}

TEST_F(ConfigTest, ErrorsNameFieldValueAndConstraint) {
  const std::string range = SetError("map.voxel_size", "20");
  for (const char* text : {"map.voxel_size", "20", "[0.01, 10]", "m"})
    EXPECT_THAT(range, HasSubstr(text));
  EXPECT_THAT(SetError("threads", "0"), HasSubstr("[1, 64]"));
  EXPECT_THAT(SetError("threads", "2.5"), HasSubstr("an integer"));
  EXPECT_THAT(SetError("threads", "99999999999"), HasSubstr("an integer"));
  EXPECT_THAT(SetError("gain", "fast"), HasSubstr("a number"));
  EXPECT_THAT(SetError("gain", ""), HasSubstr("a number"));
  EXPECT_THAT(SetError("gain", "1.0 "), HasSubstr("a number"));
  EXPECT_THAT(SetError("gain", "nan"), HasSubstr("finite"));
  EXPECT_THAT(SetError("gain", "inf"), HasSubstr("finite"));
  EXPECT_THAT(SetError("enabled", "yes"), HasSubstr("true or false"));
  EXPECT_THAT(SetError("map.colour", "grey"), HasSubstr("red, green, blue"));
  EXPECT_FALSE(declaration_.SetAssignment("gain"));
}

TEST_F(ConfigTest, ARefusedValueChangesNothing) {
  SetError("map.voxel_size", "20");
  SetError("threads", "1x");
  SetError("map.colour", "grey");
  EXPECT_EQ(config_.map.voxel_size, 0.5);
  EXPECT_EQ(config_.threads, 2);
  EXPECT_EQ(config_.map.colour, Colour::kGreen);
}

TEST_F(ConfigTest, AnUnknownKeyComesWithTheNearest) {
  EXPECT_THAT(SetError("map.voxelsize", "1"), HasSubstr("did you mean 'map.voxel_size'"));
  EXPECT_THAT(SetError("thread", "1"), HasSubstr("did you mean 'threads'"));
  EXPECT_THAT(SetError("map", "1"), HasSubstr("unknown configuration key 'map'"));
}

TEST_F(ConfigTest, TheDumpNestsAndExplains) {
  EXPECT_EQ(declaration_.ToYaml(),
            "enabled: true  # Whether to run\n"
            "threads: 2  # Number of threads\n"
            "name: \"walk\"  # Label of the run\n"
            "map:\n"
            "  voxel_size: 0.5  # [m] Edge of a voxel\n"
            "  colour: green  # Colour of the map\n"
            "far_map:\n"
            "  voxel_size: 0.5  # [m] Edge of a voxel\n"
            "  colour: green  # Colour of the map\n"
            "gain: 0.1  # [1/s] Unbounded\n");
}

struct SpanConfig {
  double least = 1.0;
  int most = 4;
  std::string name;
  void Declare(ConfigDeclaration& d) {
    d.Field("least", least, "s", "Least span", {0.0, 100.0});
    d.Field("most", most, "s", "Largest span", {0.0, 100.0});
    d.Field("name", name, "A text");
    d.AtMost("least", "most", "no span would do");
  }
};
struct TwoSpansConfig {
  SpanConfig near, far;
  void Declare(ConfigDeclaration& d) {
    d.Section("near", near);
    d.Section("far", far);
    d.AtMost("near.most", "far.most", "near would be far");
  }
};

TEST(ConfigOrderTest, ViolationsNameBothFieldsTheirValuesAndTheRemedy) {
  TwoSpansConfig config;
  ConfigDeclaration declaration = ConfigDeclaration::Of(config);
  EXPECT_TRUE(declaration.Check());
  ASSERT_TRUE(declaration.Set("far.least", "4"));
  EXPECT_TRUE(declaration.Check());  // equal is in order
  ASSERT_TRUE(declaration.Set("far.least", "4.5"));
  ASSERT_FALSE(declaration.Check());
  EXPECT_EQ(declaration.Check().error().kind, ErrorKind::kConfiguration);
  EXPECT_EQ(
      declaration.Check().error().message,
      "far.least = 4.5 exceeds far.most = 4: no span would do. Lower far.least or raise far.most.");
  ASSERT_TRUE(declaration.Set("far.most", "5"));
  EXPECT_TRUE(declaration.Check());
  ASSERT_TRUE(declaration.Set("near.most", "6"));
  EXPECT_THAT(declaration.Check().error().message, HasSubstr("near would be far"));
}

TEST(ConfigOrderTest, ThePageTellsTheRules) {
  TwoSpansConfig config;
  EXPECT_THAT(ConfigDeclaration::Of(config).ToMarkdown(),
              HasSubstr("- `near.least` must not exceed `near.most`: otherwise no span would do."));
}

TEST(ConfigOrderTest, OnlyDeclaredNumbersHaveAnOrder) {
  SpanConfig config;
  ConfigDeclaration declaration = ConfigDeclaration::Of(config);
  EXPECT_THROW(declaration.AtMost("least", "largest", ""), ContractViolation);
  EXPECT_THROW(declaration.AtMost("least", "name", ""), ContractViolation);
}

// The dump holds every digit: reading it back gives the same bits.
TEST_F(ConfigTest, DumpedNumbersKeepAllDigits) {
  config_.gain = 0.1 + 0.2;
  const std::string yaml = declaration_.ToYaml();
  const std::size_t at = yaml.find("gain: ") + 6;
  const std::string text = yaml.substr(at, yaml.find(' ', at) - at);
  OuterConfig other;
  ConfigDeclaration declaration = ConfigDeclaration::Of(other);
  ASSERT_TRUE(declaration.Set("gain", text));
  EXPECT_EQ(other.gain, config_.gain);
}

TEST_F(ConfigTest, DumpedTextIsQuoted) {
  config_.name = R"(a "b" \c)";
  EXPECT_THAT(declaration_.ToYaml(), HasSubstr(R"(name: "a \"b\" \\c")"));
}

TEST_F(ConfigTest, ThePageListsEveryField) {
  const std::string page = declaration_.ToMarkdown();
  for (const ConfigField& field : declaration_.fields())
    EXPECT_THAT(page, HasSubstr("`" + field.key + "`"));
  EXPECT_THAT(page, HasSubstr("| `map.voxel_size` | 0.5 | m | 0.01 .. 10 | Edge of a voxel |"));
  EXPECT_THAT(page, HasSubstr("red / green / blue"));
  EXPECT_EQ(std::count(page.begin(), page.end(), '\n'),
            2 + static_cast<std::ptrdiff_t>(declaration_.fields().size()));
}

TEST_F(ConfigTest, TheEndOfAKeyIsTakenForIt) {
  EXPECT_THAT(SetError("voxel_size", "1"), HasSubstr("did you mean 'map.voxel_size'"));
  EXPECT_THAT(SetError("colossal", "1"), Not(HasSubstr("did you mean")));
}

TEST(NearestName, IsTheSmallestEditDistance) {
  EXPECT_EQ(NearestName("kitten", {"mitten", "sitting", "kite"}), "mitten");
  EXPECT_EQ(NearestName("rub", {"info", "run"}), "run");
  EXPECT_EQ(NearestName("x", {}), "");
}

TEST(NearestName, IsNoneThatIsFar) {
  EXPECT_EQ(NearestName("/tmp", {"m2dgr", "walk_os0"}), "");
  EXPECT_EQ(NearestName("foo", {"feedback"}), "");
  EXPECT_EQ(DidYouMean("foo", {"feedback"}), "");
  EXPECT_EQ(DidYouMean("simualte", {"simulate"}), "; did you mean 'simulate'?");
}

}  // namespace
}  // namespace mlvi
