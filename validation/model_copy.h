#pragma once
/// \file A model built anew from another one, with changes: without its rotors for Simbody, or wrong on purpose.
#include <functional>

#include "bielle/model/model.h"

namespace bielle::validation {

struct ModelChanges {
  double armature_scale = 1;                         ///< 0 removes the rotors
  std::function<void(int body, Inertia&)> inertia;   ///< changes the inertia of a body
  std::function<void(int index, Closure&)> closure;  ///< changes a closure
};

/// Bodies, joints, closures, motors and contacts; references, visuals and limits stay behind.
Model copyModel(const Model& model, const ModelChanges& changes = {});

/// The model as Simbody's own solver can take it: no armature, and bodies whose inertia alone could leave a joint
/// without any (a principal moment below `least`, kg m^2) ballasted by 10 g with moments of 1e-4 kg m^2.
Model makeModelWithoutArmature(const Model& model, double least = 1e-9);

}  // namespace bielle::validation
