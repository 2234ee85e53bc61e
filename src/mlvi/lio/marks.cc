// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/marks.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "mlvi/base/parallel.h"
#include "mlvi/lio/axis_cells.h"

namespace mlvi {
namespace {

constexpr int kMinCellPoints = 12;
constexpr float kMaxThickness = 0.06F;  // m, standard deviation across a surface with marks
constexpr float kFlatness = 0.25F;      // of that to its extent
constexpr float kMaxHeight = 0.15F;     // m, to either side of the surface
constexpr int kLayers = 12;
constexpr float kLayer = 2.0F * kMaxHeight / kLayers;  // m
constexpr int kSlots = 48;           // along the axis, over a cell and its two neighbours
constexpr int kWindow = kSlots / 3;  // to either side, what a mark must stand out from
constexpr float kSigmas = 2.5F;      // half the width of a mark
constexpr int kMinMarkPoints = 4;    // in one layer
constexpr float kMaxRest = 0.5F;     // points of the layer beside the mark, per point of it
constexpr int kParts = 3;            // of the window on one side,
constexpr int kMinParts = 2;         // so many with points

using Histogram = std::array<std::uint16_t, kSlots>;

int Sum(const Histogram& counts, int first, int last) {
  int n = 0;
  for (int s = std::max(first, 0); s <= std::min(last, kSlots - 1); ++s) n += counts[s];
  return n;
}

// A line in the plane across the axis: the trace of a surface that runs along it.
struct Trace {
  Eigen::Vector2f centre, normal;
  float Height(const Eigen::Vector3f& p) const { return normal.dot(p.tail<2>() - centre); }
};

std::optional<Trace> FitTrace(const AxisCells& cells, std::size_t cell) {
  const auto members = cells.members(cell);
  if (static_cast<int>(members.size()) < kMinCellPoints) return std::nullopt;
  const float count = static_cast<float>(members.size());
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  for (const std::uint32_t i : members) sum += cells.point(i).tail<2>();
  const Eigen::Vector2f centre = sum / count;
  Eigen::Matrix2f scatter = Eigen::Matrix2f::Zero();
  for (const std::uint32_t i : members) {
    const Eigen::Vector2f d = cells.point(i).tail<2>() - centre;
    scatter += d * d.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> solver;
  solver.computeDirect(scatter / count);
  const Eigen::Vector2f spread = solver.eigenvalues().cwiseMax(0.0F).cwiseSqrt();
  if (spread[0] > kMaxThickness || spread[0] > kFlatness * spread[1]) return std::nullopt;
  return Trace{centre, solver.eigenvectors().col(0)};
}

// How many points a cell and its neighbours hold by height and place along the axis.
class Layers {
 public:
  // `begin`: of the neighbour behind, along the axis (m); `width`: of a mark, half (m).
  Layers(const Trace& trace, float begin, float cell_size, float width)
      : trace_(trace),
        begin_(begin),
        slot_(3.0F * cell_size / kSlots),
        reach_(static_cast<int>(std::ceil(width / slot_))) {}

  void Add(const Eigen::Vector3f& p) {
    const int layer = LayerOf(p);
    if (layer >= 0) ++counts_[layer][SlotOf(p)];
  }
  bool IsMark(const Eigen::Vector3f& p) const {
    const int layer = LayerOf(p);
    if (layer < 0) return false;
    const int slot = SlotOf(p);
    const int near = Sum(counts_[layer], slot - reach_, slot + reach_);
    const int all = Sum(counts_[layer], slot - kWindow, slot + kWindow);
    return near >= kMinMarkPoints && all - near <= kMaxRest * near && Covered(slot);
  }

 private:
  // Where only single rings cross the surface, gaps between them are no sign of marks: on either
  // side some layer must go on.
  bool Covered(int slot) const {
    const auto goes_on = [&](int side) {
      return std::any_of(counts_.begin(), counts_.end(), [&](const Histogram& layer) {
        const int width = (kWindow - reach_) / kParts;
        int parts = 0, points = 0;
        for (int part = 0; part < kParts; ++part) {
          const int near = slot + side * (reach_ + 1 + part * width);
          const int far = near + side * (width - 1);
          const int n = Sum(layer, std::min(near, far), std::max(near, far));
          parts += n > 0 ? 1 : 0;
          points += n;
        }
        return parts >= kMinParts && points >= kMinMarkPoints;
      });
    };
    return goes_on(-1) && goes_on(1);
  }
  int LayerOf(const Eigen::Vector3f& p) const {
    const float layer = (trace_.Height(p) + kMaxHeight) / kLayer;
    return layer >= 0.0F && layer < kLayers ? static_cast<int>(layer) : -1;
  }
  int SlotOf(const Eigen::Vector3f& p) const {
    return std::clamp(static_cast<int>((p.x() - begin_) / slot_), 0, kSlots - 1);
  }

  Trace trace_;
  float begin_, slot_;  // m
  int reach_;           // slots
  std::array<Histogram, kLayers> counts_ = {};
};

std::vector<std::size_t> MarksOfCell(const AxisCells& cells, std::size_t cell, float width) {
  std::vector<std::size_t> marks;
  const auto trace = FitTrace(cells, cell);
  if (!trace) return marks;
  const float size = static_cast<float>(cells.cell_size());
  Layers layers(*trace, static_cast<float>(cells.coordinates(cell).x() - 1) * size, size, width);
  for (int by = -1; by <= 1; ++by) {
    const int other = by == 0 ? static_cast<int>(cell) : cells.Neighbor(cell, by);
    if (other < 0) continue;
    for (const std::uint32_t i : cells.members(other)) layers.Add(cells.point(i));
  }
  for (const std::uint32_t i : cells.members(cell)) {
    if (layers.IsMark(cells.point(i))) marks.push_back(i);
  }
  return marks;
}

}  // namespace

std::vector<std::size_t> FindMarks(const PointCloud& points, const Eigen::Vector3d& axis,
                                   double range_noise, const MarkConfig& config) {
  const AxisCells cells(points, axis, config.cell, config.max_range);
  const float width = kSigmas * static_cast<float>(range_noise);
  std::vector<std::vector<std::size_t>> parts(cells.size());
  ParallelFor(cells.size(), 32,
              [&](std::size_t cell) { parts[cell] = MarksOfCell(cells, cell, width); });
  std::vector<std::size_t> marks;
  for (const auto& part : parts) marks.insert(marks.end(), part.begin(), part.end());
  std::sort(marks.begin(), marks.end());
  return marks;
}

}  // namespace mlvi
