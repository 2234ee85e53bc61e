# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# Without this sloppiness ccache refuses every source that uses a precompiled header; without the base directory two
# work trees share nothing.
find_program(MLVI_CCACHE ccache)
if(MLVI_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" CCACHE_NOHASHDIR=1 "${MLVI_CCACHE}")
endif()
find_program(MLVI_MOLD mold)
# GCC 12 learnt -fuse-ld=mold; older compilers keep the system linker.
if(MLVI_MOLD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12.1)
  add_link_options(-fuse-ld=mold)
endif()

# Sanitizer builds: "address" (with undefined behaviour) or "thread"; see CMakePresets.json.
set(MLVI_SANITIZE "" CACHE STRING "Sanitizer to build with: empty, address or thread")
if(MLVI_SANITIZE)
  # Assertions stay on, of Eigen as well; line tables are enough for reports.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1" CACHE STRING "" FORCE)
endif()
if(MLVI_SANITIZE STREQUAL "address")
  add_compile_options(-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  add_link_options(-fsanitize=address,undefined)
elseif(MLVI_SANITIZE STREQUAL "thread")
  add_compile_options(-fsanitize=thread -fno-omit-frame-pointer)
  add_link_options(-fsanitize=thread)
endif()

# Options of our own targets, never of those who link us (used PRIVATE).
add_library(mlvi_build_options INTERFACE)
target_compile_options(mlvi_build_options INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror
  # Designated initialisers name what differs from the defaults; the rest is meant to be left out.
  -Wno-missing-field-initializers
  # GCC 12 reports optionals of Eigen types wrongly.
  -Wno-maybe-uninitialized)
# Results must not depend on how the compiler contracts a*b+c, so that every build type agrees.
target_compile_options(mlvi_build_options INTERFACE -ffp-contract=off)
if(CMAKE_BUILD_TYPE STREQUAL "Debug" OR MLVI_SANITIZE)
  # Uninitialised Eigen matrices hold NaN, so that a read before a write shows.
  target_compile_definitions(mlvi_build_options INTERFACE EIGEN_INITIALIZE_MATRICES_BY_NAN)
endif()
if(MLVI_NATIVE)
  target_compile_options(mlvi_build_options INTERFACE -march=native)
endif()
