#pragma once
// A model moved along a direction, made anew by the builder: for differences, by tests.
#include "bielle/dynamics/variation.h"

namespace bielle::testing {

/// `model` with X exp6(step xi) for every placement of the direction, Y + step dY for every inertia. Names its
/// closures' and contacts' frames anew.
Model moveModel(const Model& model, const ModelVariation& direction, double step);

/// The same robot with a sole on every body: forces enough to balance any motion.
Model addContactsEverywhere(const Model& model);

}  // namespace bielle::testing
