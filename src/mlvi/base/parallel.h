// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Deterministic parallel loops: the split into chunks depends on the problem alone, never on the
// number of threads, and partial results are combined in the order of the chunks. So the same input
// gives the same bits at any thread count.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace mlvi {

// Limits the number of threads of all parallel loops while it lives. Results never depend on it.
class ThreadLimit {
 public:
  // `threads` >= 1; 0 stands for all cores.
  explicit ThreadLimit(int threads)
      : control_(tbb::global_control::max_allowed_parallelism,
                 threads > 0 ? static_cast<std::size_t>(threads)
                             : tbb::global_control::active_value(
                                   tbb::global_control::max_allowed_parallelism)) {}

 private:
  tbb::global_control control_;
};

// Calls body(begin, end) for the chunks [0, grain), [grain, 2 grain), ... of [0, size), in any
// order and in parallel.
template <typename Body>
void ParallelForChunks(std::size_t size, std::size_t grain, const Body& body) {
  if (size == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (size + grain - 1) / grain;
  const auto run = [&](std::size_t chunk) {
    body(chunk * grain, std::min(size, (chunk + 1) * grain));
  };
  if (chunks == 1) return run(0);
  tbb::parallel_for(std::size_t{0}, chunks, run);
}

// Calls body(i) for all i in [0, size). Iterations must not depend on one another.
template <typename Body>
void ParallelFor(std::size_t size, std::size_t grain, const Body& body) {
  ParallelForChunks(size, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

// Sums chunk results in chunk order: result = ((identity + map(chunk 0)) + map(chunk 1)) + ...
// where `map(begin, end)` returns a Result and `combine(result&, const Result&)` adds one.
template <typename Result, typename Map, typename Combine>
Result ParallelReduce(std::size_t size, std::size_t grain, Result identity, const Map& map,
                      const Combine& combine) {
  grain = std::max<std::size_t>(grain, 1);
  std::vector<Result> partial((size + grain - 1) / grain, identity);
  ParallelForChunks(size, grain, [&](std::size_t begin, std::size_t end) {
    partial[begin / grain] = map(begin, end);
  });
  for (const Result& result : partial) combine(identity, result);
  return identity;
}

}  // namespace mlvi
