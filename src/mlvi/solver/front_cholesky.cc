// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/front_cholesky.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#if defined(__x86_64__) && defined(__GNUC__)
#define MLVI_DISPATCH_X86 1
#else
#define MLVI_DISPATCH_X86 0
#endif

namespace mlvi::internal {
namespace {

constexpr std::align_val_t kAlignment{64};
// Columns of one register tile; together with eight rows it fills the registers of AVX2.
constexpr int kTileColumns = 6;

// Eight doubles: one register with AVX-512, two with AVX2, four with SSE2. All give the same bits, as lanes never mix.
typedef double Vector __attribute__((vector_size(64)));  // NOLINT(modernize-use-using): attribute
#define MLVI_INLINE inline __attribute__((always_inline))

MLVI_INLINE const Vector& Load(const double* p) { return *reinterpret_cast<const Vector*>(p); }
MLVI_INLINE Vector& At(double* p) { return *reinterpret_cast<Vector*>(p); }

// C -= A B^T for kRows x 8 rows and kColumns columns; A and C column-major, the columns of B^T are rows of b.
template <int kRows, int kColumns>
MLVI_INLINE void MultiplyTile(const double* a, const double* b, std::size_t stride, int depth, double* c,
                              std::size_t c_stride) {
  Vector sum[kColumns][kRows] = {};
  for (int k = 0; k < depth; ++k, a += stride, b += stride) {
    for (int j = 0; j < kColumns; ++j) {
      for (int i = 0; i < kRows; ++i) sum[j][i] += Load(a + i * kVectorSize) * b[j];
    }
  }
  for (int j = 0; j < kColumns; ++j) {
    for (int i = 0; i < kRows; ++i) At(c + j * c_stride + i * kVectorSize) -= sum[j][i];
  }
}

// The same for rows [row, rows) of A and C.
template <int kRows, int kColumns>
MLVI_INLINE void MultiplyColumns(const double* a, const double* b, std::size_t stride, int depth, int row, int rows,
                                 double* c, std::size_t c_stride) {
  for (; row + kRows * kVectorSize <= rows; row += kRows * kVectorSize) {
    MultiplyTile<kRows, kColumns>(a + row, b, stride, depth, c + row, c_stride);
  }
  for (; row < rows; row += kVectorSize) {
    MultiplyTile<1, kColumns>(a + row, b, stride, depth, c + row, c_stride);
  }
}

template <int kRows>
MLVI_INLINE void Multiply(int columns, const double* a, const double* b, std::size_t stride, int depth, int row,
                          int rows, double* c, std::size_t c_stride) {
  switch (columns) {
    case 1: return MultiplyColumns<kRows, 1>(a, b, stride, depth, row, rows, c, c_stride);
    case 2: return MultiplyColumns<kRows, 2>(a, b, stride, depth, row, rows, c, c_stride);
    case 3: return MultiplyColumns<kRows, 3>(a, b, stride, depth, row, rows, c, c_stride);
    case 4: return MultiplyColumns<kRows, 4>(a, b, stride, depth, row, rows, c, c_stride);
    case 5: return MultiplyColumns<kRows, 5>(a, b, stride, depth, row, rows, c, c_stride);
    default: return MultiplyColumns<kRows, 6>(a, b, stride, depth, row, rows, c, c_stride);
  }
}

// Rows from this one on, rounded down to a whole vector; what is touched above the diagonal is scratch.
MLVI_INLINE int VectorRow(int row) { return row / kVectorSize * kVectorSize; }

// Columns [begin, end) of the panel, to which all columns before have been applied.
MLVI_INLINE int FactorizeColumns(const Front& front, int begin, int end, const double* diagonal, double tolerance) {
  const int rows = front.panel_stride();
  for (int j = begin; j < end; ++j) {
    double* column = front.panel + static_cast<std::size_t>(j) * rows;
    const double pivot = column[j];
    if (!(pivot > tolerance * diagonal[j])) return j;  // also NaN
    const double root = std::sqrt(pivot), inverse = 1.0 / root;
    for (int i = VectorRow(j); i < rows; i += kVectorSize) At(column + i) *= inverse;
    column[j] = root;
    for (int k = j + 1; k < end; ++k) {
      double* other = front.panel + static_cast<std::size_t>(k) * rows;
      const double factor = column[k];
      for (int i = VectorRow(k); i < rows; i += kVectorSize) At(other + i) -= Load(column + i) * factor;
    }
  }
  return -1;
}

template <int kRows>
MLVI_INLINE int Factorize(const Front& front, const double* diagonal, double tolerance) {
  const std::size_t stride = front.panel_stride();
  for (int j = 0; j < front.frontal; j += kTileColumns) {
    const int end = std::min(j + kTileColumns, front.frontal);
    if (j > 0) {
      Multiply<kRows>(end - j, front.panel, front.panel + j, stride, j, VectorRow(j), static_cast<int>(stride),
                      front.panel + j * stride, stride);
    }
    const int bad = FactorizeColumns(front, j, end, diagonal, tolerance);
    if (bad >= 0) return bad;
  }
  const double* below = front.panel + PadRows(front.frontal);
  const std::size_t remainder_stride = front.remainder_stride();
  for (int j = 0; j < front.separator; j += kTileColumns) {
    Multiply<kRows>(std::min(kTileColumns, front.separator - j), below, below + j, stride, front.frontal, VectorRow(j),
                    static_cast<int>(remainder_stride), front.remainder + j * remainder_stride, remainder_stride);
  }
  return -1;
}

int FactorizeGeneric(const Front& front, const double* diagonal, double tolerance) {
  return Factorize<1>(front, diagonal, tolerance);
}
#if MLVI_DISPATCH_X86
__attribute__((target("avx2"))) int FactorizeAvx2(const Front& front, const double* diagonal, double tolerance) {
  return Factorize<1>(front, diagonal, tolerance);
}
__attribute__((target("avx512f,prefer-vector-width=512"))) int FactorizeAvx512(const Front& front,
                                                                             const double* diagonal,
                                                                             double tolerance) {
  return Factorize<2>(front, diagonal, tolerance);
}
#endif

// Eight partial sums, added in a fixed order.
MLVI_INLINE double Sum(const Vector& v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

}  // namespace

void AlignedBuffer::Reset(std::size_t size) {
  if (size > capacity_) {
    Release();
    data_ = static_cast<double*>(::operator new(size * sizeof(double), kAlignment));
    capacity_ = size;
  }
  if (size > 0) std::memset(data_, 0, size * sizeof(double));
}

void AlignedBuffer::Release() {
  ::operator delete(data_, kAlignment);
  data_ = nullptr;
  capacity_ = 0;
}

void AlignedBuffer::Swap(AlignedBuffer& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(capacity_, other.capacity_);
}

int FactorizeFront(const Front& front, const double* diagonal, double tolerance) {
#if MLVI_DISPATCH_X86
  if (__builtin_cpu_supports("avx512f")) return FactorizeAvx512(front, diagonal, tolerance);
  if (__builtin_cpu_supports("avx2")) return FactorizeAvx2(front, diagonal, tolerance);
#endif
  return FactorizeGeneric(front, diagonal, tolerance);
}

void SolveFront(const Front& front, const double* x_separator, double* x) {
  const int below_rows = front.remainder_stride();
  for (int j = front.frontal - 1; j >= 0; --j) {
    const double* below = front.below(j);
    Vector sum = {};
    for (int i = 0; i < below_rows; i += kVectorSize) sum += Load(below + i) * Load(x_separator + i);
    const double* column = front.panel + static_cast<std::size_t>(j) * front.panel_stride();
    double value = below[front.separator] - Sum(sum);
    for (int i = j + 1; i < front.frontal; ++i) value -= column[i] * x[i];
    x[j] = value / column[j];
  }
}

}  // namespace mlvi::internal
