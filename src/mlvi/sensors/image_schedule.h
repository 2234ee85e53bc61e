// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>

#include "mlvi/base/time.h"

namespace mlvi {

// Which images of a rig to use when cameras are faster than needed. All cameras keep the same
// instants, so that thinned images still form sets; cameras that are triggered at different times
// are thinned each on its own. Deciding needs no pixels: what is left out need not be decoded.
class ImageSchedule {
 public:
  // `max_rate` Hz, 0: keep all. Images of different cameras within `tolerance` s of one another
  // belong together.
  ImageSchedule(double max_rate, double tolerance);

  // Whether to use the image of this camera and stamp. An image that is not newer than its
  // predecessor is kept: whether the clock jumped is for the Sequencer to judge and to report.
  bool Keep(int camera, Time stamp);

 private:
  bool NearChosen(Time stamp) const;

  Duration min_interval_;
  Duration tolerance_;
  std::map<int, Time> last_kept_;  // by camera
  std::deque<Time> chosen_;        // the newest instants
};

}  // namespace mlvi
