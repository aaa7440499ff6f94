#include "moved_model.h"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "bielle/dynamics/kept_motion.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
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

std::string getLink(const Model& model, int body) { return body == 0 ? "world" : model.bodies()[body].name; }

ModelBuilder makeBuilder(const Model& m, const ModelVariation& direction, double step) {
  const auto move = [step](const SE3& X, const Vector6d& twist) { return X * exp6(step * twist); };
  ModelBuilder builder(m.name());
  builder.setGravity(m.gravity());
  for (int i = 1; i < m.numBodies(); ++i) {
    Joint joint = m.joints()[i];
    joint.X_PJ = move(joint.X_PJ, direction.joints[i]);
    const Matrix6d Y = m.bodies()[i].inertia.toMatrix() + step * direction.inertias[i];
    builder.addLink(getLink(m, i), getLink(m, joint.parent), joint, readInertia(Y));
  }
  for (size_t c = 0; c < m.closures().size(); ++c) {
    Closure closure = m.closures()[c];
    closure.X_B1 = move(closure.X_B1, direction.frames1[c]);
    closure.X_B2 = move(closure.X_B2, direction.frames2[c]);
    closure.offset += step * direction.offsets[c];
    for (size_t i = 0; i < closure.terms.size(); ++i)
      closure.terms[i].coefficient += step * direction.coefficients[c][static_cast<Eigen::Index>(i)];
    builder.copyClosure(m, closure);
  }
  for (const Motor& motor : m.motors())
    builder.addMotor(motor.name, motor.armature + step * direction.armature[motor.dof]);
  for (const Joint& joint : m.joints())
    if (joint.nv == 1 && m.findMotor(joint.name) < 0)
      builder.setArmature(joint.name, m.armature()[joint.idx_v] + step * direction.armature[joint.idx_v]);
  for (const JointForce& force : m.jointForces()) builder.addJointForce(m.joints()[force.joint].name, force);
  for (size_t s = 0; s < m.pointSprings().size(); ++s) {
    PointSpring spring = m.pointSprings()[s];
    spring.point1 += step * direction.points1[s];
    spring.point2 += step * direction.points2[s];
    spring.stiffness += step * direction.springs[s][0];
    spring.rest += step * direction.springs[s][1];
    spring.preload += step * direction.springs[s][2];
    spring.damping += step * direction.springs[s][3];
    builder.copyPointSpring(m, spring);
  }
  for (size_t c = 0; c < m.contacts().size(); ++c) {
    const ContactFrame& contact = m.contacts()[c];
    builder.addFrame(contact.name + "/f", getLink(m, contact.body), move(contact.X_BF, direction.contacts[c]));
    builder.addContact(contact.name, contact.name + "/f", contact.kind, contact.half_length, contact.half_width);
  }
  for (size_t s = 0; s < m.shapes().size(); ++s) {
    Shape shape = m.shapes()[s];
    shape.X_BS = move(shape.X_BS, direction.shapes[s].frame);
    shape.half += step * direction.shapes[s].half;
    shape.radius += step * direction.shapes[s].radius;
    builder.addShape(getLink(m, shape.body), shape);
  }
  return builder;
}

}  // namespace

Model moveModel(const Model& model, const ModelVariation& direction, double step) {
  return makeBuilder(model, direction, step).build();
}

Model addContactsEverywhere(const Model& model) {
  ModelBuilder builder = makeBuilder(model, ModelVariation(model), 0);
  for (int i = 1; i < model.numBodies(); ++i)
    builder.addContact("sole of " + getLink(model, i), getLink(model, i), ContactKind::Surface6D, 0.1, 0.05);
  return builder.build();
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
  Workspace ws(model);
  updatePositions(model, ws, q);
  const ConstraintSet loops = makeConstraintSet(model);
  MatrixXd J = MatrixXd::Zero(loops.rows, model.nv());
  for (size_t c = 0; c < loops.closures.size(); ++c)
    calcClosureJacobian(ws, loops.closures[c], J.middleRows(loops.offsets[c], getRows(loops.closures[c].kind)));
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
