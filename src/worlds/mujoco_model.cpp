#include "worlds/mujoco_model.h"

#include <cstring>
#include <stdexcept>

#include "bielle/model/error.h"
#include "formats/mjcf_coordinates.h"

namespace bielle {
namespace {

using MjModel = std::unique_ptr<mjModel, void (*)(mjModel*)>;

// By default MuJoCo ends the program on an error and writes warnings to a file of its own in the current directory. It
// counts warnings in mjData as well.
void redirectMessages() {
  mju_user_error = [](const char* message) { throw std::runtime_error(message); };
  mju_user_warning = [](const char*) {};
}

MjModel load(const Model& model, const std::string& xml) {
  redirectMessages();
  constexpr const char* kName = "robot.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(xml.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], xml.data(), xml.size());
  char error[1000] = "";
  MjModel mj(mj_loadXML(kName, files.get(), error, sizeof error), mj_deleteModel);
  mj_deleteVFS(files.get());
  if (!mj) throw InputError(model.name(), "MuJoCo", error, "change the robot");
  return mj;
}

}  // namespace

MujocoModel::MujocoModel(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options)
    : model_(model), q_ref_(q_ref), mj_(load(model, formatMjcf(model, q_ref, options).xml)) {
  for (int i = 0; i < model.numBodies(); ++i) {
    bodies_.push_back(i == 0 ? 0 : mj_name2id(mj_.get(), mjOBJ_BODY, model.bodies()[i].name.c_str()));
    const int joint = i == 0 ? 0 : mj_name2id(mj_.get(), mjOBJ_JOINT, getMjcfName(model.joints()[i]).c_str());
    idx_q_.push_back(i == 0 ? 0 : mj_->jnt_qposadr[joint]);
    idx_v_.push_back(i == 0 ? 0 : mj_->jnt_dofadr[joint]);
  }
}

std::unique_ptr<mjData, void (*)(mjData*)> MujocoModel::makeData() const {
  return {mj_makeData(mj_.get()), mj_deleteData};
}

void MujocoModel::setState(ConstVectorRef q, ConstVectorRef v, mjData& data) const {
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    const auto q_joint = q.segment(joint.idx_q, joint.nq);
    calcMjcfPosition(joint, q_ref_.segment(joint.idx_q, joint.nq), q_joint,
                     Eigen::Map<VectorXd>(data.qpos + idx_q_[i], joint.nq));
    calcMjcfVelocity(joint, q_joint, v.segment(joint.idx_v, joint.nv),
                     Eigen::Map<VectorXd>(data.qvel + idx_v_[i], joint.nv));
  }
}

void MujocoModel::setForces(ConstVectorRef q, ConstVectorRef tau, mjData& data) const {
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    calcMjcfVelocity(joint, q.segment(joint.idx_q, joint.nq), tau.segment(joint.idx_v, joint.nv),
                     Eigen::Map<VectorXd>(data.qfrc_applied + idx_v_[i], joint.nv));
  }
}

void MujocoModel::getState(const mjData& data, VectorRef q, VectorRef v) const {
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    auto q_joint = q.segment(joint.idx_q, joint.nq);
    calcPositionFromMjcf(joint, q_ref_.segment(joint.idx_q, joint.nq),
                         Eigen::Map<const VectorXd>(data.qpos + idx_q_[i], joint.nq), q_joint);
    calcVelocityFromMjcf(joint, q_joint, Eigen::Map<const VectorXd>(data.qvel + idx_v_[i], joint.nv),
                         v.segment(joint.idx_v, joint.nv));
  }
}

MatrixXd MujocoModel::calcFullMassMatrix(const mjData& data) const {
  RowMatrixXd M(model_.nv(), model_.nv());
  mj_fullM(mj_.get(), M.data(), data.qM);
  return M;
}

VectorXd MujocoModel::calcVelocityRate(ConstVectorRef q, ConstVectorRef v) const {
  VectorXd rate(model_.nv());
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    calcMjcfVelocityRate(joint, q.segment(joint.idx_q, joint.nq), v.segment(joint.idx_v, joint.nv),
                         rate.segment(idx_v_[i], joint.nv));
  }
  return rate;
}

VectorXd MujocoModel::mapBack(ConstVectorRef q, ConstVectorRef values) const {
  VectorXd out(model_.nv());
  for (int i = 1; i < model_.numBodies(); ++i) {
    const Joint& joint = model_.joints()[i];
    calcVelocityFromMjcf(joint, q.segment(joint.idx_q, joint.nq), values.segment(idx_v_[i], joint.nv),
                         out.segment(joint.idx_v, joint.nv));
  }
  return out;
}

MatrixXd MujocoModel::calcMassMatrix(const mjData& data) const {
  VectorXd q(model_.nq()), v(model_.nv());
  getState(data, q, v);
  MatrixXd M = calcFullMassMatrix(data);
  for (Eigen::Index k = 0; k < M.cols(); ++k) M.col(k) = mapBack(q, M.col(k).eval());
  MatrixXd out(M.rows(), M.cols());
  for (Eigen::Index k = 0; k < M.rows(); ++k) out.row(k) = mapBack(q, M.row(k).transpose().eval()).transpose();
  return out;
}

VectorXd MujocoModel::calcBias(const mjData& data) const {
  VectorXd q(model_.nq()), v(model_.nv());
  getState(data, q, v);
  MatrixXd M = calcFullMassMatrix(data);
  M.diagonal() -= Eigen::Map<const VectorXd>(mj_->dof_armature, model_.nv());
  return mapBack(q, Eigen::Map<const VectorXd>(data.qfrc_bias, model_.nv()) -
                        Eigen::Map<const VectorXd>(data.qfrc_passive, model_.nv()) + M * calcVelocityRate(q, v));
}

VectorXd MujocoModel::calcAcceleration(const mjData& data) const {
  VectorXd q(model_.nq()), v(model_.nv());
  getState(data, q, v);
  return mapBack(q, Eigen::Map<const VectorXd>(data.qacc, model_.nv()) - calcVelocityRate(q, v));
}

}  // namespace bielle
