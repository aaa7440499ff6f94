#pragma once
// The receding horizon of `bielle bench`.
#include "bench/bench.h"
#include "motion/benchmark_walk.h"

namespace bielle {

struct ShiftOptions {
  int threads = 1;
  int shifts = 10000;         ///< in as many walks as necessary
  int nodes = 100;            ///< stages of the horizon
  int first_iterations = 50;  ///< of the plan before the first shift
  BenchmarkWalkOptions walk;
};

/// \throws std::invalid_argument when no shift is requested, or the walk is not longer than the horizon
RecedingHorizon runRecedingHorizon(const Model& model, Formulation formulation, const ShiftOptions& options);

}  // namespace bielle
