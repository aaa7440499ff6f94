#pragma once
// The receding horizon of `bielle bench`.
#include "bielle/io/bench.h"

namespace bielle {

RecedingHorizon runRecedingHorizon(const Model& model, Formulation formulation, int threads, int shifts);

}  // namespace bielle
