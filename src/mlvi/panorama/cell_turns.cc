// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/cell_turns.h"

#include "mlvi/base/error.h"

namespace mlvi {

std::vector<std::uint8_t> CellTurns::Due(std::span<const std::uint8_t> occupied) const {
  MLVI_CHECK(occupied.size() == barren_.size(), "{} cells of {}", occupied.size(), barren_.size());
  std::vector<std::uint8_t> due(barren_.size());
  for (std::size_t cell = 0; cell < due.size(); ++cell) {
    const bool its_turn = cell % kTurns == images_ % kTurns;
    due[cell] = its_turn || (occupied[cell] == 0 && barren_[cell] == 0) ? 1 : 0;
  }
  return due;
}

void CellTurns::Note(std::span<const std::uint8_t> looked_at,
                     std::span<const std::uint8_t> with_corner) {
  MLVI_CHECK(looked_at.size() == barren_.size() && with_corner.size() == barren_.size(),
             "{} and {} cells of {}", looked_at.size(), with_corner.size(), barren_.size());
  for (std::size_t cell = 0; cell < barren_.size(); ++cell) {
    if (looked_at[cell] != 0) barren_[cell] = with_corner[cell] == 0 ? 1 : 0;
  }
  ++images_;
}

}  // namespace mlvi
