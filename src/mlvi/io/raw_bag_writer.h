// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/io/ros_serialization.h"

namespace mlvi {

enum class BagCompression : int { kNone = 0, kBz2 = 1, kLz4 = 2 };

// Writes serialised messages to a ROS 1 bag, through rosbag_storage. Errors are those of
// CannotWrite (whole_file.h).
class RawBagWriter {
 public:
  static Expected<std::unique_ptr<RawBagWriter>> Create(const std::string& path,
                                                        BagCompression compression);
  ~RawBagWriter();
  RawBagWriter(const RawBagWriter&) = delete;
  RawBagWriter& operator=(const RawBagWriter&) = delete;

  Expected<void> Write(const std::string& topic, Time receipt, const RosMessage& message);
  // Writes the index and ends the file.
  Expected<void> Close();

 private:
  class Impl;
  explicit RawBagWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mlvi
