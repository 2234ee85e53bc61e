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

// Eight doubles: one register with AVX-512, two with AVX2, four with SSE2. All give the same bits,
// as lanes never mix.
typedef double Vector __attribute__((vector_size(64)));  // NOLINT(modernize-use-using): attribute
#define MLVI_INLINE inline __attribute__((always_inline))

MLVI_INLINE const Vector& Load(const double* p) { return *reinterpret_cast<const Vector*>(p); }
MLVI_INLINE Vector& At(double* p) { return *reinterpret_cast<Vector*>(p); }

// C -= A B^T for kRows x 8 rows and kColumns columns; A and C column-major, the columns of B^T are
// rows of b.
template <int kRows, int kColumns>
MLVI_INLINE void MultiplyTile(const double* a, const double* b, std::size_t stride, int depth,
                              double* c, std::size_t c_stride) {
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
MLVI_INLINE void MultiplyColumns(const double* a, const double* b, std::size_t stride, int depth,
                                 int row, int rows, double* c, std::size_t c_stride) {
  for (; row + kRows * kVectorSize <= rows; row += kRows * kVectorSize) {
    MultiplyTile<kRows, kColumns>(a + row, b, stride, depth, c + row, c_stride);
  }
  for (; row < rows; row += kVectorSize) {
    MultiplyTile<1, kColumns>(a + row, b, stride, depth, c + row, c_stride);
  }
}

template <int kRows>
MLVI_INLINE void Multiply(int columns, const double* a, const double* b, std::size_t stride,
                          int depth, int row, int rows, double* c, std::size_t c_stride) {
  switch (columns) {
    case 1: return MultiplyColumns<kRows, 1>(a, b, stride, depth, row, rows, c, c_stride);
    case 2: return MultiplyColumns<kRows, 2>(a, b, stride, depth, row, rows, c, c_stride);
    case 3: return MultiplyColumns<kRows, 3>(a, b, stride, depth, row, rows, c, c_stride);
    case 4: return MultiplyColumns<kRows, 4>(a, b, stride, depth, row, rows, c, c_stride);
    case 5: return MultiplyColumns<kRows, 5>(a, b, stride, depth, row, rows, c, c_stride);
    default: return MultiplyColumns<kRows, 6>(a, b, stride, depth, row, rows, c, c_stride);
  }
}

// Rows from this one on, rounded down to a whole vector; what is touched above the diagonal is
// scratch.
MLVI_INLINE int VectorRow(int row) { return row / kVectorSize * kVectorSize; }

// Columns [begin, end) of the panel, to which all columns before have been applied.
MLVI_INLINE int FactorizeColumns(const Front& front, int begin, int end, const double* diagonal,
                                 double tolerance) {
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
      for (int i = VectorRow(k); i < rows; i += kVectorSize)
        At(other + i) -= Load(column + i) * factor;
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
      Multiply<kRows>(end - j, front.panel, front.panel + j, stride, j, VectorRow(j),
                      static_cast<int>(stride), front.panel + j * stride, stride);
    }
    const int bad = FactorizeColumns(front, j, end, diagonal, tolerance);
    if (bad >= 0) return bad;
  }
  const double* below = front.panel + PadRows(front.frontal);
  const std::size_t remainder_stride = front.remainder_stride();
  for (int j = 0; j < front.separator; j += kTileColumns) {
    Multiply<kRows>(std::min(kTileColumns, front.separator - j), below, below + j, stride,
                    front.frontal, VectorRow(j), static_cast<int>(remainder_stride),
                    front.remainder + j * remainder_stride, remainder_stride);
  }
  return -1;
}

// Eight partial sums, added in a fixed order.
MLVI_INLINE double Sum(const Vector& v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

// x_j = y_j - <L_sf column j, x_separator> for the columns [begin, begin + kColumns).
template <int kColumns>
MLVI_INLINE void SubtractSeparator(const Front& front, int begin, const double* x_separator,
                                   double* x) {
  const std::size_t stride = front.panel_stride();
  const int rows = front.remainder_stride();
  const double* below = front.below(begin);
  Vector sum[kColumns] = {};
  for (int i = 0; i < rows; i += kVectorSize) {
    const Vector xi = Load(x_separator + i);
    for (int j = 0; j < kColumns; ++j) sum[j] += Load(below + j * stride + i) * xi;
  }
  for (int j = 0; j < kColumns; ++j)
    x[begin + j] = below[j * stride + front.separator] - Sum(sum[j]);
}

// 1/2 |L_ff^T x - rhs|^2.
MLVI_INLINE double Excess(const Front& front, const double* rhs, const double* x) {
  double sum = 0.0;
  for (int j = 0; j < front.frontal; ++j) {
    const double* column = front.panel + static_cast<std::size_t>(j) * front.panel_stride();
    double error = -rhs[j];
    for (int i = j; i < front.frontal; ++i) error += column[i] * x[i];
    sum += error * error;
  }
  return 0.5 * sum;
}

MLVI_INLINE bool Solve(const Front& front, const double* x_separator, double tolerance,
                       const double* x_old, double* x) {
  int j = 0;
  for (; j + kTileColumns <= front.frontal; j += kTileColumns) {
    SubtractSeparator<kTileColumns>(front, j, x_separator, x);
  }
  for (; j < front.frontal; ++j) SubtractSeparator<1>(front, j, x_separator, x);
  if (Excess(front, x, x_old) <= tolerance) return false;
  for (j = front.frontal - 1; j >= 0; --j) {
    const double* column = front.panel + static_cast<std::size_t>(j) * front.panel_stride();
    double value = x[j];
    for (int i = j + 1; i < front.frontal; ++i) value -= column[i] * x[i];
    x[j] = value / column[j];
  }
  return true;
}

// Address of (row, column), row >= column; rows are contiguous within the frontal and the separator
// part.
MLVI_INLINE double* Element(const Front& front, int row, int column) {
  if (column >= front.frontal) {
    return front.remainder +
           static_cast<std::size_t>(column - front.frontal) * front.remainder_stride() +
           (row - front.frontal);
  }
  if (row >= front.frontal) return front.below(column) + (row - front.frontal);
  return front.panel + static_cast<std::size_t>(column) * front.panel_stride() + row;
}
// Doubles from one column to the next, at `column`.
MLVI_INLINE std::size_t ColumnStride(const Front& front, int column) {
  return column >= front.frontal ? front.remainder_stride() : front.panel_stride();
}

MLVI_INLINE void AddTo(double* __restrict out, const double* __restrict in, int size) {
  for (int i = 0; i < size; ++i) out[i] += in[i];
}

MLVI_INLINE void AddColumns(const Front& child, const FrontRun* runs, int run_count, int index,
                            const Front& parent) {
  const FrontRun& columns = runs[index];
  const std::size_t stride = child.remainder_stride(),
                    out_stride = ColumnStride(parent, columns.parent);
  const double* in = child.remainder + columns.child * stride;
  double* diagonal = Element(parent, columns.parent, columns.parent);
  double* right_side = Element(parent, parent.frontal + parent.separator, columns.parent);
  for (int k = 0; k < columns.size; ++k) {
    AddTo(diagonal + k * out_stride + k, in + k * stride + columns.child + k, columns.size - k);
    right_side[k * out_stride] += in[k * stride + child.separator];
  }
  for (int a = index + 1; a < run_count; ++a) {
    const FrontRun& rows = runs[a];
    if (rows.parent > columns.parent) {
      double* out = Element(parent, rows.parent, columns.parent);
      for (int k = 0; k < columns.size; ++k)
        AddTo(out + k * out_stride, in + k * stride + rows.child, rows.size);
    } else {  // the parent's order is the other way round
      double* out = Element(parent, columns.parent, rows.parent);
      const std::size_t row_stride = ColumnStride(parent, rows.parent);
      for (int k = 0; k < columns.size; ++k) {
        for (int r = 0; r < rows.size; ++r)
          out[r * row_stride + k] += in[k * stride + rows.child + r];
      }
    }
  }
}

MLVI_INLINE void Add(const Front& child, const FrontRun* runs, int run_count, const Front& parent) {
  for (int b = 0; b < run_count; ++b) AddColumns(child, runs, run_count, b, parent);
}

MLVI_INLINE void AddBlocks(const double* matrix, int stride, const int* start,
                           const int* coordinate, int count, const Front& front) {
  for (int b = 0; b < count; ++b) {
    const std::size_t out_stride = ColumnStride(front, coordinate[b]);
    const int columns = start[b + 1] - start[b];
    const double* in = matrix + static_cast<std::size_t>(start[b]) * stride;
    for (int a = 0; a < count; ++a) {
      if (coordinate[a] < coordinate[b]) continue;  // symmetric: the lower triangle suffices
      double* out = Element(front, coordinate[a], coordinate[b]);
      const int rows = start[a + 1] - start[a];
      for (int k = 0; k < columns; ++k) {
        const double* column = in + static_cast<std::size_t>(k) * stride + start[a];
        if (rows == 6) {
          AddTo(out + k * out_stride, column, 6);
        } else {
          AddTo(out + k * out_stride, column, rows);
        }
      }
    }
    double* right_side = Element(front, front.frontal + front.separator, coordinate[b]);
    for (int k = 0; k < columns; ++k)
      right_side[k * out_stride] += in[static_cast<std::size_t>(k) * stride + start[count]];
  }
}

MLVI_INLINE void Form(const double* augmented, int rows, int dimension, int stride,
                      double* hessian) {
  for (int column = 0; column < dimension; ++column) {
    double* out = hessian + static_cast<std::size_t>(column) * stride;
    for (int i = 0; i < stride; i += kVectorSize) {
      Vector sum = {};
      const double* row = augmented;
      for (int r = 0; r < rows; ++r, row += stride) sum += Load(row + i) * row[column];
      At(out + i) = sum;
    }
    out[dimension] = -out[dimension];
  }
}

// The loops for one instruction set; see the functions of the same names in the header.
struct Kernels {
  int (*factorize)(const Front&, const double*, double);
  bool (*solve)(const Front&, const double*, double, const double*, double*);
  void (*add_child)(const Front&, const FrontRun*, int, const Front&);
  void (*add_symmetric)(const double*, int, const int*, const int*, int, const Front&);
  void (*form_hessian)(const double*, int, int, int, double*);
};

#define MLVI_DEFINE_KERNELS(Name, kRows, target)                                                   \
  struct Name {                                                                                    \
    target static int RunFactorize(const Front& front, const double* diagonal, double tolerance) { \
      return Factorize<kRows>(front, diagonal, tolerance);                                         \
    }                                                                                              \
    target static bool RunSolve(const Front& front, const double* x_separator, double tolerance,   \
                                const double* x_old, double* x) {                                  \
      return Solve(front, x_separator, tolerance, x_old, x);                                       \
    }                                                                                              \
    target static void RunAdd(const Front& child, const FrontRun* runs, int run_count,             \
                              const Front& parent) {                                               \
      Add(child, runs, run_count, parent);                                                         \
    }                                                                                              \
    target static void RunAddBlocks(const double* matrix, int stride, const int* start,            \
                                    const int* coordinate, int count, const Front& front) {        \
      AddBlocks(matrix, stride, start, coordinate, count, front);                                  \
    }                                                                                              \
    target static void RunForm(const double* augmented, int rows, int dimension, int stride,       \
                               double* hessian) {                                                  \
      Form(augmented, rows, dimension, stride, hessian);                                           \
    }                                                                                              \
    static constexpr Kernels kKernels = {RunFactorize, RunSolve, RunAdd, RunAddBlocks, RunForm};   \
  };

MLVI_DEFINE_KERNELS(Generic, 1, )
#if MLVI_DISPATCH_X86
MLVI_DEFINE_KERNELS(Avx2, 1, __attribute__((target("avx2"))))
MLVI_DEFINE_KERNELS(Avx512, 2, __attribute__((target("avx512f,prefer-vector-width=512"))))
#endif

const Kernels& ChosenKernels() {
#if MLVI_DISPATCH_X86
  if (__builtin_cpu_supports("avx512f")) return Avx512::kKernels;
  if (__builtin_cpu_supports("avx2")) return Avx2::kKernels;
#endif
  return Generic::kKernels;
}

}  // namespace

void AlignedBuffer::Reserve(std::size_t size) {
  if (size <= capacity_) return;
  Release();
  data_ = static_cast<double*>(::operator new(size * sizeof(double), kAlignment));
  capacity_ = size;
}

void AlignedBuffer::Reset(std::size_t size) {
  Reserve(size);
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

void ZeroFront(const Front& front) {
  for (int part = 0; part < 2; ++part) {
    double* column = part == 0 ? front.panel : front.remainder;
    const int columns = part == 0 ? front.frontal : front.separator;
    const int stride = part == 0 ? front.panel_stride() : front.remainder_stride();
    for (int j = 0; j < columns; ++j, column += stride) {
      const int row = VectorRow(j);
      std::memset(column + row, 0, (stride - row) * sizeof(double));
    }
  }
}

void AddChild(const Front& child, const FrontRun* runs, int run_count, const Front& parent) {
  ChosenKernels().add_child(child, runs, run_count, parent);
}

void FormHessian(const double* augmented, int rows, int dimension, int stride, double* hessian) {
  ChosenKernels().form_hessian(augmented, rows, dimension, stride, hessian);
}

void AddSymmetric(const double* matrix, int stride, const int* start, const int* coordinate,
                  int count, const Front& front) {
  ChosenKernels().add_symmetric(matrix, stride, start, coordinate, count, front);
}

int FactorizeFront(const Front& front, const double* diagonal, double tolerance) {
  return ChosenKernels().factorize(front, diagonal, tolerance);
}

bool SolveFront(const Front& front, const double* x_separator, double tolerance,
                const double* x_old, double* x) {
  return ChosenKernels().solve(front, x_separator, tolerance, x_old, x);
}

}  // namespace mlvi::internal
