#include "bielle/dynamics/kinematics.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"

namespace bielle {

Vector3d calcCom(const Model& model, const Workspace& ws) {
  requireStage(ws, WorkspaceStage::Placement, "calcCom", "updatePlacements or updatePositions");
  Vector3d sum = Vector3d::Zero();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Inertia& inertia = model.bodies()[i].inertia;
    sum += inertia.mass * ws.X_WB[i].act(inertia.com);
  }
  return sum / model.mass();
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
  double energy = 0.5 * model.armature().dot(ws.v.cwiseAbs2());
  for (int i = 1; i < model.numBodies(); ++i) energy += 0.5 * ws.V[i].dot(ws.h[i]);
  return energy;
}

double calcPotentialEnergy(const Model& model, const Workspace& ws) {
  double energy = -model.mass() * model.gravity().dot(calcCom(model, ws));
  for (const JointForce& force : model.jointForces()) energy += calcSpringEnergy(force, ws.q);
  for (const PointSpring& spring : model.pointSprings()) energy += calcSpringEnergy(spring, ws);
  return energy;
}

}  // namespace bielle
