// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/motion_chain.h"

#include "mlvi/base/error.h"

namespace mlvi {

MotionPrior Compose(const MotionPrior& first, const MotionPrior& second) {
  MLVI_CHECK(first.to == second.from, "{} and {}", ToString(first.to), ToString(second.from));
  // T1 (+) d1 times T2 is T1 T2 (+) Ad(T2^-1) d1 in the pose chart; d2 stays as it is.
  const Matrix6d J = AdjointSe3(second.T_from_to.inverse());
  return {.from = first.from,
          .to = second.to,
          .T_from_to = first.T_from_to * second.T_from_to,
          .covariance = J * first.covariance * J.transpose() + second.covariance};
}

void MotionChain::Extend(const MotionPrior& step) {
  if (!motion_ && step.from == from_) {
    motion_ = step;
  } else if (motion_ && motion_->to == step.from) {
    motion_ = Compose(*motion_, step);
  } else {
    from_ = Time();
    motion_.reset();
  }
}

std::optional<MotionPrior> MotionChain::To(Time to) const {
  return motion_ && motion_->to == to ? motion_ : std::nullopt;
}

}  // namespace mlvi
