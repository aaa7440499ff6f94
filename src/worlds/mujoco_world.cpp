#include "worlds/mujoco_world.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/loop_conflict.h"
#include "worlds/contact_law.h"
#include "worlds/left_out.h"
#include "worlds/mujoco_ground.h"
#include "worlds/mujoco_model.h"

namespace bielle::worlds {
namespace {

// Soles that move by less than 10 m/s stay within reach of the boxes shown, s.
constexpr double kBoxPeriod = MujocoGround::kReach / 10;

MjcfOptions makeRobotOptions(const MujocoWorldOptions& options, const MujocoGround& ground) {
  MjcfOptions robot = options.robot;
  if (options.world.time_step > 0) robot.time_step = options.world.time_step;
  robot.friction = options.world.ground.friction;
  ground.addTo(robot);
  return robot;
}

VectorXd findPosture(const Model& model) {
  const AssemblyResult closed = findClosedConfiguration(model);
  if (closed.status != NumericalStatus::Ok) throw makeClosingError(model, model.name(), closed);
  return closed.q;
}

class MujocoWorld : public World {
 public:
  MujocoWorld(const Model& model, const MujocoWorldOptions& options)
      : World(model, options.world),
        boxes_(model, ground_),
        options_(makeRobotOptions(options, boxes_)),
        mujoco_(model, findPosture(model), options_),
        data_(mujoco_.makeData()),
        contact_of_geom_(mujoco_.get()->ngeom, -1) {
    const mjModel& mj = *mujoco_.get();
    if (options.runge_kutta) mujoco_.get()->opt.integrator = mjINT_RK4;
    boxes_.bind(mj);
    freeFrictions();
    setPointSprings();
    integration_.integrator = options.runge_kutta ? "Runge-Kutta of order 4" : "semi-implicit Euler";
    warnings_ = listMissingStops(model, [](const Joint& joint, int k) {
      const bool has_axes = joint.kind == JointKind::FreeFlyer && !isMjcfFree(joint);
      return hasStops(joint.kind) || joint.kind == JointKind::Planar || (has_axes && k < 3);
    });
    for (const std::string& warning : listTurnedArmatures(model)) warnings_.push_back(warning);
    for (const std::string& warning : listRodFrictions(options.world.wear)) warnings_.push_back(warning);
    for (size_t c = 0; c < model.contacts().size(); ++c)
      contact_of_geom_[mj_name2id(&mj, mjOBJ_GEOM, (model.contacts()[c].name + ".1").c_str())] = static_cast<int>(c);
    for (VectorXd* x : {&v_before_, &v_mean_, &push_force_}) x->setZero(model.nv());
    q_before_.setZero(mj.nq);
    row_velocity_.setZero(mj.njmax);
  }

 private:
  void start() override;
  bool step(double duration) override;
  void noteForces() override;
  void freeFrictions();
  void setPointSprings();
  bool takeStep();
  void book(double h);
  void addSoleForces(double share);

  MujocoGround boxes_;
  const MjcfOptions options_;
  MujocoModel mujoco_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::vector<int> contact_of_geom_;  // of the model, -1 if the geom is not one of a sole
  VectorXd q_before_, v_before_, v_mean_, push_force_, row_velocity_;  // MuJoCo's
};

// Eq. (2) instead of MuJoCo's own.
void MujocoWorld::freeFrictions() {
  for (const JointForce& force : model_.jointForces()) mujoco_.get()->dof_frictionloss[mujoco_.getDof(force.joint)] = 0;
}

// With a length without tension that may be negative.
void MujocoWorld::setPointSprings() {
  mjModel& mj = *mujoco_.get();
  for (const PointSpring& spring : model_.pointSprings()) {
    const double stiffness = spring.stiffness > 0 ? spring.stiffness : kMjcfPreloadStiffness;
    if (spring.stiffness == 0 && spring.preload == 0) continue;
    const int tendon = mj_name2id(&mj, mjOBJ_TENDON, spring.name.c_str());
    mj.tendon_stiffness[tendon] = stiffness;
    mj.tendon_lengthspring[tendon] = spring.rest - spring.preload / stiffness;
  }
}

void MujocoWorld::start() {
  boxes_.startTilts();
  mj_resetData(mujoco_.get(), data_.get());
  mujoco_.setState(q_, v_, *data_);
  mj_kinematics(mujoco_.get(), data_.get());
}

void MujocoWorld::noteForces() {
  Eigen::Map<VectorXd>(data_->ctrl, u_.size()) = u_;
  Eigen::Map<Vector3d>(data_->xfrc_applied + 6 * mujoco_.getBody(pushed_body_)) = push_;
}

bool MujocoWorld::step(double duration) {
  const double steps = countSteps(duration, options_.time_step), h = duration / steps;
  mujoco_.get()->opt.timestep = h;
  clearFootForces();
  const double box_steps = std::max(1.0, std::floor(kBoxPeriod / h));
  double taken = 0;
  for (; taken < steps && !(taken > 0 && isInterrupted()); ++taken) {
    if (std::fmod(taken, box_steps) == 0 && !boxes_.update(*mujoco_.get(), *data_))
      message_ = "there are too many boxes under the soles";
    boxes_.tilt(*mujoco_.get());
    if (!message_.empty() || !takeStep()) break;
    book(h);
    noteStep(h);
    addSoleForces(1.0 / steps);
    time_ += h;
  }
  mujoco_.getState(*data_, q_, v_);
  updatePositions(model_, ws_, q_);
  reportFeet([this](int body) { return ws_.X_WB[body]; });
  return taken == steps;
}

bool MujocoWorld::takeStep() {
  const mjModel& mj = *mujoco_.get();
  q_before_ = Eigen::Map<const VectorXd>(data_->qpos, mj.nq);
  v_before_ = Eigen::Map<const VectorXd>(data_->qvel, mj.nv);
  for (const JointForce& force : model_.jointForces()) mj.dof_damping[mujoco_.getDof(force.joint)] = 0;
  for (const JointForce& force : model_.jointForces()) {
    const int dof = mujoco_.getDof(force.joint);
    mj.dof_damping[dof] += force.damping + force.friction / std::hypot(v_before_[dof], force.friction_speed);
  }
  try {
    mj_step(&mj, data_.get());
  } catch (const std::exception& error) {
    message_ = std::string("MuJoCo: ") + error.what();
  }
  const auto warned = [this](int warning) { return data_->warning[warning].number > 0; };
  if (warned(mjWARN_CONTACTFULL) || warned(mjWARN_CNSTRFULL))
    message_ = "MuJoCo's memory is too small for all contacts";
  if (warned(mjWARN_BADQPOS) || warned(mjWARN_BADQVEL) || warned(mjWARN_BADQACC))
    message_ = "MuJoCo's accelerations are no longer finite";
  if (warned(mjWARN_BADCTRL)) message_ = "the torques are not finite";
  if (message_.empty()) return true;
  // From bad numbers MuJoCo goes back to its start.
  Eigen::Map<VectorXd>(data_->qpos, mj.nq) = q_before_;
  Eigen::Map<VectorXd>(data_->qvel, mj.nv) = v_before_;
  return false;
}

// Eq. (1)
void MujocoWorld::book(double h) {
  const mjModel& mj = *mujoco_.get();
  v_mean_ = 0.5 * (v_before_ + Eigen::Map<const VectorXd>(data_->qvel, mj.nv));
  work_.motor += h * v_mean_.dot(Eigen::Map<const VectorXd>(data_->qfrc_actuator, mj.nv));
  const int pushed = mujoco_.getBody(pushed_body_);
  if (!push_.isZero(0)) {
    push_force_.setZero();
    mj_applyFT(&mj, data_.get(), push_.data(), nullptr, data_->xipos + 3 * pushed, pushed, push_force_.data());
    work_.push += h * v_mean_.dot(push_force_);
  }
  // MuJoCo takes dampers at the end of a step.
  for (int k = 0; k < mj.nv; ++k) work_.joint -= h * mj.dof_damping[k] * data_->qvel[k] * v_mean_[k];
  // Those of tendons at its start. The robot is written with sparse matrices.
  for (int t = 0; t < mj.ntendon; ++t) {
    double rate = 0;
    for (int i = data_->ten_J_rowadr[t]; i < data_->ten_J_rowadr[t] + data_->ten_J_rownnz[t]; ++i)
      rate += data_->ten_J[i] * v_mean_[data_->ten_J_colind[i]];
    work_.joint -= h * mj.tendon_damping[t] * data_->ten_velocity[t] * rate;
  }
  mj_mulJacVec(&mj, data_.get(), row_velocity_.data(), v_mean_.data());
  for (int i = 0; i < data_->nefc; ++i) {
    const double work = h * data_->efc_force[i] * row_velocity_[i];
    if (data_->efc_type[i] == mjCNSTR_EQUALITY || data_->efc_type[i] == mjCNSTR_FRICTION_DOF)
      work_.joint += work;
    else if (data_->efc_type[i] == mjCNSTR_LIMIT_JOINT)
      work_.stop += work;
    else
      work_.contact += work;
  }
}

void MujocoWorld::addSoleForces(double share) {
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    const int second = contact_of_geom_[contact.geom2], first = contact_of_geom_[contact.geom1];
    mjtNum wrench[6];  // on geom 2, in the axes of the contact
    mj_contactForce(mujoco_.get(), data_.get(), i, wrench);
    if (wrench[0] == 0) continue;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R_CW(contact.frame);
    Vector3d force = share * (R_CW.transpose() * Vector3d(wrench[0], wrench[1], wrench[2]));
    if (second < 0) force = -force;
    addFootForce(second >= 0 ? second : first, Eigen::Map<const Vector3d>(contact.pos), force);
  }
}

}  // namespace

std::unique_ptr<World> makeMujocoWorld(const Model& model, const MujocoWorldOptions& options) {
  return std::make_unique<MujocoWorld>(model, options);
}

}  // namespace bielle::worlds
