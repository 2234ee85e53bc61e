// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

struct ImageSetConfig {
  double tolerance = 0.005;  // s
  double max_wait = 0.1;     // s
  double max_rate = 15.0;    // Hz
  void Declare(ConfigDeclaration& d) {
    d.Field(
        "tolerance", tolerance, "s",
        "Images of different cameras nearer in time than this form a set; each keeps its own stamp",
        {0.0, 0.1});
    d.Field("max_wait", max_wait, "s",
            "A set is handed on without a camera whose image is later than this", {0.0, 2.0});
    d.Field("max_rate", max_rate, "Hz",
            "Images beyond this rate per camera are left out before they are decoded; 0 uses all",
            {0.0, 1000.0});
  }
};

// Images of all cameras to sets of one instant. Cameras may have different rates, be triggered at
// different times, lose images or die: a set waits only for cameras that are due, and not for long.
class ImageSetBuilder {
 public:
  ImageSetBuilder(const ImageSetConfig& config, int cameras);

  // Takes an image; stamps of one camera rise. Returns the sets that need not wait any longer, in
  // order of time, images in order of cameras.
  std::vector<ImageSet> Push(Image image);
  // Tells how far time has come, and returns the sets that have waited long enough.
  std::vector<ImageSet> Advance(Time now);
  // The end: all that is left.
  std::vector<ImageSet> Flush();

  // Images per camera that came after their set had left.
  const std::vector<std::int64_t>& late() const { return late_; }

 private:
  struct Stream {
    Time newest;
    Duration period;  // zero until two images have come
  };
  struct Pending {
    Time anchor;  // stamp of the first image to come
    ImageSet set;
  };

  std::vector<ImageSet> Release();
  bool IsAwaited(int camera, const Pending& pending) const;
  bool IsComplete(const Pending& pending) const;
  Pending& SetOf(const Image& image);

  Duration tolerance_, max_wait_;
  std::vector<Stream> streams_;
  std::deque<Pending> pending_;  // by anchor
  // First image; newest instant known; anchor of the newest set handed on.
  Time first_, now_, left_;
  std::vector<std::int64_t> late_;
};

}  // namespace mlvi
