#pragma once
// The receding horizon of `bielle bench`.
#include "bench/bench.h"
#include "bielle/motion/benchmark_walk.h"

namespace bielle {

struct RecedingOptions {
  int threads = 1;
  int shifts = 150;           ///< at most, as far as the walk goes
  int nodes = 100;            ///< stages of the horizon
  int first_iterations = 50;  ///< of the plan before the first shift
  BenchmarkWalkOptions walk;
};

RecedingHorizon runRecedingHorizon(const Model& model, Formulation formulation, const RecedingOptions& options);

}  // namespace bielle
