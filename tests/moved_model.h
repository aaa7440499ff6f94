#pragma once
// A model changed along a direction, rebuilt by the builder: for finite differences in tests.
#include <functional>

#include "bielle/dynamics/variation.h"

namespace bielle::testing {

/// `model` with X exp6(step xi) for every placement of the direction, Y + step dY for every inertia. The frames of
/// closures and contacts get new names.
Model moveModel(const Model& model, const ModelVariation& direction, double step);

/// The same robot with a sole on every body, so that contact forces can balance any motion.
Model addContactsEverywhere(const Model& model);

/// Central differences of fourth order of f(moved model), one column per direction.
MatrixXd differentiateModel(const Model& model, const std::vector<ModelVariation>& directions, double h,
                            const std::function<VectorXd(const Model&)>& f);
/// A step for it.
inline constexpr double kModelStep = 2e-4;

/// As many dofs as the loops leave free, those that determine the others best.
std::vector<int> chooseKept(const Model& model, const VectorXd& q);

/// d with q (+) d closed and held dofs at zero, from a configuration nearby; with contacts, these stay where they are.
VectorXd closeHeld(const Model& model, const VectorXd& q, const std::vector<int>& held,
                   const std::vector<ContactTarget>& contacts = {});

}  // namespace bielle::testing
