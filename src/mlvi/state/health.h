// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "mlvi/base/time.h"

namespace mlvi {

enum class HealthLevel : int { kHealthy = 0, kDegraded = 1, kFailed = 2 };

// The state of one sensor or subsystem, as data.
struct Health {
  HealthLevel level = HealthLevel::kHealthy;
  std::string reason;  // empty when healthy
};

enum class Severity : int { kInfo = 0, kWarning = 1, kError = 2 };

// Something a user should know: what was found, the numbers, the likely cause, the remedy.
struct Event {
  Time stamp;  // of the recording; invalid when not tied to an instant
  Severity severity = Severity::kInfo;
  std::string source;  // "imu", "lidar", "graph", ...
  std::string message;
};

// Events belong to the instance that raises them; with no subscriber they vanish.
class EventBus {
 public:
  using Subscriber = std::function<void(const Event&)>;
  void Subscribe(Subscriber subscriber) { subscribers_.push_back(std::move(subscriber)); }
  void Raise(const Event& event) const {
    for (const Subscriber& subscriber : subscribers_) subscriber(event);
  }

 private:
  std::vector<Subscriber> subscribers_;
};

}  // namespace mlvi
