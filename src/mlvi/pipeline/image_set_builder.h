// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

struct ImageSetConfig {
  double tolerance = 0.005;  // s
  double reach = 0.75;       // periods
  double max_wait = 0.1;     // s
  double max_rate = 15.0;    // Hz
  void Declare(ConfigDeclaration& d) {
    d.Field("tolerance", tolerance, "s",
            "Images of different cameras nearer in time than this are of one instant", {0.0, 0.1});
    d.Field("reach", reach, "periods",
            "Images within this part of the shortest period after the first one form a set with "
            "it, each with its own stamp; 0: only those of one instant",
            {0.0, 0.95});
    d.Field("max_wait", max_wait, "s",
            "A set is handed on without a camera whose image is later than this", {0.0, 2.0});
    d.Field("max_rate", max_rate, "Hz",
            "Images beyond this rate per camera are left out before they are decoded; 0 uses all",
            {0.0, 1000.0});
  }
};

// Images of all cameras to sets. Cameras may have different rates, be triggered at different times
// or not at all, lose images or die: a set waits only for cameras that are due, and not for long.
//
// A set takes in what lies within reach of its first image: a part of the shortest period of any
// camera, so that cameras that run freely give one set per period and not one per image. The part is
// more than half: whatever the phase of two cameras, one of them has the other within reach behind
// itself, and that one begins the next sets too, until phases drift or images are lost. Sets do not
// overlap in time.
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
    Time first;  // the earliest stamp
    ImageSet set;
    void Add(Image image);
  };

  std::vector<ImageSet> Release();
  bool IsLate(const Image& image) const;
  bool IsAwaited(int camera, const Pending& pending) const;
  bool IsComplete(const Pending& pending) const;
  Pending& SetOf(const Image& image);
  Pending& BeginSet(const Image& image);
  Duration ShortestPeriod() const;
  Duration Reach() const;

  Duration tolerance_, max_wait_;
  double reach_;  // periods
  std::vector<Stream> streams_;
  std::deque<Pending> pending_;  // by first image
  Time first_, now_;             // first image; newest instant known
  bool ended_ = false;
  Time left_;                            // stamp of the newest set handed on,
  std::vector<std::uint8_t> left_with_;  // and by camera whether it had an image
  std::vector<std::int64_t> late_;
};

}  // namespace mlvi
