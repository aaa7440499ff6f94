#include "validate_mujoco.h"

#include <cmath>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "samples.h"
#include "worlds/mujoco_model.h"

namespace bielle::validation {
namespace {

constexpr double kMujocoFloor = 1e-2;  // as in validate.cpp
constexpr double kRateStep = 1e-5;     // of differences of J, s
constexpr double kSoftness = 1e-4;     // of R; below it, rounding shows
constexpr double kRigidTolerance = 1e-7, kNoTolerance = std::numeric_limits<double>::infinity();

enum class Rows {
  AsTheyAre,  // Eq. (1)
  Rigid,      // R -> 0
  Complete    // and with dJ/dt v
};

class MujocoComparison {
 public:
  MujocoComparison(const Model& model, const Model& oracle, ConstVectorRef q_ref, const ValidationOptions& options,
                   ValidationReport& report)
      : model_(model),
        oracle_(oracle),
        options_(options),
        report_(report),
        mujoco_(oracle, q_ref),
        data_(mujoco_.makeData()),
        moved_(mujoco_.makeData()) {
    mujoco_.get()->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_LIMIT | mjDSBL_FRICTIONLOSS;
  }

  void compare(const Sample& sample) {
    Workspace ws(model_);
    updatePositions(model_, ws, sample.q);
    updateVelocities(model_, ws, sample.v);
    updateMassMatrix(model_, ws);
    updateBias(model_, ws);
    mujoco_.setState(sample.q, sample.v, *data_);
    mj_forward(mujoco_.get(), data_.get());
    addDifference(report_, "mass matrix", ws.M, mujoco_.calcMassMatrix(*data_), 1e-6, options_.tolerance);
    addDifference(report_, "bias", ws.b, mujoco_.calcBias(*data_) - calcFriction(sample.v), 1e-6, options_.tolerance);
    compareAcceleration("as MuJoCo has them", sample, Rows::AsTheyAre, kNoTolerance);
    compareAcceleration("rigid closures", sample, Rows::Rigid, kNoTolerance);
    compareAcceleration("rigid closures, dJ/dt v added", sample, Rows::Complete, kRigidTolerance);
    Sample rest = sample;
    rest.v.setZero();
    compareAcceleration("rigid closures, at rest", rest, Rows::Rigid, kRigidTolerance);
    ++report_.states;
  }

 private:
  void compareAcceleration(const std::string& label, const Sample& sample, Rows rows, double tolerance) {
    Workspace ws(model_);
    ConstrainedWorkspace cws;
    const ConstraintSet set = makeConstraintSet(model_);
    if (updateConstrainedDynamics(model_, ws, cws, set, sample.q, sample.v, sample.tau) != NumericalStatus::Ok)
      cws.a.setConstant(std::numeric_limits<double>::quiet_NaN());
    const VectorXd weight = ws.M.diagonal().cwiseSqrt(), free = ws.M.llt().solve(sample.tau - ws.b);
    addDifference(
        report_, "accelerations, " + label, weight.cwiseProduct(cws.a),
        weight.cwiseProduct(rows == Rows::AsTheyAre ? calcAcceleration(sample, 1, rows) : calcRigid(sample, rows)),
        kMujocoFloor * weight.cwiseProduct(free).cwiseAbs().maxCoeff(), tolerance);
  }

  // Smooth friction of joints (model.h), which MuJoCo does not have.
  VectorXd calcFriction(const VectorXd& v) const {
    VectorXd out = VectorXd::Zero(oracle_.nv());
    for (const JointForce& force : oracle_.jointForces())
      out[force.dof] -= force.friction * v[force.dof] / std::hypot(v[force.dof], force.friction_speed);
    return out;
  }

  // Linear extrapolation to R = 0.
  VectorXd calcRigid(const Sample& sample, Rows rows) {
    const VectorXd soft = calcAcceleration(sample, kSoftness, rows);
    return 2 * calcAcceleration(sample, kSoftness / 2, rows) - soft;
  }

  // mj_forward, with Eq. (1) changed between its parts: R is multiplied by `softness`.
  VectorXd calcAcceleration(const Sample& sample, double softness, Rows rows) {
    const mjModel& mj = *mujoco_.get();
    mjData& data = *data_;
    mujoco_.setState(sample.q, sample.v, data);
    mujoco_.setForces(sample.q, sample.tau + calcFriction(sample.v), data);
    mj_fwdPosition(&mj, &data);
    for (int i = 0; i < data.nefc; ++i) {
      data.efc_R[i] *= softness;
      data.efc_D[i] /= softness;
    }
    mj_fwdVelocity(&mj, &data);
    if (rows == Rows::Complete) Eigen::Map<VectorXd>(data.efc_aref, data.nefc) -= calcRowRate();
    mj_fwdActuation(&mj, &data);
    mj_fwdAcceleration(&mj, &data);
    mj_fwdConstraint(&mj, &data);
    return mujoco_.calcAcceleration(data);
  }

  // dJ/dt qvel
  VectorXd calcRowRate() {
    VectorXd rate = VectorXd::Zero(data_->nefc), rows(data_->nefc);
    for (const double sign : {1.0, -1.0}) {
      mj_copyData(moved_.get(), mujoco_.get(), data_.get());
      mj_integratePos(mujoco_.get(), moved_->qpos, data_->qvel, sign * kRateStep);
      mj_fwdPosition(mujoco_.get(), moved_.get());
      mj_mulJacVec(mujoco_.get(), moved_.get(), rows.data(), data_->qvel);
      rate += sign / (2 * kRateStep) * rows;
    }
    return rate;
  }

  const Model &model_, &oracle_;
  const ValidationOptions& options_;
  ValidationReport& report_;
  MujocoModel mujoco_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_, moved_;
};

}  // namespace

ValidationReport validateAgainstMujoco(const Model& model, const Model& oracle, const ValidationOptions& options) {
  ValidationReport report;
  report.robot = model.name();
  report.engine = "MuJoCo";
  SampleSource source(model, options);
  report.failure = source.failure;
  if (!report.failure.empty()) return report;
  MujocoComparison comparison(model, oracle, source.start(), options, report);
  for (int i = 0; i < options.samples; ++i) comparison.compare(source.draw());
  return report;
}

ValidationReport validateByMujoco(const Model& model, const ValidationOptions& options) {
  return validateAgainstMujoco(model, model, options);
}

}  // namespace bielle::validation
