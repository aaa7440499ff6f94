#include "bielle/dynamics/rnea.h"

#include "bielle/dynamics/kinematics.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "math/lanes.h"

namespace bielle {
namespace {

// Force of body i, without external forces: Y A + V x* Y V.
template <typename T>
Vector6<T> calcBodyForce(const WorkspaceOf<T>& ws, int i, const Vector6<T>& A) {
  return ws.Y[i] * A + crossForce(ws.V[i], ws.h[i]);
}

// Angular block of B of Eq. (11) for body i.
template <typename T>
void calcB(const WorkspaceOf<T>& ws, int i, double mass, Matrix3<T>& B) {
  if (mass == 0) {
    B.setZero();
    return;
  }
  const Matrix6<T>& Y = ws.Y[i];
  const Vector3<T> v = linear(ws.V[i]), w = angular(ws.V[i]), mc(Y(5, 1), Y(3, 2), Y(4, 0));
  const Matrix3<T> I = Y.template bottomRightCorner<3, 3>(), W = skew(w), cv = mc * v.transpose();
  B.noalias() = W * I - I * W;
  B -= cv + cv.transpose() + skew(angular(ws.h[i]));
  B.diagonal().array() += 2 * mc.dot(v);
}

// Bc x of subtree i.
template <typename T>
Vector6<T> applyB(const WorkspaceOf<T>& ws, int i, const Vector6<T>& x) {
  Vector6<T> out;
  linear(out) = -2 * linear(ws.hc[i]).cross(angular(x));
  angular(out).noalias() = ws.Bc[i] * angular(x);
  return out;
}

// The forces of bodies less those of the springs and dampers between their points.
template <typename T>
void subtractPointSprings(const Model& model, WorkspaceOf<T>& ws) {
  for (const PointSpring& spring : model.pointSprings()) {
    const Vector6<T> W = PointSpringLine<T>(ws, spring).calcWrench();
    ws.F[spring.body1] -= W;
    ws.F[spring.body2] += W;
  }
}

// Generalized forces of the accelerations of the bodies, without rotors, less those of springs, dampers and friction.
template <typename T>
void sumForces(const Model& model, WorkspaceOf<T>& ws, VectorX<T>& out) {
  for (int i = 1; i < model.numBodies(); ++i) ws.F[i] = calcBodyForce(ws, i, ws.A[i]);
  subtractPointSprings(model, ws);
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) out[k] = ws.J.col(k).dot(ws.F[i]);
    if (joint.parent > 0) ws.F[joint.parent] += ws.F[i];
  }
  for (const JointForce& force : model.jointForces()) out[force.dof] -= calcJointForce(force, ws);
}

}  // namespace

template <typename T>
void updateCompositeInertias(const Model& model, WorkspaceOf<T>& ws) {
  requireStage(ws, WorkspaceStage::Position, "updateCompositeInertias", "updatePositions");
  for (int i = 1; i < model.numBodies(); ++i) ws.Yc[i] = ws.Y[i];
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    if (joint.parent > 0) ws.Yc[joint.parent] += ws.Yc[i];
    for (int j = joint.idx_v; j < joint.idx_v + joint.nv; ++j) ws.YJ.col(j).noalias() = ws.Yc[i] * ws.J.col(j);
  }
}

void updateMassMatrix(const Model& model, Workspace& ws) {
  updateCompositeInertias(model, ws);
  for (int j = model.nv() - 1; j >= 0; --j)
    for (int k = j; k >= 0; k = model.dofs()[k].parent) {
      const double m = ws.YJ.col(j).dot(ws.J.col(k));
      ws.M(j, k) = m;
      ws.M(k, j) = m;
    }
  ws.M.diagonal() += ws.armature;
}

template <typename T>
void updateDrift(const Model& model, WorkspaceOf<T>& ws) {
  requireStage(ws, WorkspaceStage::Velocity, "updateDrift", "updateVelocities");
  ws.A[0] << -model.gravity().cast<T>(), Vector3<T>::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    Vector6<T> A = ws.A[joint.parent];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) A += ws.dJ.col(k) * ws.v[k];
    ws.A[i] = A;
  }
  ws.a.setZero();
  ws.stage = WorkspaceStage::Velocity;  // the accelerations written here are those of a = 0
}

void updateBias(const Model& model, Workspace& ws) {
  updateDrift(model, ws);
  sumForces(model, ws, ws.b);
}

template <typename T>
void updateInverseDynamics(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector a) {
  requireStage(ws, WorkspaceStage::Velocity, "updateInverseDynamics", "updateVelocities");
  ws.A[0] << -model.gravity().cast<T>(), Vector3<T>::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    Vector6<T> A = ws.A[joint.parent];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) A += ws.J.col(k) * a[k] + ws.dJ.col(k) * ws.v[k];
    ws.A[i] = A;
  }
  ws.a = a;
  sumForces(model, ws, ws.b);
  ws.b += ws.armature.cwiseProduct(a);
  ws.stage = WorkspaceStage::Velocity;
}

VectorXd calcInverseDynamics(const Model& model, Workspace& ws, ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) {
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  updateAccelerations(model, ws, a);
  VectorXd tau(model.nv());
  sumForces(model, ws, tau);
  return tau + ws.armature.cwiseProduct(a);
}

template <typename T>
void updateInverseDynamicsFactors(const Model& model, WorkspaceOf<T>& ws,
                                  const typename ArgumentsOf<T>::Wrenches& f_ext) {
  requireStage(ws, WorkspaceStage::Acceleration, "updateInverseDynamicsFactors", "updateAccelerations");
  for (const JointForce& force : model.jointForces()) ws.stiffness[force.dof] = ws.resistance[force.dof] = T(0);
  for (const JointForce& force : model.jointForces()) {
    ws.stiffness[force.dof] += force.stiffness;
    ws.resistance[force.dof] += calcResistance<T>(force, ws.v[force.dof]);
  }
  for (int i = 1; i < model.numBodies(); ++i) {
    ws.F[i] = calcBodyForce(ws, i, ws.A[i]);
    if (!f_ext.empty()) ws.F[i] -= f_ext[i];
    ws.Yc[i] = ws.Y[i];
    calcB(ws, i, model.bodies()[i].inertia.mass, ws.Bc[i]);
  }
  subtractPointSprings(model, ws);
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    for (int j = joint.idx_v; j < joint.idx_v + joint.nv; ++j) {
      const Vector6<T> J = ws.J.col(j), dV = ws.dV.col(j), dA = ws.dA.col(j), turn = ws.dJ.col(j) + dV;
      ws.YJ.col(j).noalias() = ws.Yc[i] * J;
      Vector6<T> BtJ;
      linear(BtJ).setZero();
      angular(BtJ).noalias() = ws.Bc[i].transpose() * angular(J);
      angular(BtJ) += 2 * linear(ws.hc[i]).cross(linear(J));
      ws.BtJ.col(j) = BtJ;
      ws.Gv.col(j) = ws.Yc[i] * turn + applyB(ws, i, J);
      ws.Gq.col(j) = ws.Yc[i] * dA + applyB(ws, i, dV) + crossForce(J, ws.F[i]);
    }
    if (joint.parent > 0) {
      ws.F[joint.parent] += ws.F[i];
      ws.Yc[joint.parent] += ws.Yc[i];
      ws.Bc[joint.parent] += ws.Bc[i];
    }
  }
}

namespace {

// Eq. (4) of point_spring.h.
void addPointSpringDerivatives(const Model& model, Workspace& ws, const PointSpring& spring) {
  const PointSpringLine<double> line(ws, spring);
  const Vector6d zero = Vector6d::Zero();
  for (size_t i = 0; i < spring.dofs.size(); ++i) {
    const int k = spring.dofs[i];
    const Vector6d J = ws.J.col(k), dV = ws.dV.col(k);
    const auto change = spring.signs[i] > 0 ? line.calcChange(J, zero, dV, zero) : line.calcChange(zero, J, zero, dV);
    const Vector6d wrench_v = change.wrench_v;
    for (int j : model.supportDofs(spring.body1)) {
      ws.dID_dq(j, k) -= ws.J.col(j).dot(change.wrench1);
      ws.dID_dv(j, k) -= ws.J.col(j).dot(wrench_v);
    }
    for (int j : model.supportDofs(spring.body2)) {
      ws.dID_dq(j, k) += ws.J.col(j).dot(change.wrench2);
      ws.dID_dv(j, k) += ws.J.col(j).dot(wrench_v);
    }
  }
}

}  // namespace

void updateInverseDynamicsDerivatives(const Model& model, Workspace& ws, const std::vector<Vector6d>& f_ext) {
  requireStage(ws, WorkspaceStage::Acceleration, "updateInverseDynamicsDerivatives", "updateAccelerations");
  updateInverseDynamicsFactors(model, ws, f_ext);
  if (!model.pointSprings().empty()) {  // they add to entries of dofs on different paths, which stay zero without them
    ws.dID_dq.setZero();
    ws.dID_dv.setZero();
  }
  const auto write = [&](int j, int k) {
    const auto entry = calcDerivativeEntry(model, ws, j, k);
    ws.dID_dq(j, k) = entry.q;
    ws.dID_dv(j, k) = entry.v;
  };
  for (const Joint& joint : model.joints())
    for (int j = joint.idx_v; j < joint.idx_v + joint.nv; ++j) {
      for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) write(j, k);
      for (int k = model.dofs()[joint.idx_v].parent; k >= 0; k = model.dofs()[k].parent) {
        write(j, k);
        write(k, j);
      }
    }
  for (const PointSpring& spring : model.pointSprings()) addPointSpringDerivatives(model, ws, spring);
}

template void updateCompositeInertias(const Model&, Workspace&);
template void updateCompositeInertias(const Model&, WorkspaceOf<Lanes>&);
template void updateDrift(const Model&, Workspace&);
template void updateDrift(const Model&, WorkspaceOf<Lanes>&);
template void updateInverseDynamics(const Model&, Workspace&, ConstVectorRef);
template void updateInverseDynamics(const Model&, WorkspaceOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector);
template void updateInverseDynamicsFactors(const Model&, Workspace&, const ArgumentsOf<double>::Wrenches&);
template void updateInverseDynamicsFactors(const Model&, WorkspaceOf<Lanes>&, const ArgumentsOf<Lanes>::Wrenches&);

}  // namespace bielle
