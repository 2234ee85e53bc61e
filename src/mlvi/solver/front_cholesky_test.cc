// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/solver/front_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/base/random.h"

namespace mlvi::internal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct FrontCase {
  int frontal, separator;
};

// A positive definite system and the front that holds it.
struct FrontFixture {
  FrontFixture(int frontal, int separator) {
    RandomStream random(100 * frontal + separator, "front");
    const int n = frontal + separator;
    MatrixXd A(n, n + 3);
    for (double& x : A.reshaped()) x = random.Normal();
    H = A * A.transpose() + MatrixXd::Identity(n, n);
    b.resize(n);
    for (double& x : b) x = random.Normal();
    front.frontal = frontal;
    front.separator = separator;
    panel.Reset(front.panel_size());
    remainder.Reset(front.remainder_size());
    front.panel = panel.data();
    front.remainder = remainder.data();
    for (int j = 0; j < frontal; ++j) {
      for (int i = j; i < frontal; ++i) front.panel[j * front.panel_stride() + i] = H(i, j);
      for (int i = 0; i < separator; ++i) front.below(j)[i] = H(frontal + i, j);
      front.below(j)[separator] = b(j);
    }
    for (int j = 0; j < separator; ++j) {
      double* column = front.remainder + j * front.remainder_stride();
      for (int i = j; i < separator; ++i) column[i] = H(frontal + i, frontal + j);
      column[separator] = b(frontal + j);
    }
  }
  MatrixXd H;
  VectorXd b;
  Front front;
  AlignedBuffer panel, remainder;
};

class FrontCholesky : public testing::TestWithParam<FrontCase> {};

TEST_P(FrontCholesky, FactorisesLikeEigenAndLeavesTheSchurComplement) {
  const auto [nf, ns] = GetParam();
  FrontFixture f(nf, ns);
  ASSERT_EQ(FactorizeFront(f.front, f.H.diagonal().eval().data(), 1e-14), -1);

  const MatrixXd L = f.H.llt().matrixL();
  const MatrixXd schur = f.H.bottomRightCorner(ns, ns) -
                         L.bottomLeftCorner(ns, nf) * L.bottomLeftCorner(ns, nf).transpose();
  const VectorXd y = L.topLeftCorner(nf, nf).triangularView<Eigen::Lower>().solve(f.b.head(nf));
  const VectorXd rest = f.b.tail(ns) - L.bottomLeftCorner(ns, nf) * y;
  const double tolerance = 1e-12 * f.H.norm();
  for (int j = 0; j < nf; ++j) {
    for (int i = j; i < nf; ++i)
      EXPECT_NEAR(f.front.panel[j * f.front.panel_stride() + i], L(i, j), tolerance);
    for (int i = 0; i < ns; ++i) EXPECT_NEAR(f.front.below(j)[i], L(nf + i, j), tolerance);
    EXPECT_NEAR(f.front.below(j)[ns], y(j), tolerance);
  }
  for (int j = 0; j < ns; ++j) {
    const double* column = f.front.remainder + j * f.front.remainder_stride();
    for (int i = j; i < ns; ++i) EXPECT_NEAR(column[i], schur(i, j), tolerance);
    EXPECT_NEAR(column[ns], rest(j), tolerance);
  }
}

TEST_P(FrontCholesky, SolvesForTheFrontalPart) {
  const auto [nf, ns] = GetParam();
  FrontFixture f(nf, ns);
  const VectorXd x = f.H.llt().solve(f.b);
  ASSERT_EQ(FactorizeFront(f.front, f.H.diagonal().eval().data(), 1e-14), -1);
  AlignedBuffer separator;
  separator.Reset(f.front.remainder_stride());
  for (int i = 0; i < ns; ++i) separator.data()[i] = x(nf + i);
  VectorXd frontal(nf);
  const VectorXd zero = VectorXd::Zero(nf);
  ASSERT_TRUE(SolveFront(f.front, separator.data(), 0.0, zero.data(), frontal.data()));
  EXPECT_LT((frontal - x.head(nf)).norm(), 1e-9 * x.norm());
}

// With the separator fixed, the objective at x + d is 1/2 d^T H_ff d above its minimum.
TEST_P(FrontCholesky, SolvesOnlyWhenTheOldStepCostsMoreThanTheTolerance) {
  const auto [nf, ns] = GetParam();
  FrontFixture f(nf, ns);
  const VectorXd x = f.H.llt().solve(f.b);
  ASSERT_EQ(FactorizeFront(f.front, f.H.diagonal().eval().data(), 1e-14), -1);
  AlignedBuffer separator;
  separator.Reset(f.front.remainder_stride());
  for (int i = 0; i < ns; ++i) separator.data()[i] = x(nf + i);
  const VectorXd d = VectorXd::LinSpaced(nf, 0.5, 1.0);
  const VectorXd old = x.head(nf) + d;
  const double cost = 0.5 * d.dot(f.H.topLeftCorner(nf, nf) * d);
  VectorXd frontal(nf);
  EXPECT_FALSE(
      SolveFront(f.front, separator.data(), cost * (1.0 + 1e-6), old.data(), frontal.data()));
  EXPECT_TRUE(
      SolveFront(f.front, separator.data(), cost * (1.0 - 1e-6), old.data(), frontal.data()));
  EXPECT_LT((frontal - x.head(nf)).norm(), 1e-9 * x.norm());
}

TEST(FormHessian, EqualsEigen) {
  for (const auto& [rows, dimension] : {std::pair{1, 3}, {6, 12}, {15, 30}, {31, 30}, {2, 7}}) {
    RandomStream random(rows, "augmented");
    const int stride = PadRows(dimension + 1);
    AlignedBuffer augmented, hessian;
    augmented.Reset(static_cast<std::size_t>(rows) * stride);
    hessian.Reserve(static_cast<std::size_t>(dimension) * stride);
    MatrixXd A(rows, dimension + 1);
    for (double& x : A.reshaped()) x = random.Normal();
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c <= dimension; ++c) augmented.data()[r * stride + c] = A(r, c);
    }
    FormHessian(augmented.data(), rows, dimension, stride, hessian.data());
    const Eigen::Map<const MatrixXd> H(hessian.data(), stride, dimension);
    MatrixXd expected = A.transpose() * A.leftCols(dimension);
    expected.row(dimension) *= -1.0;
    EXPECT_LT((H.topRows(dimension + 1) - expected).norm(), 1e-13 * expected.norm());
    EXPECT_EQ(H.bottomRows(stride - dimension - 1).cwiseAbs().sum(), 0.0);
  }
}

TEST_P(FrontCholesky, NamesTheFirstColumnThatIsNotPositive) {
  const auto [nf, ns] = GetParam();
  for (const int bad : {0, nf / 2, nf - 1}) {
    FrontFixture f(nf, ns);
    const VectorXd diagonal = f.H.diagonal();
    f.front.panel[bad * f.front.panel_stride() + bad] = -1.0;
    EXPECT_EQ(FactorizeFront(f.front, diagonal.data(), 1e-14), bad);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, FrontCholesky,
                         testing::Values(FrontCase{1, 0}, FrontCase{1, 1}, FrontCase{6, 0},
                                         FrontCase{6, 6}, FrontCase{5, 9}, FrontCase{8, 7},
                                         FrontCase{13, 24}, FrontCase{30, 1}, FrontCase{48, 151},
                                         FrontCase{97, 33}));

}  // namespace
}  // namespace mlvi::internal
