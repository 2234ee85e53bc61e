# SPDX-FileCopyrightText: 2026 The mlvi authors
# SPDX-License-Identifier: Apache-2.0
#
#   make demo   installs packages, builds, simulates a short recording, runs odometry on it, evaluates it
#   make test   installs packages, builds, runs all tests

BUILD := build/release
JOBS ?= $(shell nproc)

.PHONY: demo test build packages format format-check

SOURCES = $(shell find src apps tests benchmarks -name '*.h' -o -name '*.cc')

demo: build
	tools/demo.sh $(BUILD)/mlvi demo

test: build
	ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

build: packages
	cmake --preset release > $(BUILD).log 2>&1 || { cat $(BUILD).log; exit 1; }
	cmake --build $(BUILD) -j $(JOBS)

packages:
	tools/install_packages.sh
	@mkdir -p build

format:
	@clang-format -i $(SOURCES)

format-check:
	@clang-format --dry-run -Werror $(SOURCES)
