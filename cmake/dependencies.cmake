# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
#
# Every library that mlvi stands on, each with its reason. Packages of Debian 12 and Ubuntu 22.04/24.04
# only (tools/install_packages.sh names them); nothing is downloaded here.

find_package(Threads REQUIRED)
# Linear algebra everywhere.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
# Deterministic parallel loops inside stages (base/parallel.h).
find_package(TBB REQUIRED)
# Formatting of messages.
find_package(fmt REQUIRED)
# Factors are ceres::CostFunction; batch solving as the oracle of the smoother. 2.0 is Ubuntu 22.04's.
find_package(Ceres 2.0 REQUIRED)
# Configuration and rig files.
find_package(yaml-cpp REQUIRED)
# summary.json, sequence.json, --json.
find_package(nlohmann_json 3.10 REQUIRED)
# Command line of the applications.
find_package(CLI11 REQUIRED)
# k-nearest neighbours of small static clouds.
find_package(nanoflann REQUIRED)
# Pictures (PNG) of maps, image decoding; corners and pyramidal optical flow of the cameras (imgproc, video).
# By module, not by OpenCVConfig.cmake: that lies in a package which draws in every OpenCV module and VTK.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(component core imgproc imgcodecs video)
  find_library(OPENCV_${component}_LIBRARY opencv_${component} REQUIRED)
  add_library(opencv_${component} UNKNOWN IMPORTED)
  set_target_properties(opencv_${component} PROPERTIES IMPORTED_LOCATION "${OPENCV_${component}_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OPENCV_INCLUDE_DIR}")
endforeach()
# Ray tracing of the simulator; version 3 (Debian 12, Ubuntu 22.04) or 4 (Ubuntu 24.04).
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 REQUIRED)
endif()
# Own worlds of the simulator: meshes with their pictures in any common format.
find_package(assimp REQUIRED)
# Fill-reducing constrained ordering of the incremental smoother (CCOLAMD); SuiteSparse of Debian has no
# CMake package of its own.
find_path(CCOLAMD_INCLUDE_DIR ccolamd.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CCOLAMD_LIBRARY ccolamd REQUIRED)
# ROS 1 bags without a ROS installation. The libraries by name: the packages' own CMake and pkg-config
# files demand all of catkin's dependencies.
add_library(mlvi_ros1 INTERFACE)
find_path(ROSBAG_INCLUDE_DIR rosbag/bag.h REQUIRED)
target_include_directories(mlvi_ros1 SYSTEM INTERFACE "${ROSBAG_INCLUDE_DIR}")
# pluginlib, which rosbag/bag.h includes, puts its headers in folders of their own on Debian 12.
foreach(package pluginlib class_loader rcpputils rcutils ament_index_cpp)
  if(IS_DIRECTORY "/usr/include/${package}/${package}")
    target_include_directories(mlvi_ros1 SYSTEM INTERFACE "/usr/include/${package}")
    find_library(ROS1_${package}_LIBRARY ${package})
    if(ROS1_${package}_LIBRARY)
      target_link_libraries(mlvi_ros1 INTERFACE "${ROS1_${package}_LIBRARY}")
    endif()
  endif()
endforeach()
foreach(library rosbag_storage cpp_common rostime roscpp_serialization console_bridge boost_filesystem boost_system)
  find_library(ROS1_${library}_LIBRARY ${library} REQUIRED)
  target_link_libraries(mlvi_ros1 INTERFACE "${ROS1_${library}_LIBRARY}")
endforeach()
if(MLVI_BUILD_TESTS)
  find_package(GTest REQUIRED)
  # Property tests: laws over generated values.
  find_package(rapidcheck REQUIRED)
endif()
if(MLVI_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()
