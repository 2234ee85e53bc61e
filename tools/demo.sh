#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
#
# demo.sh MLVI DIR: simulates a short handheld recording, runs the odometry on it and evaluates the result.
set -euo pipefail
mlvi=$1
out=$2

echo "== 1/3 simulate: 20 s around a courtyard with an OS0-128 and an IMU"
"$mlvi" simulate courtyard-easy --rig newer_college --seconds 20 --seed 1 --cameras none --compression lz4 -o "$out/recording"
echo "== 2/3 run: trajectory and map from the recording"
"$mlvi" run "$out/recording/courtyard-easy.bag" --rig "$out/recording/rig.yaml" -o "$out/result"
echo "== 3/3 evaluate against the simulator's truth"
"$mlvi" evaluate "$out/result/trajectory.tum" "$out/recording/groundtruth.tum"
cat <<EOF

Results in $out/result:
  trajectory.tum  final trajectory (body = IMU pose in world)     odometry.tum  what a robot would have had
  map.ply         point cloud of the keyframes                    map.png       picture of map and trajectory
  summary.json    report: status, health, times, counts           config.yaml   the resolved configuration
EOF
