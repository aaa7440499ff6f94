#include "worlds/serial_belief.h"

#include "math/decompositions.h"
#include "motion/posture_lift.h"

namespace bielle::worlds {
namespace {

constexpr double kSingular = 1e-3;  // margin (calcLinkageTangent) below which a linkage is at a dead point

// R of the whole robot from the speeds of all dofs per unit of those of the serial model. False at a dead point.
bool calcRatio(const Model& closed, const Model& serial, const PostureLift& posture, MatrixXd& R) {
  const MatrixXd T = posture.calcTangent();
  MatrixXd out(closed.nu(), serial.nu());
  for (int m = 0; m < closed.nu(); ++m)
    for (int j = 0; j < serial.nu(); ++j) out(m, j) = T(closed.motors()[m].dof, serial.motors()[j].dof);
  if (!out.allFinite() || !Eigen::FullPivLU<MatrixXd>(out).isInvertible()) return false;
  R = out;
  return true;
}

// Eq. (1)
VectorXd calcMotorTorques(const MatrixXd& R, const VectorXd& tau) { return R.transpose().partialPivLu().solve(tau); }

}  // namespace

SerialController::SerialController(const Model& closed, const SerialModel& serial, std::unique_ptr<Controller> inner,
                                   Belief belief, std::optional<GeneratedMaps> maps)
    : closed_(closed), serial_(serial), inner_(std::move(inner)), belief_(belief), maps_(std::move(maps)) {
  if (maps_) return;
  posture_ = std::make_unique<PostureLift>(closed_, serial_);
  posture_->setClosedConfiguration(serial.q_reference, kSingular);
  calcRatio(closed_, serial_.model, *posture_, R_);
}
SerialController::~SerialController() = default;

void SerialController::update(const Measurement& measurement, VectorRef u) {
  Measurement believed = measurement;
  believed.q = restrictConfiguration(closed_, serial_.model, measurement.q);
  believed.v = restrictVelocity(closed_, serial_.model, measurement.v);
  if (maps_) maps_->measure(measurement.q, measurement.v, believed.q, believed.v);
  VectorXd tau(serial_.model.nu());
  inner_->update(believed, tau);
  if (maps_) return maps_->calcTorques(tau, u);
  if (belief_ == Belief::Serial && posture_->setClosedConfiguration(measurement.q, kSingular) == NumericalStatus::Ok)
    calcRatio(closed_, serial_.model, *posture_, R_);
  u = calcMotorTorques(R_, tau);
}

SerialReference makeReference(const Model& closed, const SerialModel& serial, const Policy& plan, Belief belief,
                              std::optional<GeneratedMaps> maps) {
  SerialReference out;
  PostureLift posture(closed, serial);
  posture.setClosedConfiguration(serial.q_reference, kSingular);
  MatrixXd R;
  calcRatio(closed, serial.model, posture, R);
  const auto setState = [&](double time, VectorXd& q, VectorXd& v) {
    VectorXd q_s = serial.model.makeNeutral(), v_s(serial.model.nv());
    plan.getReference(time, q_s, v_s);
    const NumericalStatus status = posture.setConfiguration(q_s, kSingular);
    if (status != NumericalStatus::Ok && out.first_missed < 0) {
      out.first_missed = time;
      out.message = posture.why();
    }
    if (status == NumericalStatus::Ok && belief == Belief::Serial) calcRatio(closed, serial.model, posture, R);
    q = posture.q();
    v = status == NumericalStatus::Ok ? posture.liftVelocity(v_s) : VectorXd(VectorXd::Zero(closed.nv()));
    if (maps && status == NumericalStatus::Ok) maps->lead(q_s, v_s, q, v);
  };
  std::vector<Policy::Stage> stages;
  VectorXd q, v, q_next;
  setState(0, q, v);
  for (const Policy::Stage& from : plan.stages()) {
    Policy::Stage stage;
    stage.start = from.start;
    stage.duration = from.duration;
    stage.phase = from.phase;
    stage.q = q;
    stage.v = v;
    if (maps) {
      stage.u.resize(closed.nu());
      maps->calcTorques(from.u, stage.u);
    } else {
      stage.u = calcMotorTorques(R, from.u);
    }
    setState(from.start + from.duration, q_next, v);
    stage.q_change = closed.difference(q, q_next);
    stage.v_next = v;
    q = q_next;
    stages.push_back(std::move(stage));
  }
  const VectorXd u_hold = stages.back().u;
  out.policy.emplace(closed, std::move(stages), u_hold);
  return out;
}

}  // namespace bielle::worlds
