#pragma once
// Singular postures: where loops have fewer independent rows than beside them.
#include "bielle/dynamics/constrained.h"

namespace bielle {

// Mobility at a closed configuration q or, where its loops have more rank beside it, at a closed configuration there.
Mobility calcRegularMobility(const Model& model, ConstVectorRef q);

}  // namespace bielle
