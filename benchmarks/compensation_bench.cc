// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Depth errors of the three modes of extrinsic compensation over offset, depth, radius of the
// sphere, rotation, baseline and noise: the tables of docs/compensation.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <vector>

#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

using Setting = test::ViewSetting;

std::string Percent(double share) {
  if (share < 5e-6) return "0";
  return fmt::format("{:.{}f}", 100.0 * share, share < 0.0995 ? 2 : 1);
}

void PrintTable(const std::string& title, const std::string& unit,
                const std::vector<double>& values, double Setting::*field, Setting setting,
                int trials) {
  fmt::print("\n| {} | none | plane | ray | none, 2 mrad | plane, 2 mrad | ray, 2 mrad |\n", title);
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const double value : values) {
    setting.*field = value;
    fmt::print("| {} {} ", value, unit);
    for (const double noise : {0.0, 2e-3}) {
      setting.noise = noise;
      for (const auto mode : {Compensation::kNone, Compensation::kPlane, Compensation::kRay}) {
        fmt::print("| {} ", Percent(test::MedianDepthError(setting, mode, trials)));
      }
    }
    fmt::print("|\n");
  }
}

void Run(int trials) {
  for (const int views : {2, 6}) {
    const Setting base{.views = views};
    fmt::print("\n## {} views\n", views);
    PrintTable("offset", "m", {0.0, 0.02, 0.05, 0.08, 0.16, 0.3}, &Setting::offset, base, trials);
    PrintTable("depth", "m", {1.0, 2.0, 5.0, 10.0, 20.0, 50.0}, &Setting::depth, base, trials);
    PrintTable("radius", "m", {0.5, 1.0, 5.0, 10.0, 20.0, 100.0}, &Setting::radius, base, trials);
    PrintTable("rotation", "rad", {0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0}, &Setting::rotation, base,
               trials);
    PrintTable("baseline", "m", {0.1, 0.25, 0.5, 1.0, 2.0}, &Setting::baseline, base, trials);
  }
}

}  // namespace
}  // namespace mlvi

int main(int argc, char** argv) {
  CLI::App app("Median depth errors (%) of the modes of extrinsic compensation");
  int trials = 20000;
  app.add_option("--trials", trials, "Random geometries per entry")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  mlvi::Run(trials);
  return 0;
}
