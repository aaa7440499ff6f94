#include "model_copy.h"

#include "bielle/model/builder.h"
#include "math/decompositions.h"

namespace bielle::validation {

Model makeModelWithoutArmature(const Model& model, double least) {
  ModelParts parts = takeParts(model);
  parts.armature.setZero();
  for (size_t i = 1; i < parts.bodies.size(); ++i) {
    Inertia& inertia = parts.bodies[i].inertia;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> moments(inertia.I_com, Eigen::EigenvaluesOnly);
    if (moments.eigenvalues()[0] > least) continue;
    Inertia ballast;
    ballast.mass = 0.01;
    ballast.I_com = 1e-4 * Matrix3d::Identity();
    inertia = inertia + ballast;
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle::validation
