#pragma once
// The solution of an assembly problem near a known one, as differences of solutions need it: exact up to rounding.
#include "bielle/dynamics/assembly.h"

namespace bielle {

/// Steps of Eq. (1) of assembly.h without damping, by a complete orthogonal decomposition, from a configuration so near that they
/// need none, until they are as short as rounding lets them be. NotClosed if they do not become short.
AssemblyResult refineAssembly(const Model& model, const AssemblyProblem& problem, ConstVectorRef near);

}  // namespace bielle
