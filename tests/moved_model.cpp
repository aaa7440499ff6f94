#include "moved_model.h"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "loop_jacobian.h"
#include "mechanisms.h"

namespace bielle::testing {
namespace {

Inertia readInertia(const Matrix6d& Y) {
  Inertia out;
  out.mass = Y(0, 0);
  if (out.mass > 0) out.com = Vector3d(Y(5, 1), Y(3, 2), Y(4, 0)) / out.mass;
  const Matrix3d C = skew(out.com);
  out.I_com = Y.bottomRightCorner<3, 3>() + out.mass * C * C;
  return out;
}

ModelParts moveParts(const Model& model, const ModelVariation& direction, double step) {
  const auto move = [step](SE3& X, const Vector6d& twist) { X = X * exp6(step * twist); };
  ModelParts parts = takeParts(model);
  for (size_t i = 1; i < parts.bodies.size(); ++i) {
    move(parts.joints[i].X_PJ, direction.joints[i]);
    Inertia& inertia = parts.bodies[i].inertia;
    inertia = readInertia(inertia.toMatrix() + step * direction.inertias[i]);
  }
  for (size_t c = 0; c < parts.closures.size(); ++c) {
    Closure& closure = parts.closures[c];
    move(closure.X_B1, direction.frames1[c]);
    move(closure.X_B2, direction.frames2[c]);
    closure.offset += step * direction.offsets[c];
    closure.length += step * direction.lengths[c];
    for (size_t i = 0; i < closure.terms.size(); ++i) {
      const VectorXd change = step * direction.coefficients[c].row(static_cast<Eigen::Index>(i));
      CouplerTerm& term = closure.terms[i];
      term.coefficient += change[0];
      term.higher.resize(static_cast<size_t>(change.size()) - 1);
      for (size_t k = 0; k < term.higher.size(); ++k) term.higher[k] += change[static_cast<Eigen::Index>(k) + 1];
    }
  }
  parts.armature += step * direction.armature;
  for (size_t s = 0; s < parts.point_springs.size(); ++s) {
    PointSpring& spring = parts.point_springs[s];
    spring.point1 += step * direction.points1[s];
    spring.point2 += step * direction.points2[s];
    spring.stiffness += step * direction.springs[s][0];
    spring.rest += step * direction.springs[s][1];
    spring.preload += step * direction.springs[s][2];
    spring.damping += step * direction.springs[s][3];
  }
  for (size_t f = 0; f < parts.joint_forces.size(); ++f) {
    JointForce& force = parts.joint_forces[f];
    const Vector5d change = step * direction.joint_forces[f];
    force.stiffness += change[0], force.rest += change[1], force.preload += change[2];
    force.damping += change[3], force.friction += change[4];
  }
  for (size_t c = 0; c < parts.contacts.size(); ++c) move(parts.contacts[c].X_BF, direction.contacts[c]);
  for (size_t s = 0; s < parts.shapes.size(); ++s) {
    Shape& shape = parts.shapes[s];
    shape.fitted = false;  // or else it would be fitted again
    move(shape.X_BS, direction.shapes[s].frame);
    shape.half += step * direction.shapes[s].half;
    shape.radius += step * direction.shapes[s].radius;
  }
  return parts;
}

}  // namespace

Model moveModel(const Model& model, const ModelVariation& direction, double step) {
  return ModelBuilder::restore(moveParts(model, direction, step));
}

Model addContactsEverywhere(const Model& model) {
  ModelParts parts = takeParts(model);
  for (int i = 1; i < model.numBodies(); ++i)
    parts.contacts.push_back({"sole of " + model.bodies()[i].name, i, SE3(), ContactKind::Surface6D, 0.1, 0.05});
  return ModelBuilder::restore(std::move(parts));
}

MatrixXd differentiateModel(const Model& model, const std::vector<ModelVariation>& directions, double h,
                            const std::function<VectorXd(const Model&)>& f) {
  MatrixXd out;
  for (size_t i = 0; i < directions.size(); ++i) {
    const VectorXd column = differentiate(VectorXd::Zero(1), h,
                                          [&](const VectorXd& t) { return f(moveModel(model, directions[i], t[0])); });
    if (i == 0) out.resize(column.size(), static_cast<Eigen::Index>(directions.size()));
    out.col(static_cast<Eigen::Index>(i)) = column;
  }
  return out;
}

std::vector<int> chooseKept(const Model& model, const VectorXd& q) {
  const MatrixXd J = calcLoopJacobian(model, q);
  // Pivots first are the dofs that the loops determine best.
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(1e-7);
  qr.compute(J);
  std::vector<int> kept;
  for (Eigen::Index i = qr.rank(); i < J.cols(); ++i) kept.push_back(qr.colsPermutation().indices()[i]);
  return kept;
}

VectorXd closeHeld(const Model& model, const VectorXd& q, const std::vector<int>& held,
                   const std::vector<ContactTarget>& contacts) {
  Workspace ws(model);
  const ConstraintSet loops = makeConstraintSet(model, contacts);
  updatePositions(model, ws, q);
  const Closing closing(model, ws, loops, held);
  const VectorXd still = VectorXd::Zero(static_cast<Eigen::Index>(held.size()));
  VectorXd d = VectorXd::Zero(model.nv()), residual(loops.rows);
  for (int i = 0; i < 12; ++i) {
    updatePositions(model, ws, model.integrate(q, d));
    for (size_t c = 0; c < loops.closures.size(); ++c)
      residual.segment(loops.offsets[c], getRows(loops.closures[c].kind)) = calcClosureResidual(ws, loops.closures[c]);
    d += closing.solve(residual, still);
  }
  REQUIRE(residual.cwiseAbs().maxCoeff() < 1e-12);
  return d;
}

}  // namespace bielle::testing
