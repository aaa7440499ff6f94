#pragma once
/// \file A copy of a model without its rotors, for Simbody.
#include "bielle/model/model.h"

namespace bielle::validation {

/// The model in a form that Simbody's own solver accepts: no armature, and bodies whose inertia could leave a joint
/// without any (a principal moment below `least`, kg m^2) ballasted by 10 g with moments of 1e-4 kg m^2.
Model makeModelWithoutArmature(const Model& model, double least = 1e-9);

}  // namespace bielle::validation
