// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/cell_turns.h"

#include <gtest/gtest.h>

namespace mlvi {
namespace {

constexpr int kCells = 10;
using Flags = std::vector<std::uint8_t>;

// Looks at all cells that are due, none of them occupied; corners are where `with_corner` says.
Flags Look(CellTurns& turns, const Flags& with_corner) {
  const Flags due = turns.Due(Flags(kCells, 0));
  turns.Note(due, with_corner);
  return due;
}

TEST(CellTurns, FreeCellsAreLookedAtInEveryImageUntilTheyShowNothing) {
  CellTurns turns(kCells);
  Flags with_corner(kCells, 0);
  with_corner[3] = with_corner[7] = 1;
  EXPECT_EQ(Look(turns, with_corner), Flags(kCells, 1));
  std::vector<int> times(kCells);
  for (int image = 0; image < CellTurns::kTurns; ++image) {
    const Flags due = Look(turns, with_corner);
    for (std::size_t cell = 0; cell < due.size(); ++cell) times[cell] += due[cell];
  }
  for (std::size_t cell = 0; cell < times.size(); ++cell) {
    EXPECT_EQ(times[cell], with_corner[cell] != 0 ? CellTurns::kTurns : 1) << cell;
  }
}

TEST(CellTurns, OccupiedCellsComeInTurn) {
  CellTurns turns(kCells);
  std::vector<int> times(kCells);
  for (int image = 0; image < 3 * CellTurns::kTurns; ++image) {
    const Flags due = turns.Due(Flags(kCells, 1));
    turns.Note(due, Flags(kCells, 1));
    for (std::size_t cell = 0; cell < due.size(); ++cell) times[cell] += due[cell];
  }
  EXPECT_EQ(times, std::vector<int>(kCells, 3));
}

// A cell that was not looked at keeps what was known of it.
TEST(CellTurns, WhatWasNotLookedAtStaysAsItWas) {
  CellTurns turns(kCells);
  turns.Note(Flags(kCells, 0), Flags(kCells, 0));
  EXPECT_EQ(turns.Due(Flags(kCells, 0)), Flags(kCells, 1));
}

}  // namespace
}  // namespace mlvi
