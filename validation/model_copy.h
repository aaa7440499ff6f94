#pragma once
/// \file A copy of a model with changes: without its rotors for Simbody, or deliberately wrong.
#include <functional>

#include "bielle/model/model.h"

namespace bielle::validation {

struct ModelChanges {
  double armature_scale = 1;                         ///< 0 removes the rotors
  std::function<void(int body, Inertia&)> inertia;   ///< changes the inertia of a body
  std::function<void(int index, Closure&)> closure;  ///< changes a closure
};

/// Copies bodies, joints, closures, motors and contacts, but not references, visuals and limits.
Model copyModel(const Model& model, const ModelChanges& changes = {});

/// The model in a form that Simbody's own solver accepts: no armature, and bodies whose inertia could leave a joint
/// without any (a principal moment below `least`, kg m^2) ballasted by 10 g with moments of 1e-4 kg m^2.
Model makeModelWithoutArmature(const Model& model, double least = 1e-9);

}  // namespace bielle::validation
