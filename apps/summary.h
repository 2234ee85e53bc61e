// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "mlvi/pipeline/slam.h"
#include "mlvi/sensors/measurement_source.h"
#include "run_judgement.h"

// What one run was, beside what the Slam instance knows itself.
struct RunFacts {
  Verdict verdict;
  std::vector<std::string> bags;
  std::string rig;
  std::vector<std::string> notes;  // findings of the reader
  std::vector<mlvi::Event> events;
  std::map<std::string, mlvi::StreamCounts> read;
  double data_duration_s = 0.0;
  double wall_s = 0.0;
};

// The report of a run, as written to summary.json. docs/outputs.md tells every key: keep it so (a
// test compares them).
nlohmann::ordered_json MakeSummary(const RunFacts& facts, const mlvi::Slam& slam,
                                   const mlvi::Rig& rig, const mlvi::WindowConfig& window);
