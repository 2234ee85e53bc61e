// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "info_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "exit_code.h"
#include "mlvi/base/progress.h"
#include "mlvi/io/bag_info.h"

namespace {

using namespace mlvi;

std::string DateText(Time time) {
  const std::time_t seconds = static_cast<std::time_t>(time.nanoseconds() / 1'000'000'000);
  return fmt::format("{} ({:%Y-%m-%d %H:%M:%S} UTC)", ToString(time), fmt::gmtime(seconds));
}

// With its sign, in whole milliseconds: none is "-0.000 s".
std::string Offset(Time time, Time begin) {
  const auto milliseconds = static_cast<double>(std::llround(1e3 * (time - begin).seconds()));
  return fmt::format("{:+.3f} s", milliseconds * 1e-3);
}

void PrintStamps(const TopicInfo& topic, Time begin) {
  fmt::print("    {} messages", topic.messages);
  if (topic.messages > 1) {
    fmt::print(", {:.2f} Hz, from {} to {}, largest gap {:.4f} s at {}", topic.Rate(),
               Offset(topic.first, begin), Offset(topic.last, begin), topic.largest_gap.seconds(),
               Offset(topic.gap_begin.valid() ? topic.gap_begin : begin, begin));
  }
  fmt::print(" ({})\n", topic.header_stamps ? "header stamps" : "receipt times");
  if (topic.backwards > 0) fmt::print("    {} messages go back in time\n", topic.backwards);
  if (topic.header_stamps && topic.largest_delay > Duration::FromMilliseconds(500)) {
    fmt::print("    received up to {:.3f} s after their stamp\n", topic.largest_delay.seconds());
  }
}

void PrintImu(const ImuTopicInfo& imu) {
  const Eigen::Vector3d &a = imu.mean_acceleration, &w = imu.mean_angular_velocity;
  fmt::print("    median |acceleration| of the first second {:.4f}: {}\n", imu.median_acceleration,
             imu.unit == AccelerationUnit::kGravities ? "g" : "m/s^2");
  fmt::print(
      "    mean acceleration ({:.3f}, {:.3f}, {:.3f}), angular velocity ({:.4f}, {:.4f}, {:.4f}) "
      "rad/s\n",
      a.x(), a.y(), a.z(), w.x(), w.y(), w.z());
}

void PrintPoints(const PointTopicInfo& points) {
  fmt::print("    {} x {} points of {} bytes ({} returns); {} to {} per message\n", points.height,
             points.width, points.point_step, points.returns, points.fewest_points,
             points.most_points);
  fmt::print("    fields: {}\n", points.fields);
  if (points.time_field.empty()) {
    fmt::print("    no point times\n");
    return;
  }
  fmt::print("    '{}' from {:.9g} to {:.9g}", points.time_field, points.time_min, points.time_max);
  if (!points.times) {
    fmt::print(": no usable times (all equal, or spread too far)\n");
    return;
  }
  constexpr const char* kOrigins[] = {"since the header's stamp",
                                      "before the header's stamp (the sweep's end)", "absolute",
                                      "on a clock other than the header's"};
  fmt::print(": {}, {}; span {:.4f} s\n", NameOf(points.times->unit),
             kOrigins[static_cast<int>(points.times->origin)], points.times->span.seconds());
}

void PrintBag(const BagInfo& bag) {
  fmt::print("{}\n  {:.1f} MB{}\n", bag.path, static_cast<double>(bag.file_size) * 1e-6,
             bag.indexed ? "" : ", no index");
  if (bag.begin.valid()) {
    fmt::print("  {:.3f} s, from {} to {}\n", (bag.end - bag.begin).seconds(), DateText(bag.begin),
               DateText(bag.end));
  }
  for (const TopicInfo& topic : bag.topics) {
    fmt::print("  {}  {}\n", topic.topic, topic.type);
    PrintStamps(topic, bag.begin);
    if (topic.imu) PrintImu(*topic.imu);
    if (topic.points) PrintPoints(*topic.points);
    if (!topic.unreadable.empty()) fmt::print("    unreadable message: {}\n", topic.unreadable);
  }
}

Expected<int> Info(const std::vector<std::string>& bags) {
  int code = kExitDone;
  for (const std::string& path : bags) {
    ProgressBar progress("info", stderr);
    const auto bag = InspectBag(path, [&](double share) { progress.Update(share); });
    progress.Finish();
    if (!bag) return tl::unexpected(bag.error());
    PrintBag(*bag);
    if (bag->damage.empty()) continue;
    fmt::print(stderr, "{}\n", bag->damage);
    code = kExitInput;
  }
  return code;
}

}  // namespace

void AddInfoCommand(CLI::App& app, int& exit_code) {
  const auto bags = std::make_shared<std::vector<std::string>>();
  CLI::App* command =
      app.add_subcommand("info", "Topics, rates, gaps, fields and time ranges of recordings");
  command->add_option("bags", *bags, "ROS 1 bags")->required();
  command->callback([bags, &exit_code] { exit_code = Report(Info(*bags)); });
}
