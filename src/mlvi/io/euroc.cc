// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/euroc.h"

#include <charconv>
#include <cmath>

#include "mlvi/io/text_table.h"
#include "mlvi/io/whole_file.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

Expected<Time> ParseStamp(const TableLine& line, const std::string& path) {
  const std::string& word = line.words[0];
  std::int64_t ns = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), ns);
  if (code != std::errc() || end != word.data() + word.size()) {
    return MakeError(kKind, "{}:{}: '{}' is no integer stamp in nanoseconds", path, line.number,
                     word);
  }
  return Time::FromNanoseconds(ns);
}

Eigen::Vector3d VectorAt(const std::vector<double>& v, std::size_t i) {
  return {v[i], v[i + 1], v[i + 2]};
}

Expected<NavState> ParseState(const TableLine& line, const std::string& path) {
  const auto stamp = ParseStamp(line, path);
  if (!stamp) return tl::unexpected(stamp.error());
  const bool full = line.words.size() >= 17;
  const auto v = Numbers(line, 1, full ? 16 : 7, path);
  if (!v) return tl::unexpected(v.error());
  const Eigen::Quaterniond rotation((*v)[3], (*v)[4], (*v)[5], (*v)[6]);
  if (std::abs(rotation.norm() - 1.0) > 0.01) {
    return MakeError(kKind, "{}:{}: quaternion norm {:.4f} is not 1; order is w x y z", path,
                     line.number, rotation.norm());
  }
  NavState state;
  state.stamp = *stamp;
  state.T_world_body = Pose3(rotation, VectorAt(*v, 0));
  if (full) {
    state.v_world_body = VectorAt(*v, 7);
    state.bias.gyroscope = VectorAt(*v, 10);
    state.bias.accelerometer = VectorAt(*v, 13);
  }
  return state;
}

Expected<ImuSample> ParseSample(const TableLine& line, const std::string& path) {
  const auto stamp = ParseStamp(line, path);
  if (!stamp) return tl::unexpected(stamp.error());
  const auto v = Numbers(line, 1, 6, path);
  if (!v) return tl::unexpected(v.error());
  ImuSample sample;
  sample.stamp = *stamp;
  sample.angular_velocity = VectorAt(*v, 0);
  sample.linear_acceleration = VectorAt(*v, 3);
  return sample;
}

template <typename Row, typename Parse>
Expected<std::vector<Row>> ReadRows(const std::string& path, const Parse& parse) {
  const auto text = ReadWholeFile(path, kKind);
  if (!text) return tl::unexpected(text.error());
  std::vector<Row> rows;
  for (const TableLine& line : SplitTable(*text)) {
    auto row = parse(line, path);
    if (!row) return tl::unexpected(row.error());
    rows.push_back(*row);
  }
  if (rows.empty()) return MakeError(kKind, "{}: no row in this file", path);
  return rows;
}

}  // namespace

Expected<std::vector<NavState>> ReadEurocGroundTruth(const std::string& path) {
  return ReadRows<NavState>(path, ParseState);
}

Expected<std::vector<ImuSample>> ReadEurocImu(const std::string& path) {
  return ReadRows<ImuSample>(path, ParseSample);
}

}  // namespace mlvi
