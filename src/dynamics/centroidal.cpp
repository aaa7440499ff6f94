#include "bielle/dynamics/kinematics.h"
#include "dynamics/energy.h"

namespace bielle {

Vector3d calcCom(const Model& model, const Workspace& ws) {
  requireStage(ws, WorkspaceStage::Placement, "calcCom", "updatePlacements or updatePositions");
  return calcComOf(model, ws);
}

Vector3d calcComVelocity(const Model& model, const Workspace& ws) {
  requireBodyVelocities(ws, "calcComVelocity");
  return ws.hc[0].head<3>() / model.mass();
}

void calcComJacobian(const Model& model, const Workspace& ws, Eigen::Ref<Eigen::Matrix3Xd> J) {
  requireStage(ws, WorkspaceStage::Position, "calcComJacobian", "updatePositions");
  // A dof moves its subtree rigidly: momentum Yc J_k.
  J = ws.YJ.topRows<3>() / model.mass();
}

void calcComVelocityDerivative(const Model& model, const Workspace& ws, Eigen::Ref<Eigen::Matrix3Xd> dv_dq) {
  requireStage(ws, WorkspaceStage::Velocity, "calcComVelocityDerivative", "updateVelocities");
  // d h_i / dq_k in the world is Y_i dV_k + J_k x* h_i (Eq. (2) of rnea.h), summed over the subtree of k.
  for (int k = 0; k < model.nv(); ++k) {
    const int i = model.dofs()[k].joint;
    dv_dq.col(k) = (ws.Yc[i] * ws.dV.col(k) + crossForce(ws.J.col(k), ws.hc[i])).head<3>() / model.mass();
  }
}

Vector6d calcCentroidalMomentum(const Model& model, const Workspace& ws) {
  requireBodyVelocities(ws, "calcCentroidalMomentum");
  Vector6d h = ws.hc[0];
  h.tail<3>() -= calcCom(model, ws).cross(h.head<3>());
  return h;
}

double calcKineticEnergy(const Model& model, const Workspace& ws) {
  requireStage(ws, WorkspaceStage::Velocity, "calcKineticEnergy", "updateVelocities");
  return calcKineticEnergyOf(model, ws);
}

double calcPotentialEnergy(const Model& model, const Workspace& ws) { return calcPotentialEnergyOf(model, ws); }

}  // namespace bielle
