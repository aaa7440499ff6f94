#include "worlds/perception.h"

#include <algorithm>
#include <cmath>

#include "bielle/motion/motion.h"
#include "control/clock.h"

namespace bielle::worlds {
namespace {

constexpr int kRestReadings = 2000;
constexpr double kRestPeriod = 1e-3;  // s

Matrix3d getAttitude(const VectorXd& q) { return Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix(); }

EstimatorOptions withImu(EstimatorOptions options, const SE3& imu) {
  options.imu = imu;
  return options;
}

}  // namespace

Perception::Perception(const Model& model, const ContactSchedule& planned, const PerceptionOptions& options)
    : model_(model),
      measurement_{0, model.makeNeutral(), VectorXd::Zero(model.nv()), std::vector<char>(model.contacts().size(), 0)} {
  double end = 0;
  for (const ContactPhase& phase : planned.phases) {
    if (phase.dt == 0) continue;
    end += phase.nodes * phase.dt;
    periods_.push_back({end, {}});
    for (const ContactTarget& target : phase.contacts) periods_.back().contacts.push_back(target.contact);
  }
  if (periods_.empty()) periods_.emplace_back();
  if (!options.sensors) return;
  sensors_.emplace(model, *options.sensors);
  estimator_.emplace(model, makeStandingPosture(model), withImu(options.estimator, options.sensors->imu));
}

// Torques of the motors that hold the robot still on its contacts.
VectorXd Perception::calcRestTorques(ConstVectorRef q, const std::vector<int>& contacts) const {
  std::vector<ContactTarget> targets(contacts.size());
  for (size_t i = 0; i < contacts.size(); ++i) targets[i].contact = contacts[i];
  return calcStaticTorques(model_, makeConstraintSet(model_, targets), q).u;
}

const std::vector<int>& Perception::getPlanned(double time) const {
  for (const Period& period : periods_)
    if (time < period.end - kClockTolerance) return period.contacts;
  return periods_.back().contacts;
}

void Perception::reset(const World& world, ConstVectorRef q, ConstVectorRef v) {
  errors_ = {};
  instants_ = 0;
  if (!sensors_) return;
  start_ = world.configuration().head<3>();
  const std::vector<int>& contacts = getPlanned(world.time());
  const VectorXd u = calcRestTorques(q, contacts);
  const double start = world.time() - kRestReadings * kRestPeriod;
  sensors_->reset(world, start);
  estimator_->reset(start, q, v, contacts);
  for (int i = kRestReadings - 1; i >= 0; --i)
    estimator_->update(sensors_->readAtRest(world.time() - i * kRestPeriod, u), contacts);
}

const Measurement& Perception::update(const World& world, double plan_time) {
  if (!sensors_) {
    measurement_.time = world.time();
    measurement_.q = world.configuration();
    measurement_.v = world.velocity();
    for (size_t c = 0; c < measurement_.contacts.size(); ++c) measurement_.contacts[c] = world.feet()[c].touches;
    return measurement_;
  }
  estimator_->update(sensors_->read(world), getPlanned(plan_time));
  addErrors(world);
  return estimator_->measurement();
}

void Perception::addErrors(const World& world) {
  const Measurement& m = estimator_->measurement();
  const VectorXd &q = world.configuration(), &v = world.velocity();
  const Matrix3d R = getAttitude(m.q), truth = getAttitude(q);
  const double position = (m.q.head<3>() - q.head<3>()).norm();
  const double velocity = (R * m.v.head<3>() - truth * v.head<3>()).norm();
  const Vector3d up = R.row(2), true_up = truth.row(2);
  const double tilt = std::atan2(up.cross(true_up).norm(), up.dot(true_up));
  const auto add = [](double value, double& sum, double& largest) {
    sum += value * value;
    if (!(value <= largest)) largest = value;  // a NaN too
  };
  add(position, errors_.position_rms, errors_.position_max);
  add(velocity, errors_.velocity_rms, errors_.velocity_max);
  add(tilt, errors_.tilt_rms, errors_.tilt_max);
  errors_.drift = (m.q - q).head<2>().norm();
  errors_.way = (q.head<3>() - start_).head<2>().norm();
  int wrong = 0;
  const auto& feet = world.feet();
  for (size_t c = 0; c < feet.size(); ++c) wrong += feet[c].touches != (estimator_->contacts()[c] != 0);
  errors_.contact_errors += feet.empty() ? 0 : static_cast<double>(wrong) / static_cast<double>(feet.size());
  ++instants_;
}

EstimationErrors Perception::errors() const {
  EstimationErrors out = errors_;
  const double n = static_cast<double>(std::max(1L, instants_));
  for (double* sum : {&out.position_rms, &out.velocity_rms, &out.tilt_rms}) *sum = std::sqrt(*sum / n);
  out.contact_errors /= n;
  return out;
}

}  // namespace bielle::worlds
