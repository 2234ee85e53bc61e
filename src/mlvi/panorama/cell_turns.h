// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace mlvi {

// In which cells of the budget one camera looks for corners. Those in which it found none, and those
// that have a feature already, come in turn, one in kTurns per image of this camera: what they show
// changes slowly, and detection is dear. Cameras have turns of their own because images may miss:
// what others looked at, or when, says nothing of what this one sees.
class CellTurns {
 public:
  static constexpr int kTurns = 4;  // images

  explicit CellTurns(int cells) : barren_(static_cast<std::size_t>(cells)) {}

  // One flag per cell: it is to be looked at in the next image. `occupied`: it has a feature.
  std::vector<std::uint8_t> Due(std::span<const std::uint8_t> occupied) const;
  // What the image showed: cells that were looked at, and those of them with a corner.
  void Note(std::span<const std::uint8_t> looked_at, std::span<const std::uint8_t> with_corner);

 private:
  std::vector<std::uint8_t> barren_;  // per cell: no corner when last looked at
  std::size_t images_ = 0;
};

}  // namespace mlvi
