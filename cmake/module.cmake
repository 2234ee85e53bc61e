# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
#
# mlvi_module(NAME DEPENDS module... LIBRARIES target... [TEST_LIBRARIES target...])
#
# One folder = one module = one target: all *.cc of the calling folder become the library mlvi_NAME (header-only
# folders an interface library), all *_test.cc one test program mlvi_NAME_test, registered with ctest case by case.
function(mlvi_module name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;LIBRARIES;PRIVATE_LIBRARIES;TEST_LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cc")
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cc$")
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(TRANSFORM ARG_DEPENDS PREPEND "mlvi_" OUTPUT_VARIABLE depends)
  set(target mlvi_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE mlvi_build_options ${ARG_PRIVATE_LIBRARIES})
    target_precompile_headers(${target} PRIVATE "${PROJECT_SOURCE_DIR}/cmake/precompiled.h")
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(mlvi::${name} ALIAS ${target})
  target_include_directories(${target} ${scope} "${PROJECT_SOURCE_DIR}/src")
  target_link_libraries(${target} ${scope} ${depends} ${ARG_LIBRARIES})
  if(tests AND MLVI_BUILD_TESTS)
    mlvi_test(${target}_test SOURCES ${tests} LIBRARIES ${target} ${ARG_TEST_LIBRARIES})
  endif()
endfunction()

# mlvi_test(NAME SOURCES file... LIBRARIES target...): one GoogleTest program.
function(mlvi_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE mlvi_build_options ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main rapidcheck)
  target_precompile_headers(${name} PRIVATE "${PROJECT_SOURCE_DIR}/cmake/precompiled.h" <gtest/gtest.h>)
  include(GoogleTest)
  # RapidCheck draws a new seed each run unless told: a test must fail for everyone or for no one.
  # What tests write lies in the build tree, so that two trees tested at once do not meet.
  set(files "${PROJECT_BINARY_DIR}/test_files")
  file(MAKE_DIRECTORY "${files}")
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT 600 ENVIRONMENT "RC_PARAMS=seed=1" ENVIRONMENT_MODIFICATION "TEST_TMPDIR=set:${files}/")
endfunction()

# Tells the tests `name` where this tree and the public recordings beside it lie. Not for all: a path in the command
# line keeps ccache from sharing objects between trees.
function(mlvi_test_paths name)
  if(TARGET ${name})
    target_compile_definitions(${name} PRIVATE
      MLVI_SOURCE_DIR="${PROJECT_SOURCE_DIR}" MLVI_SHARED_DATA_DIR="${PROJECT_SOURCE_DIR}/../shared/data")
  endif()
endfunction()
