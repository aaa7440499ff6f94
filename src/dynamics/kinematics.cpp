#include "bielle/dynamics/kinematics.h"

namespace bielle {
namespace {

// Spatial inertia of a body in world coordinates.
void calcWorldInertia(const Inertia& inertia, const SE3& X_WB, Matrix6d& Y) {
  const Vector3d c = X_WB.act(inertia.com);
  const double m = inertia.mass;
  const Matrix3d C = skew(c);
  Y.topLeftCorner<3, 3>() = m * Matrix3d::Identity();
  Y.topRightCorner<3, 3>() = -m * C;
  Y.bottomLeftCorner<3, 3>() = m * C;
  Matrix3d T;
  T.noalias() = X_WB.R * inertia.I_com;
  Y.bottomRightCorner<3, 3>().noalias() = T * X_WB.R.transpose();
  Y.bottomRightCorner<3, 3>() += m * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
}

}  // namespace

void updatePlacements(const Model& model, Workspace& ws, ConstVectorRef q) {
  ws.q = q;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    ws.X_WB[i] = ws.X_WB[joint.parent] * (joint.X_PJ * calcJointPlacement(joint, q.segment(joint.idx_q, joint.nq)));
  }
  ws.stage = WorkspaceStage::Placement;
}

void updatePositions(const Model& model, Workspace& ws, ConstVectorRef q) {
  updatePlacements(model, ws, q);
  updateColumns(model, ws);
}

void updateColumns(const Model& model, Workspace& ws) {
  requireStage(ws, WorkspaceStage::Placement, "updateColumns", "updatePlacements");
  Matrix6d S;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    const SE3& X = ws.X_WB[i];
    auto J = ws.J.middleCols(joint.idx_v, joint.nv);
    switch (joint.kind) {
      case JointKind::Revolute:
      case JointKind::Continuous:
        J.col(0).tail<3>().noalias() = X.R * joint.axis;
        J.col(0).head<3>() = X.p.cross(J.col(0).tail<3>());
        break;
      case JointKind::Spherical:
        J.bottomRows<3>() = X.R;
        for (int k = 0; k < 3; ++k) J.col(k).head<3>() = X.p.cross(X.R.col(k));
        break;
      case JointKind::Universal:  // the first axis rests in what carries the joint
        J.col(0).tail<3>().noalias() = ws.X_WB[joint.parent].R * (joint.X_PJ.R * joint.axis);
        J.col(1).tail<3>().noalias() = X.R * joint.axis2;
        for (int k = 0; k < 2; ++k) J.col(k).head<3>() = X.p.cross(J.col(k).tail<3>());
        break;
      default:
        calcJointSubspace(joint, ws.q.segment(joint.idx_q, joint.nq), S.leftCols(joint.nv));
        for (int k = 0; k < joint.nv; ++k) J.col(k) = X.actMotion(S.col(k));
    }
    if (model.bodies()[i].inertia.mass > 0) calcWorldInertia(model.bodies()[i].inertia, X, ws.Y[i]);
  }
  ws.stage = WorkspaceStage::Position;
}

void updateVelocities(const Model& model, Workspace& ws, ConstVectorRef v) {
  requireStage(ws, WorkspaceStage::Position, "updateVelocities", "updatePositions");
  ws.v = v;
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    ws.V[i] = ws.V[joint.parent];
    const bool sequential = joint.kind == JointKind::Universal;
    if (!sequential)
      for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) ws.V[i] += ws.J.col(k) * v[k];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) {
      const Vector6d w_minus = sequential ? ws.V[i] : ws.V[joint.parent];
      ws.w_minus.col(k) = w_minus;
      ws.dV.col(k) = crossMotion(w_minus, ws.J.col(k));
      ws.dJ.col(k) = joint.nv == 1 || sequential ? Vector6d(ws.dV.col(k)) : crossMotion(ws.V[i], ws.J.col(k));
      if (sequential) ws.V[i] += ws.J.col(k) * v[k];
    }
    if (model.bodies()[i].inertia.mass > 0) ws.h[i].noalias() = ws.Y[i] * ws.V[i];
  }
  ws.hc = ws.h;
  for (int i = model.numBodies() - 1; i > 0; --i) ws.hc[model.joints()[i].parent] += ws.hc[i];
  ws.stage = WorkspaceStage::Velocity;
}

void updateAccelerations(const Model& model, Workspace& ws, ConstVectorRef a) {
  requireStage(ws, WorkspaceStage::Velocity, "updateAccelerations", "updateVelocities");
  ws.a = a;
  ws.A[0] << -model.gravity(), Vector3d::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    ws.A[i] = ws.A[joint.parent];
    const bool sequential = joint.kind == JointKind::Universal;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k) {
      const Vector6d a_minus = sequential ? ws.A[i] : ws.A[joint.parent];
      ws.dA.col(k) = crossMotion(a_minus, ws.J.col(k)) + crossMotion(ws.w_minus.col(k), ws.dV.col(k));  // Eq. (3)
      ws.A[i] += ws.J.col(k) * a[k] + ws.dJ.col(k) * ws.v[k];
    }
  }
  ws.stage = WorkspaceStage::Acceleration;
}

Matrix6Xd calcFrameJacobian(const Model& model, const Workspace& ws, int body, const SE3& X_BF) {
  requireStage(ws, WorkspaceStage::Position, "calcFrameJacobian", "updatePositions");
  Matrix6Xd out = Matrix6Xd::Zero(6, model.nv());
  const SE3 X_WF = getPlacement(ws, body, X_BF);
  for (int k : model.supportDofs(body)) out.col(k) = X_WF.actInvMotion(ws.J.col(k));
  return out;
}

}  // namespace bielle
