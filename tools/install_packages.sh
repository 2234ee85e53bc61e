#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the packages that building and testing mlvi needs (Debian 12, Ubuntu 22.04 or 24.04). Asks for sudo only when
# not root and something is missing; does nothing when all is there.
set -euo pipefail

packages=(
  # tools
  build-essential cmake ninja-build ccache python3
  # estimation
  libeigen3-dev libceres-dev libsuitesparse-dev libtbb-dev libnanoflann-dev
  # base
  libfmt-dev libexpected-dev nlohmann-json3-dev libyaml-cpp-dev libcli11-dev
  # recordings and pictures
  librosbag-storage-dev libroslz4-dev pluginlib-dev libbz2-dev liblz4-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-video-dev
  # simulator
  libembree-dev libassimp-dev
  # tests and benchmarks
  libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev
  python3-rosbag # reads simulated bags as ROS does
)
optional=(mold) # a faster linker where the distribution has it

if ! command -v apt-get >/dev/null; then
  echo "install_packages: no apt-get here; mlvi is built on Debian 12 and Ubuntu 22.04/24.04. Install by hand: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}" "${optional[@]}"; do
  dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -q '^installed$' || missing+=("$package")
done
if [ "${#missing[@]}" -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  as_root=(sudo)
fi
echo "install_packages: installing ${missing[*]}"
"${as_root[@]}" apt-get update -q
available=()
for package in "${missing[@]}"; do
  if apt-cache show "$package" >/dev/null 2>&1; then
    available+=("$package")
  elif [[ " ${optional[*]} " != *" $package "* ]]; then
    echo "install_packages: this distribution has no package '$package'" >&2
    exit 1
  fi
done
if [ "${#available[@]}" -gt 0 ]; then
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${available[@]}"
fi
