#pragma once
// A model changed along a direction, rebuilt by the builder: for finite differences in tests.
#include "bielle/dynamics/variation.h"

namespace bielle::testing {

/// `model` with X exp6(step xi) for every placement of the direction, Y + step dY for every inertia. The frames of
/// closures and contacts get new names.
Model moveModel(const Model& model, const ModelVariation& direction, double step);

/// The same robot with a sole on every body, so that contact forces can balance any motion.
Model addContactsEverywhere(const Model& model);

}  // namespace bielle::testing
