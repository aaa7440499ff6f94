#include "bielle/control/estimator.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "control/contact_filter.h"
#include "control/foot_model.h"
#include "control/passive_joints.h"
#include "model/listing.h"

namespace bielle {
namespace {

std::vector<int> listSizes(const Model& model) {
  std::vector<int> sizes;
  for (const ContactFrame& contact : model.contacts()) sizes.push_back(contact.kind == ContactKind::Surface6D ? 6 : 3);
  return sizes;
}

ContactFilterNoise makeNoise(const EstimatorOptions& o) {
  return {o.gyro_noise, o.accelerometer_noise, o.gyro_walk,     o.accelerometer_walk,
          o.foot_slide, o.foot_turn,           o.foot_position, o.foot_attitude};
}

}  // namespace

void describe(OptionFields& f, EstimatorOptions& o) {
  f.number("bandwidth", o.bandwidth, "1/s", kPositive, "bandwidth of the motor observers");
  f.number("smoothing", o.smoothing, "s", kNotNegative, "time constant of the accelerations");
  f.number("gyro_noise", o.gyro_noise, "rad/s/sqrt(Hz)", kNotNegative, "noise of the gyroscope");
  f.number("accelerometer_noise", o.accelerometer_noise, "m/s^2/sqrt(Hz)", kNotNegative, "noise of the accelerometer");
  f.number("gyro_offset", o.gyro_offset, "rad/s", kNotNegative, "offset at the start");
  f.number("accelerometer_offset", o.accelerometer_offset, "m/s^2", kNotNegative, "offset at the start");
  f.number("gyro_walk", o.gyro_walk, "rad/s", kNotNegative, "change of the offset in one second");
  f.number("accelerometer_walk", o.accelerometer_walk, "m/s^2", kNotNegative, "change of the offset in one second");
  f.number("tilt", o.tilt, "rad", kNotNegative, "tilt of the trunk at the start");
  f.number("foot_position", o.foot_position, "m", kNotNegative, "position of a foot from the encoders");
  f.number("foot_attitude", o.foot_attitude, "rad", kNotNegative, "attitude of a foot from the encoders");
  f.number("foot_slide", o.foot_slide, "m", kNotNegative, "displacement of a standing foot in one second");
  f.number("foot_turn", o.foot_turn, "rad", kNotNegative, "rotation of a standing foot in one second");
  f.number("planned_contact", o.planned_contact, "1", kNotNegative,
           "normal force of a standing foot relative to the weight");
  f.number("surprising_contact", o.surprising_contact, "1", kNotNegative, "the same where no contact is planned");
  f.number("slip", o.slip, "1", kPositive,
           "a sole has slipped if its deviation, 6 on average, exceeds this; points and edges, half of it");
}

struct Estimator::Parts {
  Parts(const Model& model, ConstVectorRef q, const EstimatorOptions& options);

  void reset(double time, ConstVectorRef q, ConstVectorRef v, const std::vector<int>& contacts);
  NumericalStatus update(const SensorReadings& readings, const std::vector<int>& planned);
  void observe(ConstVectorRef positions, double h);
  void updateAcceleration(ConstVectorRef u, double h);
  void readTrunk();
  void updateFeet(const std::vector<int>& planned);
  SE3 getSeenFoot(size_t contact) const;

  const Model model;
  const EstimatorOptions options;
  const bool floats;  // on a free-flyer
  const double weight;
  PassiveJoints joints;
  FootModel feet;
  ContactFilter filter;
  Measurement measurement;
  std::vector<double> unrest;
  VectorXd positions, speeds;  // nu, of the observers of Eq. (1)
  VectorXd calm_speeds;        // nu, with which standing feet are at rest
  VectorXd torques[3];         // nu, after each of the filters
  VectorXd v_seen, v_last, a;  // nv
  Vector3d gyro = Vector3d::Zero();
  NumericalStatus status = NumericalStatus::Ok;
};

Estimator::Parts::Parts(const Model& m, ConstVectorRef q, const EstimatorOptions& o)
    : model(m),
      options(o),
      floats(m.hasFreeFlyer()),
      weight(m.mass() * m.gravity().norm()),
      joints(m, q),
      feet(m),
      filter(listSizes(m), makeNoise(o), m.gravity()),
      measurement{0, q, VectorXd::Zero(m.nv()), std::vector<char>(m.contacts().size(), 0)},
      unrest(m.contacts().size(), 1.0) {
  for (VectorXd* x : {&positions, &speeds, &calm_speeds, &torques[0], &torques[1], &torques[2]}) x->setZero(m.nu());
  for (VectorXd* x : {&v_seen, &v_last, &a}) x->setZero(m.nv());
  reset(0, q, VectorXd::Zero(m.nv()), {});
}

void Estimator::Parts::reset(double time, ConstVectorRef q, ConstVectorRef v, const std::vector<int>& standing) {
  measurement.time = time;
  measurement.q = q;
  measurement.v = v;
  joints.reset(q);
  for (int m = 0; m < model.nu(); ++m) {
    positions[m] = q[model.joints()[model.motors()[m].joint].idx_q];
    speeds[m] = v[model.motors()[m].dof];
  }
  v_seen = v;
  a.setZero();
  feet.update(joints, q, v, a, VectorXd::Zero(model.nu()));
  if (!floats) return;
  const Workspace& ws = feet.workspace();
  const SE3 X_WI = ws.X_WB[1] * options.imu;
  const Vector6d twist = options.imu.actInvMotion(v.head<6>());
  ContactFilterState state = filter.state();
  state.R = X_WI.R;
  state.p = X_WI.p;
  state.v = X_WI.R * twist.head<3>();
  state.gyro_offset.setZero();
  state.accelerometer_offset.setZero();
  gyro = twist.tail<3>();
  Eigen::Matrix<double, 15, 1> deviations = Eigen::Matrix<double, 15, 1>::Zero();
  deviations.segment<2>(kTurn).setConstant(options.tilt);
  deviations.segment<3>(kGyro).setConstant(options.gyro_offset);
  deviations.segment<3>(kAccelerometer).setConstant(options.accelerometer_offset);
  filter.reset(state, deviations);
  for (size_t c = 0; c < measurement.contacts.size(); ++c) {
    measurement.contacts[c] = contains(standing, c);
    filter.putDown(c, getSeenFoot(c));
  }
}

// Eq. (1) in steps of h, with both poles at exp(-s h).
void Estimator::Parts::observe(ConstVectorRef readings, double h) {
  const double decay = std::exp(-options.bandwidth * h);
  for (int m = 0; m < model.nu(); ++m) {
    const double error = readings[m] - (positions[m] + h * speeds[m]);
    positions[m] += h * speeds[m] + (1 - decay * decay) * error;
    speeds[m] += (1 - decay) * (1 - decay) / h * error;
  }
}

// Of speeds as they were seen: those that keep believed feet at rest would confirm the belief. The torques pass the filters of
// the accelerations that they belong to: two poles of the observers, one of the smoothing.
void Estimator::Parts::updateAcceleration(ConstVectorRef u, double h) {
  const double decay = std::exp(-options.bandwidth * h), share = -std::expm1(-h / options.smoothing);
  torques[0] += (1 - decay) * (u - torques[0]);
  torques[1] += (1 - decay) * (torques[0] - torques[1]);
  torques[2] += share * (torques[1] - torques[2]);
  v_last = v_seen;
  if (floats) v_seen.head<6>() = measurement.v.head<6>();
  joints.expand(speeds, v_seen);
  if (h > 0) a += share * ((v_seen - v_last) / h - a);
}

SE3 Estimator::Parts::getSeenFoot(size_t c) const {
  const Workspace& ws = feet.workspace();
  const ContactFrame& contact = model.contacts()[c];
  return (ws.X_WB[1] * options.imu).inverseTimes(ws.X_WB[contact.body] * contact.X_BF);
}

// The trunk from the filter.
void Estimator::Parts::readTrunk() {
  const ContactFilterState& state = filter.state();
  const SE3 X_IB = options.imu.inverse(), X_WB = SE3(state.R, state.p) * X_IB;
  const Eigen::Quaterniond rotation(X_WB.R);
  measurement.q.head<3>() = X_WB.p;
  measurement.q.segment<4>(3) = rotation.coeffs();
  Vector6d twist;
  twist << state.R.transpose() * state.v, gyro - state.gyro_offset;
  measurement.v.head<6>() = options.imu.actMotion(twist);
}

void Estimator::Parts::updateFeet(const std::vector<int>& planned) {
  std::vector<char>& contacts = measurement.contacts;
  for (size_t c = 0; c < contacts.size(); ++c) {
    const double force = feet.getWrench(c)[2] / weight;
    const double threshold = contains(planned, c) ? options.planned_contact : options.surprising_contact;
    const bool stood = contacts[c];
    contacts[c] = force > (stood ? 0.5 * threshold : threshold);
    // A foot that hardly carries anything may still roll onto its sole.
    unrest[c] = 1 + 9 * std::clamp(1 - force / (2 * options.surprising_contact), 0.0, 1.0);
    if (!contacts[c]) continue;
    const SE3 seen = getSeenFoot(c);
    if (!stood || filter.correct(c, seen) > options.slip * filter.getSize(c) / 6) filter.putDown(c, seen);
  }
}

NumericalStatus Estimator::Parts::update(const SensorReadings& readings, const std::vector<int>& planned) {
  const double h = readings.time - measurement.time;
  if (!readings.motor_positions.allFinite() || !readings.motor_torques.allFinite() ||
      !readings.angular_velocity.allFinite() || !readings.specific_force.allFinite() || !std::isfinite(h))
    return status = NumericalStatus::NotFinite;
  measurement.time = readings.time;
  if (h > 0) observe(readings.motor_positions, h);
  status = joints.update(readings.motor_positions, measurement.q);
  if (floats && h > 0) {
    filter.predict(readings.angular_velocity, readings.specific_force, h, unrest);
    gyro = readings.angular_velocity;
    readTrunk();
  }
  updateAcceleration(readings.motor_torques, h);
  feet.update(joints, measurement.q, v_seen, a, torques[2]);
  if (floats && h > 0) {
    updateFeet(planned);
    readTrunk();
  }
  calm_speeds = speeds;
  feet.calmFeet(measurement.contacts, measurement.v.head(floats ? 6 : 0), calm_speeds);
  joints.expand(calm_speeds, measurement.v);
  return status;
}

Estimator::Estimator(const Model& model, ConstVectorRef q, const EstimatorOptions& options)
    : parts_(std::make_unique<Parts>(model, q, options)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;

void Estimator::reset(double time, ConstVectorRef q, ConstVectorRef v, const std::vector<int>& contacts) {
  parts_->reset(time, q, v, contacts);
}
NumericalStatus Estimator::update(const SensorReadings& readings, const std::vector<int>& planned) {
  return parts_->update(readings, planned);
}
const Measurement& Estimator::measurement() const { return parts_->measurement; }
const std::vector<char>& Estimator::contacts() const { return parts_->measurement.contacts; }
const Vector6d& Estimator::getWrench(size_t contact) const { return parts_->feet.getWrench(contact); }
double Estimator::margin() const { return parts_->joints.margin(); }

std::string Estimator::message() const {
  switch (parts_->status) {
    case NumericalStatus::NearDeadPoint:
      return "the linkage of closure '" + parts_->joints.weakest() + "' is near a dead point of its motors";
    case NumericalStatus::NotClosed:
      return "the loops do not close at the motors' positions";
    case NumericalStatus::NotFinite:
      return "readings are not finite";
    default:
      return {};
  }
}

}  // namespace bielle
