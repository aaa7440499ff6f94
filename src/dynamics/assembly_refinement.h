#pragma once
// Assembly problems of special use.
#include "bielle/dynamics/assembly.h"

namespace bielle {

/// assemble() of joints under a free base that stays where `problem.q_ref` has it, by steps that are AssemblyStep::Shortest: legs
/// are then solved one by one.
AssemblyResult assembleUnderBase(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options);

/// The solution of a problem near a known one, as differences of solutions need it: exact up to rounding. Steps of Eq. (1) of
/// assembly.h without damping, by a complete orthogonal decomposition, from a configuration so near that they need none, until they
/// are as short as rounding lets them be. NotClosed if they do not become short.
AssemblyResult refineAssembly(const Model& model, const AssemblyProblem& problem, ConstVectorRef near);

}  // namespace bielle
