#include "bielle/dynamics/kinematics.h"

#include "math/lanes.h"
#include "model/joint.h"

namespace bielle {
namespace {

// Spatial inertia of a body in world coordinates.
template <typename T>
void calcWorldInertia(const Inertia& inertia, const SE3Of<T>& X_WB, Matrix6<T>& Y) {
  const Vector3<T> c = X_WB.act(inertia.com.cast<T>());
  const double m = inertia.mass;
  const Matrix3<T> mC = m * skew(c);
  Y.template topLeftCorner<3, 3>() = m * Matrix3<T>::Identity();
  Y.template topRightCorner<3, 3>() = -mC;
  Y.template bottomLeftCorner<3, 3>() = mC;
  Matrix3<T> rotated;
  rotated.noalias() = X_WB.R * inertia.I_com;
  Y.template bottomRightCorner<3, 3>().noalias() = rotated * X_WB.R.transpose();
  Y.template bottomRightCorner<3, 3>() += m * (c.squaredNorm() * Matrix3<T>::Identity() - c * c.transpose());
}

}  // namespace

template <typename T>
void updatePlacements(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector q) {
  ws.q = q;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const SE3Of<T> X_JB = calcJointPlacement<T>(joint, q.segment(joint.idx_q, joint.nq));
    ws.X_WB[i] = ws.X_WB[joint.parent] * joint.X_PJ * X_JB;
  }
  ws.stage = WorkspaceStage::Placement;
}

void updatePositions(const Model& model, Workspace& ws, ConstVectorRef q) {
  updatePlacements(model, ws, q);
  updateColumns(model, ws);
}

template <typename T>
void updateColumns(const Model& model, WorkspaceOf<T>& ws) {
  requireStage(ws, WorkspaceStage::Placement, "updateColumns", "updatePlacements");
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const SE3Of<T>& X = ws.X_WB[i];
    auto J = ws.J.middleCols(joint.idx_v, joint.nv);
    const auto setAxis = [&](int k, const Vector3<T>& axis) { J.col(k) << X.p.cross(axis), axis; };
    switch (joint.kind) {
      case JointKind::Revolute:
      case JointKind::Continuous:
        setAxis(0, X.R * joint.axis);
        break;
      case JointKind::Spherical:
        for (int k = 0; k < 3; ++k) setAxis(k, X.R.col(k));
        break;
      case JointKind::Universal:  // the first axis is fixed in the parent body
        setAxis(0, ws.X_WB[joint.parent].R * (joint.X_PJ.R * joint.axis));
        setAxis(1, X.R * joint.axis2);
        break;
      default: {  // the subspace does not depend on q
        Matrix6d S;
        calcJointSubspace(joint, VectorXd(), S.leftCols(joint.nv));
        for (int k = 0; k < joint.nv; ++k) J.col(k) = X.actMotion(S.col(k).cast<T>());
      }
    }
    if (model.bodies()[i].inertia.mass > 0) calcWorldInertia(model.bodies()[i].inertia, X, ws.Y[i]);
  }
  ws.stage = WorkspaceStage::Position;
}

template <typename T>
void updateVelocities(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector v) {
  requireStage(ws, WorkspaceStage::Position, "updateVelocities", "updatePositions");
  ws.v = v;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const Vector6<T>& V_parent = ws.V[joint.parent];
    const bool sequential = joint.kind == JointKind::Universal;
    Vector6<T> V = V_parent;
    if (!sequential)
      for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) V += ws.J.col(k) * ws.v[k];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) {
      const Vector6<T> J = ws.J.col(k), w_minus = sequential ? V : V_parent, dV = crossMotion(w_minus, J);
      ws.w_minus.col(k) = w_minus;
      ws.dV.col(k) = dV;
      ws.dJ.col(k) = joint.nv == 1 || sequential ? dV : crossMotion(V, J);
      if (sequential) V += J * ws.v[k];
    }
    ws.V[i] = V;
    if (model.bodies()[i].inertia.mass > 0) ws.h[i].noalias() = ws.Y[i] * V;
  }
  ws.hc = ws.h;
  for (int i = model.numBodies() - 1; i > 0; --i) ws.hc[model.joints()[i].parent] += ws.hc[i];
  ws.stage = WorkspaceStage::Velocity;
}

template <typename T>
void updateAccelerations(const Model& model, WorkspaceOf<T>& ws, typename ArgumentsOf<T>::ConstVector a) {
  requireStage(ws, WorkspaceStage::Velocity, "updateAccelerations", "updateVelocities");
  ws.a = a;
  ws.A[0] << -model.gravity().cast<T>(), Vector3<T>::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const Vector6<T>& A_parent = ws.A[joint.parent];
    const bool sequential = joint.kind == JointKind::Universal;
    Vector6<T> A = A_parent;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) {
      const Vector6<T> J = ws.J.col(k), a_minus = sequential ? A : A_parent;
      ws.dA.col(k) = crossMotion(a_minus, J) + crossMotion(ws.w_minus.col(k), ws.dV.col(k));  // Eq. (3)
      A += J * ws.a[k] + ws.dJ.col(k) * ws.v[k];
    }
    ws.A[i] = A;
  }
  ws.stage = WorkspaceStage::Acceleration;
}

template void updatePlacements(const Model&, Workspace&, ConstVectorRef);
template void updatePlacements(const Model&, WorkspaceOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector);
template void updateColumns(const Model&, Workspace&);
template void updateColumns(const Model&, WorkspaceOf<Lanes>&);
template void updateVelocities(const Model&, Workspace&, ConstVectorRef);
template void updateVelocities(const Model&, WorkspaceOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector);
template void updateAccelerations(const Model&, Workspace&, ConstVectorRef);
template void updateAccelerations(const Model&, WorkspaceOf<Lanes>&, ArgumentsOf<Lanes>::ConstVector);

Matrix6Xd calcFrameJacobian(const Model& model, const Workspace& ws, int body, const SE3& X_BF) {
  requireStage(ws, WorkspaceStage::Position, "calcFrameJacobian", "updatePositions");
  Matrix6Xd out = Matrix6Xd::Zero(6, model.nv());
  const SE3 X_WF = getPlacement(ws, body, X_BF);
  for (int k : model.supportDofs(body)) out.col(k) = X_WF.actInvMotion(ws.J.col(k));
  return out;
}

}  // namespace bielle
