// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Sweeps as PointCloud2 messages in the layouts of real drivers (RIGS 1.1, 2.1, 3.1).
#pragma once

#include "mlvi/base/time.h"
#include "mlvi/io/ros_serialization.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// Ouster OS0-128 in mode 1024: 128 x 1024 points of 48 bytes, x y z intensity t reflectivity ring
// noise range. Points are put into the row of their ring and the column of their firing time; cells
// without a point are zero.
PointCloud2Data OusterCloud(const LidarSweep& sweep, Duration period);
// Velodyne XYZIRT: points of 22 bytes, returns only, x y z intensity ring time.
PointCloud2Data VelodyneCloud(const LidarSweep& sweep, bool stamp_is_end);
// Hesai PandarXT-32: points of 48 bytes, returns only, x y z intensity timestamp ring.
PointCloud2Data HesaiCloud(const LidarSweep& sweep);

}  // namespace mlvi
