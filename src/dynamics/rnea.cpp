#include "bielle/dynamics/rnea.h"

#include "bielle/dynamics/kinematics.h"

namespace bielle {
namespace {

// Force of body i, without external forces: Y A + V x* Y V.
Vector6d calcBodyForce(const Workspace& ws, int i, const Vector6d& A) {
  return ws.Y[i] * A + crossForce(ws.V[i], ws.h[i]);
}

// Angular block of B of Eq. (11) for body i.
void calcB(const Workspace& ws, int i, double mass, Matrix3d& B) {
  const Matrix6d& Y = ws.Y[i];
  const Vector3d v = ws.V[i].head<3>(), w = ws.V[i].tail<3>(), mc(Y(5, 1), Y(3, 2), Y(4, 0));
  const Matrix3d I = Y.bottomRightCorner<3, 3>(), W = skew(w), cv = mc * v.transpose();
  if (mass == 0) {
    B.setZero();
    return;
  }
  B.noalias() = W * I - I * W;
  B -= cv + cv.transpose() + skew(ws.h[i].tail<3>());
  B.diagonal().array() += 2 * mc.dot(v);
}

// Bc x of subtree i.
Vector6d applyB(const Workspace& ws, int i, const Vector6d& x) {
  Vector6d out;
  out.head<3>() = -2 * ws.hc[i].head<3>().cross(x.tail<3>());
  out.tail<3>().noalias() = ws.Bc[i] * x.tail<3>();
  return out;
}

// Generalized forces of the accelerations of the bodies, rotors left out.
void sumForces(const Model& model, Workspace& ws, VectorXd& out) {
  for (int i = 1; i < model.numBodies(); ++i) ws.F[i] = calcBodyForce(ws, i, ws.A[i]);
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) out[k] = ws.J.col(k).dot(ws.F[i]);
    if (joint.parent > 0) ws.F[joint.parent] += ws.F[i];
  }
}

}  // namespace

void updateCompositeInertias(const Model& model, Workspace& ws) {
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
  ws.M.diagonal() += model.armature();
}

void updateDrift(const Model& model, Workspace& ws) {
  requireStage(ws, WorkspaceStage::Velocity, "updateDrift", "updateVelocities");
  ws.A[0] << -model.gravity(), Vector3d::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    Vector6d A = ws.A[joint.parent];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) A += ws.dJ.col(k) * ws.v[k];
    ws.A[i] = A;
  }
  ws.stage = WorkspaceStage::Velocity;  // the accelerations written here are those of a = 0
}

void updateBias(const Model& model, Workspace& ws) {
  updateDrift(model, ws);
  sumForces(model, ws, ws.b);
}

void updateInverseDynamics(const Model& model, Workspace& ws, ConstVectorRef a) {
  requireStage(ws, WorkspaceStage::Velocity, "updateInverseDynamics", "updateVelocities");
  ws.A[0] << -model.gravity(), Vector3d::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    Vector6d A = ws.A[joint.parent];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) A += ws.J.col(k) * a[k] + ws.dJ.col(k) * ws.v[k];
    ws.A[i] = A;
  }
  sumForces(model, ws, ws.b);
  ws.b += model.armature().cwiseProduct(a);
  ws.stage = WorkspaceStage::Velocity;
}

VectorXd calcInverseDynamics(const Model& model, Workspace& ws, ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) {
  updatePositions(model, ws, q);
  updateVelocities(model, ws, v);
  updateAccelerations(model, ws, a);
  VectorXd tau(model.nv());
  sumForces(model, ws, tau);
  return tau + model.armature().cwiseProduct(a);
}

void updateInverseDynamicsFactors(const Model& model, Workspace& ws, const std::vector<Vector6d>& f_ext) {
  requireStage(ws, WorkspaceStage::Acceleration, "updateInverseDynamicsFactors", "updateAccelerations");
  for (int i = 1; i < model.numBodies(); ++i) {
    ws.F[i] = calcBodyForce(ws, i, ws.A[i]);
    if (!f_ext.empty()) ws.F[i] -= f_ext[i];
    ws.Yc[i] = ws.Y[i];
    calcB(ws, i, model.bodies()[i].inertia.mass, ws.Bc[i]);
  }
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    for (int j = joint.idx_v; j < joint.idx_v + joint.nv; ++j) {
      const Vector6d J = ws.J.col(j), dV = ws.dV.col(j);
      ws.YJ.col(j).noalias() = ws.Yc[i] * J;
      ws.BtJ.col(j).head<3>().setZero();
      ws.BtJ.col(j).tail<3>().noalias() = ws.Bc[i].transpose() * J.tail<3>();
      ws.BtJ.col(j).tail<3>() += 2 * ws.hc[i].head<3>().cross(J.head<3>());
      ws.Gv.col(j).noalias() = ws.Yc[i] * (ws.dJ.col(j) + dV);
      ws.Gv.col(j) += applyB(ws, i, J);
      ws.Gq.col(j).noalias() = ws.Yc[i] * ws.dA.col(j);
      ws.Gq.col(j) += applyB(ws, i, dV);
      ws.Gq.col(j) += crossForce(J, ws.F[i]);
    }
    if (joint.parent > 0) {
      ws.F[joint.parent] += ws.F[i];
      ws.Yc[joint.parent] += ws.Yc[i];
      ws.Bc[joint.parent] += ws.Bc[i];
    }
  }
}

void updateInverseDynamicsDerivatives(const Model& model, Workspace& ws, const std::vector<Vector6d>& f_ext) {
  requireStage(ws, WorkspaceStage::Acceleration, "updateInverseDynamicsDerivatives", "updateAccelerations");
  updateInverseDynamicsFactors(model, ws, f_ext);
  const auto write = [&](int j, int k) {
    const DerivativeEntry entry = calcDerivativeEntry(model, ws, j, k);
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
}

}  // namespace bielle
