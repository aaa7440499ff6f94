#pragma once
/// \file A Model in MuJoCo, by the file that `bielle convert` writes (formats/mjcf.h), and its coordinates there.
#include <mujoco/mujoco.h>

#include <memory>

#include "bielle/model/model.h"
#include "formats/mjcf.h"

namespace bielle {

/// Errors of MuJoCo, whose default is to end the program, are thrown as std::runtime_error once there is a MujocoModel.
class MujocoModel {
 public:
  /// \param q_ref    closed configuration (nq) at which the loops are tied
  /// \param options  with rotations as balls
  /// \throws InputError with MuJoCo's message when it refuses the robot
  MujocoModel(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options = {});

  const mjModel* get() const { return mj_.get(); }
  mjModel* get() { return mj_.get(); }
  std::unique_ptr<mjData, void (*)(mjData*)> makeData() const;

  /// Index of a body of the model among MuJoCo's.
  int getBody(int body) const { return bodies_[body]; }
  /// Index of the first coordinate of velocity of a joint among MuJoCo's.
  int getDof(int joint) const { return idx_v_[joint]; }
  /// Sets qpos and qvel.
  void setState(ConstVectorRef q, ConstVectorRef v, mjData& data) const;
  /// Sets qfrc_applied to generalized forces tau (nv) at q.
  void setForces(ConstVectorRef q, ConstVectorRef tau, mjData& data) const;
  /// q (nq) and v (nv) of qpos and qvel.
  void getState(const mjData& data, VectorRef q, VectorRef v) const;

  /// MuJoCo's mass matrix (nv x nv) and bias (nv) in the coordinates of notation.h, after mj_forward.
  /// With qvel = T v:  M = T' M_m T,  b = T' (b_m + (M_m - A) dT/dt v). A is the armature, which the model adds to the
  /// acceleration of v itself.
  MatrixXd calcMassMatrix(const mjData& data) const;
  VectorXd calcBias(const mjData& data) const;
  /// Accelerations (nv) of qacc:  a = T' (qacc - dT/dt v).
  VectorXd calcAcceleration(const mjData& data) const;

 private:
  MatrixXd calcFullMassMatrix(const mjData& data) const;
  // dT/dt v in MuJoCo's order.
  VectorXd calcVelocityRate(ConstVectorRef q, ConstVectorRef v) const;
  // v or forces (nv) of those in MuJoCo's coordinates and order.
  VectorXd mapBack(ConstVectorRef q, ConstVectorRef values) const;

  const Model model_;
  VectorXd q_ref_;
  std::unique_ptr<mjModel, void (*)(mjModel*)> mj_;
  std::vector<int> bodies_, idx_q_, idx_v_;  // of each body; of its joint in qpos and qvel
};

}  // namespace bielle
