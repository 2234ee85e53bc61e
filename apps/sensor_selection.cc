// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "sensor_selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "mlvi/base/suggestion.h"

using namespace mlvi;

namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

// In the order of the rig, whatever the order on the command line: results must not depend on that.
Expected<std::vector<CameraSpec>> SelectCameras(const Rig& rig, const std::string& list) {
  if (list == "none") return std::vector<CameraSpec>();
  if (rig.cameras.empty())
    return MakeError(kKind, "--cameras {}: rig '{}' has no cameras", list, rig.name);
  if (list == "all") return rig.cameras;
  const std::vector<std::string> known = rig.CameraNames();
  const std::vector<std::string> wanted = SplitAtCommas(list);
  for (const std::string& name : wanted) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return MakeError(kKind, "--cameras: rig '{}' has no camera '{}', it has {}{}", rig.name, name,
                       fmt::join(known, ", "), DidYouMean(name, known));
    }
    if (std::count(wanted.begin(), wanted.end(), name) > 1) {
      return MakeError(kKind, "--cameras: '{}' is given twice", name);
    }
  }
  std::vector<CameraSpec> selected;
  for (const CameraSpec& camera : rig.cameras) {
    if (std::find(wanted.begin(), wanted.end(), camera.name) != wanted.end())
      selected.push_back(camera);
  }
  if (selected.empty()) return MakeError(kKind, "--cameras: name cameras, or say all or none");
  return selected;
}

}  // namespace

std::vector<std::string> SplitAtCommas(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream stream(list);
  for (std::string name; std::getline(stream, name, ',');) names.push_back(name);
  return names;
}

Expected<Rig> SelectSensors(const Rig& rig, const std::string& cameras, bool no_lidar) {
  const auto selected = SelectCameras(rig, cameras);
  if (!selected) return tl::unexpected(selected.error());
  Rig used = rig;
  used.cameras = *selected;
  if (no_lidar) used.lidar.reset();
  if (!no_lidar && !rig.lidar) {
    return MakeError(kKind,
                     "rig '{}' has no lidar: use its cameras alone with --no-lidar --cameras all",
                     rig.name);
  }
  if (!used.lidar && used.cameras.empty()) {
    return MakeError(
        kKind, "--no-lidar with --cameras none leaves nothing to see with: add --cameras all");
  }
  return used;
}
