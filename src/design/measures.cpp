#include "design/measures.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/distance.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "design/conditioning.h"
#include "design/motor_change.h"
#include "math/largest.h"

namespace bielle {
namespace {

MotorMeasures calcMeasures(const MotorTrace& trace, Eigen::Index motor, const MotorConversion& drive) {
  MotorMeasures out;
  double squares = 0, duration = 0;
  for (size_t k = 0; k < trace.dt.size(); ++k) {
    const Eigen::Index stage = static_cast<Eigen::Index>(k);
    const double h = trace.dt[k], u = trace.torque(motor, stage), v = trace.speed(motor, stage);
    const double c = drive.getEffortFactor(u * v);
    const double power = c * (u * v) + std::pow(c * u / drive.motor_constant, 2);  // Eq. (1)
    out.peak_torque = getLarger(out.peak_torque, std::abs(u));
    out.peak_speed = getLarger(out.peak_speed, std::abs(v));
    out.energy += h * std::abs(u * v);
    out.electrical_energy += h * (power > 0 ? power : drive.regeneration * power);
    squares += h * u * u;
    duration += h;
  }
  out.rms_torque = duration > 0 ? std::sqrt(squares / duration) : 0;
  return out;
}

// What limits leave free counts as 0 of them.
void addShares(const MotorTrace& trace, Eigen::Index m, const Motor& motor, MotorMeasures& out) {
  double squares = 0, duration = 0;
  for (size_t k = 0; k < trace.dt.size(); ++k) {
    const Eigen::Index stage = static_cast<Eigen::Index>(k);
    const double u = trace.torque(m, stage), v = trace.speed(m, stage);
    out.envelope =
        getLarger(out.envelope, getLarger(std::abs(u) / motor.effort_limit, std::abs(v) / motor.velocity_limit));
    if (motor.hasEnvelope() && trace.dt[k] > 0)
      out.envelope = getLarger(out.envelope,
                               std::abs(motor.voltsPerEffort() * u + motor.voltsPerSpeed() * v) / motor.drive.voltage);
    squares += trace.dt[k] * std::pow(motor.getEffortFactor(u * v) * u, 2);
    duration += trace.dt[k];
  }
  if (duration > 0) out.heat = std::sqrt(squares / duration) / motor.continuous_effort;
}

}  // namespace

std::vector<MotorConversion> makeDrives(const Model& model, const DriveTable& table) {
  const auto require = [&](bool ok, const std::string& element, const std::string& problem, const std::string& remedy) {
    if (!ok) throw InputError(model.name(), "drives: " + element, problem, remedy);
  };
  const auto requireConstant = [&](double value, const std::string& element) {
    require(value > 0 && std::isfinite(value), element, "it is not positive",
            "give newton metres per square root of watt");
  };
  if (table.motor_constant) requireConstant(*table.motor_constant, "motor_constant");
  require(table.regeneration >= 0 && table.regeneration <= 1, "regeneration", "it is outside 0 .. 1",
          "give the share that is given back");
  std::vector<MotorConversion> drives;
  for (const Motor& motor : model.motors())
    drives.push_back({table.motor_constant.value_or(1 / std::sqrt(motor.torqueLoss())), table.regeneration,
                      motor.drive.efficiency, motor.drive.back_efficiency});
  for (const auto& [name, constant] : table.motor_constants) {
    const std::vector<int> motors = findMotors(model, {name});
    require(!motors.empty(), "motor '" + name + "'", "there is no such motor", "`bielle info` lists them");
    requireConstant(constant, "motor '" + name + "'");
    for (int motor : motors) drives[static_cast<size_t>(motor)].motor_constant = constant;
  }
  return drives;
}

MotorTrace makeMotorTrace(const Model& model, const std::vector<double>& dt, const ShootingTrajectory& trajectory) {
  MotorTrace trace;
  const Eigen::Index stages = static_cast<Eigen::Index>(dt.size());
  trace.dt = dt;
  trace.torque = trace.speed = MatrixXd::Zero(model.nu(), stages);
  double time = 0;
  for (Eigen::Index k = 0; k < stages; ++k) {
    const size_t stage = static_cast<size_t>(k);
    trace.time.push_back(time);
    time += dt[stage];
    if (dt[stage] > 0) trace.torque.col(k) = trajectory.us[stage];
    for (int m = 0; m < model.nu(); ++m)
      trace.speed(m, k) = trajectory.xs[stage][model.nq() + model.motors()[static_cast<size_t>(m)].dof];
  }
  return trace;
}

std::vector<MotorMeasures> calcMotorMeasures(const MotorTrace& trace, const std::vector<MotorConversion>& drives) {
  std::vector<MotorMeasures> out;
  for (Eigen::Index m = 0; m < trace.torque.rows(); ++m)
    out.push_back(calcMeasures(trace, m, drives.empty() ? MotorConversion() : drives[static_cast<size_t>(m)]));
  return out;
}

MotionMeasures calcMotionMeasures(const Model& model, const std::vector<double>& dt,
                                  const ShootingTrajectory& trajectory, const std::vector<MotorConversion>& drives) {
  MotionMeasures out;
  out.trace = makeMotorTrace(model, dt, trajectory);
  out.motors = calcMotorMeasures(out.trace, drives);
  LinkageConditioning conditioning(model, trajectory.xs.front().head(model.nq()));
  for (const VectorXd& x : trajectory.xs)
    out.conditioning = getLarger(out.conditioning, conditioning.calc(x.head(model.nq())));
  return out;
}

void addLimitMeasures(const Model& model, const ShootingTrajectory& trajectory, const std::set<Measure>& requested,
                      const BodyPairs& left_out, MotionMeasures& measures) {
  for (size_t m = 0; m < measures.motors.size(); ++m)
    addShares(measures.trace, static_cast<Eigen::Index>(m), model.motors()[m], measures.motors[m]);
  if (!model.serialJoints().empty()) {
    LinkageConditioning conditioning(model, trajectory.xs.front().head(model.nq()), LinkageSide::Joints);
    for (const VectorXd& x : trajectory.xs)
      measures.margin = getSmaller(measures.margin, 1 / conditioning.calc(x.head(model.nq())));
  }
  if (requested.count(Measure::DeadPointDistance)) {
    RowMatrixXd qs(static_cast<Eigen::Index>(trajectory.xs.size()), model.nq());
    for (Eigen::Index k = 0; k < qs.rows(); ++k) qs.row(k) = trajectory.xs[static_cast<size_t>(k)].head(model.nq());
    for (const DeadPointTrace& linkage : traceDeadPoints(model, qs))
      measures.dead_point_distance = getSmaller(measures.dead_point_distance, linkage.getNearest().distance);
  }
  if (!requested.count(Measure::Distance)) return;
  Workspace ws(model);
  const std::vector<ShapePair> pairs = listPairsBut(left_out, model);
  for (const VectorXd& x : trajectory.xs) {
    updatePlacements(model, ws, x.head(model.nq()));
    const NearestPair nearest = findNearestPair(model, ws.X_WB, pairs);
    if (nearest.pair < 0 || !(nearest.distance.distance < measures.distance)) continue;
    measures.distance = nearest.distance.distance;
    const ShapePair& pair = pairs[static_cast<size_t>(nearest.pair)];
    measures.nearest = describePair(model, model.shapes()[static_cast<size_t>(pair.b)].body,
                                    model.shapes()[static_cast<size_t>(pair.a)].body);
  }
}

bool isOfMotors(Measure measure) {
  switch (measure) {
    case Measure::PeakTorque:
    case Measure::RmsTorque:
    case Measure::Energy:
    case Measure::ElectricalEnergy:
    case Measure::Envelope:
    case Measure::Heat:
      return true;
    default:
      return false;
  }
}

const char* getUnit(Measure measure) {
  switch (measure) {
    case Measure::PeakTorque:
    case Measure::RmsTorque:
      return "N m";
    case Measure::Energy:
    case Measure::ElectricalEnergy:
      return "J";
    case Measure::Mass:
      return "kg";
    case Measure::DeadPointDistance:
      return "rad";
    case Measure::Distance:
      return "m";
    default:
      return "";
  }
}

const char* getName(Measure measure) {
  switch (measure) {
    case Measure::PeakTorque:
      return "peak_torque";
    case Measure::RmsTorque:
      return "rms_torque";
    case Measure::Energy:
      return "energy";
    case Measure::ElectricalEnergy:
      return "electrical_energy";
    case Measure::Cost:
      return "cost";
    case Measure::Workspace:
      return "workspace";
    case Measure::Mass:
      return "mass";
    case Measure::Envelope:
      return "envelope";
    case Measure::Heat:
      return "heat";
    case Measure::Margin:
      return "margin";
    case Measure::DeadPointDistance:
      return "dead_point_distance";
    case Measure::Distance:
      return "distance";
    case Measure::Range:
      return "range";
    case Measure::LeastRatio:
      return "least_ratio";
    case Measure::LargestRatio:
      return "largest_ratio";
    case Measure::Conditioning:
      break;
  }
  return "conditioning";
}

bool isOfJoints(Measure measure) {
  return measure == Measure::Range || measure == Measure::LeastRatio || measure == Measure::LargestRatio;
}

bool isOfRobot(Measure measure) {
  return measure == Measure::Workspace || measure == Measure::Mass || isOfJoints(measure);
}

bool isSum(Measure measure) {
  return measure == Measure::Energy || measure == Measure::ElectricalEnergy || measure == Measure::Cost;
}

bool isLeast(Measure measure) {
  switch (measure) {
    case Measure::Margin:
    case Measure::DeadPointDistance:
    case Measure::Distance:
    case Measure::Range:
    case Measure::LeastRatio:
      return true;
    default:
      return false;
  }
}

namespace {

// Of one motion.
double getMeasure(Measure measure, const std::vector<int>& motors, const MotionMeasures& motion) {
  if (measure == Measure::Cost) return motion.cost;
  double value = measure == Measure::Conditioning ? motion.conditioning : 0;
  for (int m : motors) {
    const MotorMeasures& motor = motion.motors[static_cast<size_t>(m)];
    if (measure == Measure::PeakTorque) value = getLarger(value, motor.peak_torque);
    if (measure == Measure::RmsTorque) value = getLarger(value, motor.rms_torque);
    if (measure == Measure::Envelope) value = getLarger(value, motor.envelope);
    if (measure == Measure::Heat) value = getLarger(value, motor.heat);
    if (measure == Measure::Energy) value += motor.energy;
    if (measure == Measure::ElectricalEnergy) value += motor.electrical_energy;
  }
  return value;
}

}  // namespace

double getMeasure(Measure measure, const std::vector<int>& motors, const std::vector<MotionMeasures>& motions,
                  const std::vector<double>& weights) {
  double value = measure == Measure::Margin ? 1 : isLeast(measure) ? std::numeric_limits<double>::infinity() : 0;
  for (size_t i = 0; i < motions.size(); ++i) {
    if (isLeast(measure)) {
      value = getSmaller(value, measure == Measure::Margin     ? motions[i].margin
                                : measure == Measure::Distance ? motions[i].distance
                                                               : motions[i].dead_point_distance);
      continue;
    }
    const double of_motion = (weights.empty() ? 1 : weights[i]) * getMeasure(measure, motors, motions[i]);
    value = isSum(measure) ? value + of_motion : getLarger(value, of_motion);
  }
  return value;
}

}  // namespace bielle
