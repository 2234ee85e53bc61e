// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The dense inner loops of multifrontal Cholesky factorisation (Duff and Reid 1983; Liu, "The
// multifrontal method for sparse matrix solution", 1992).
#pragma once

#include <cstddef>
#include <new>

namespace mlvi::internal {

// Rows are padded to whole vectors of eight doubles, so that the loops need no remainder.
inline constexpr int kVectorSize = 8;
constexpr int PadRows(int rows) { return (rows + kVectorSize - 1) / kVectorSize * kVectorSize; }

// Doubles on a cache-line boundary; memory is kept when the size shrinks.
class AlignedBuffer {
 public:
  AlignedBuffer() = default;
  ~AlignedBuffer() { Release(); }
  AlignedBuffer(AlignedBuffer&& other) noexcept { Swap(other); }
  AlignedBuffer& operator=(AlignedBuffer&& other) noexcept {
    Swap(other);
    return *this;
  }

  // Contents undefined afterwards.
  void Reserve(std::size_t size);
  // All zero afterwards.
  void Reset(std::size_t size);
  void Release();
  double* data() { return data_; }
  const double* data() const { return data_; }

 private:
  void Swap(AlignedBuffer& other) noexcept;
  double* data_ = nullptr;
  std::size_t capacity_ = 0;
};

// The front of a clique with `frontal` dimensions to eliminate and `separator` dimensions that
// stay, augmented by the right-hand side as its last row. Column-major, lower triangle:
//   panel      columns 0..frontal-1. Rows 0..frontal-1 hold [H_ff], from PadRows(frontal) on [H_sf; b_f^T].
//   remainder  columns 0..separator-1, rows 0..separator: [H_ss; b_s^T].
// Rows of padding must be zero; entries above the diagonal are scratch.
struct Front {
  int frontal = 0, separator = 0;
  double* panel = nullptr;
  double* remainder = nullptr;

  int panel_stride() const { return PadRows(frontal) + remainder_stride(); }
  int remainder_stride() const { return PadRows(separator + 1); }
  std::size_t panel_size() const { return static_cast<std::size_t>(panel_stride()) * frontal; }
  std::size_t remainder_size() const {
    return static_cast<std::size_t>(remainder_stride()) * separator;
  }
  // Element of the panel at which the rows [H_sf; b_f^T] of `column` begin.
  double* below(int column) const {
    return panel + static_cast<std::size_t>(column) * panel_stride() + PadRows(frontal);
  }
};

// Sets the front to zero, but for what lies above the diagonal.
void ZeroFront(const Front& front);

// A part of a child's separator that is contiguous in the front of the parent, too. Coordinates of
// a front count over its frontal and then its separator dimensions; a run lies in one of the two
// parts.
struct FrontRun {
  int child = 0, parent = 0, size = 0;
};
// Adds the remainder of a factorised child (multifrontal "extend-add"); `runs` cover its separator
// in order.
void AddChild(const Front& child, const FrontRun* runs, int run_count, const Front& parent);

// Columns 0..dimension-1 of H = A^T A in rows 0..dimension-1, and in row `dimension` b = -A^T r,
// from `rows` rows [A | r]. `stride` (a multiple of kVectorSize) doubles lie between the rows of A
// and between the columns of H.
void FormHessian(const double* augmented, int rows, int dimension, int stride, double* hessian);

// Adds a symmetric matrix of `count` x `count` blocks whose block i has offset start[i] in the
// matrix and `coordinate[i]` in the front; `stride` doubles lie between its columns, and row
// start[count] holds the right-hand side.
void AddSymmetric(const double* matrix, int stride, const int* start, const int* coordinate,
                  int count, const Front& front);

// In place: panel becomes [L_ff; L_sf; y^T] with L_ff L_ff^T = H_ff and L_ff y = b_f, remainder its
// Schur complement. Returns -1, or the first column whose pivot is not above `tolerance` times
// `diagonal[column]`: the front is then spoilt. The sum of every entry runs in the same order on
// every processor.
int FactorizeFront(const Front& front, const double* diagonal, double tolerance);

// Solves L_ff^T x = y - L_sf^T x_separator unless `x_old` already leaves the objective, 1/2 |L_ff^T
// x + L_sf^T x_separator - y|^2, not above `tolerance`: then false, and `x` is undefined.
// `x_separator` has the remainder stride, zero in the padding.
bool SolveFront(const Front& front, const double* x_separator, double tolerance,
                const double* x_old, double* x);

}  // namespace mlvi::internal
