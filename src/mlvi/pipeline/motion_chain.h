// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "mlvi/state/estimates.h"

namespace mlvi {

// The motion from a to c from those a to b and b to c (b is `first.to` and `second.from`); their
// errors are taken as independent.
MotionPrior Compose(const MotionPrior& first, const MotionPrior& second);

// Adds up motions between consecutive estimates to the motion since the last keyframe.
class MotionChain {
 public:
  // Begins at a keyframe.
  void Restart(Time from) {
    from_ = from;
    motion_.reset();
  }
  // Adds the next step; one that does not continue the chain (a failure lies between) breaks it
  // until the next Restart.
  void Extend(const MotionPrior& step);
  // The motion from the keyframe to `to`, when the chain leads from one to the other.
  std::optional<MotionPrior> To(Time to) const;

 private:
  Time from_;
  std::optional<MotionPrior> motion_;
};

}  // namespace mlvi
