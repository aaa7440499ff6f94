#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "motion/applied_options.h"

namespace bielle {
namespace {

// A limit of a coordinate or of a motor's power.
struct Bound {
  std::string name;
  int index = 0;  // dof or motor
  double lower = 0, upper = 0;
  double scale = std::isfinite(upper - lower) ? 0.5 * (upper - lower) : 1;
};

// Values by motor: those given, except where they are replaced by name.
VectorXd replaceByName(const Model& model, VectorXd values, const std::map<std::string, double>& given,
                       const std::string& what) {
  for (const auto& [name, value] : given) {
    const int motor = model.findMotor(name);
    const std::string element = what + " limit of '" + name + "'";
    if (motor < 0) {
      std::string known;
      for (const Motor& m : model.motors()) known += (known.empty() ? "" : ", ") + m.name;
      throw InputError(model.name(), element, "there is no such motor", "choose one of: " + known);
    }
    if (!(value > 0)) throw InputError(model.name(), element, "it is not positive", "give a positive limit");
    values[motor] = value;
  }
  return values;
}

}  // namespace

VectorXd getEffortLimits(const Model& model, const LimitOptions& options) {
  VectorXd efforts(model.nu());
  for (int m = 0; m < model.nu(); ++m) efforts[m] = model.motors()[m].effort_limit;
  return replaceByName(model, efforts, options.efforts, "effort");
}

namespace {

std::vector<Bound> listRanges(const Model& model, const VectorXd& q0) {
  std::vector<Bound> bounds;
  for (int k = 0; k < model.nv(); ++k) {
    const double lower = model.lowerLimits()[k], upper = model.upperLimits()[k];
    const Joint& joint = model.joints()[model.dofs()[k].joint];
    if (joint.nv != 1 || !(std::isfinite(lower) || std::isfinite(upper))) continue;
    const std::string element = "joint '" + joint.name + "'";
    if (lower == upper)
      throw InputError(model.name(), element, "its range has zero width, so no constraint can enforce it",
                       "make the joint fixed, or widen its range");
    const double q = q0[joint.idx_q];
    if (q < lower || q > upper)
      throw InputError(model.name(), element,
                       "its range excludes the starting posture, where the joint is at " + std::to_string(q),
                       "widen its range, or start elsewhere");
    bounds.push_back({"range of " + joint.name, k, lower, upper});
  }
  return bounds;
}

std::vector<Bound> listVelocities(const Model& model, const LimitOptions& options) {
  VectorXd limits = model.velocityLimits(), of_motors(model.nu());
  for (int m = 0; m < model.nu(); ++m) of_motors[m] = limits[model.motors()[m].dof];
  of_motors = replaceByName(model, of_motors, options.velocities, "velocity");
  for (int m = 0; m < model.nu(); ++m) limits[model.motors()[m].dof] = of_motors[m];
  std::vector<Bound> bounds;
  for (int k = 0; k < model.nv(); ++k)
    if (std::isfinite(limits[k]))
      bounds.push_back({"velocity of " + model.joints()[model.dofs()[k].joint].name, k, -limits[k], limits[k]});
  return bounds;
}

std::vector<Bound> listPowers(const Model& model, const LimitOptions& options) {
  const double none = std::numeric_limits<double>::infinity();
  const VectorXd limits = replaceByName(model, VectorXd::Constant(model.nu(), none), options.powers, "power");
  std::vector<Bound> bounds;
  for (int m = 0; m < model.nu(); ++m)
    if (std::isfinite(limits[m])) bounds.push_back({"power of " + model.motors()[m].name, m, -limits[m], limits[m]});
  return bounds;
}

std::vector<Bound> listVoltages(const Model& model) {
  std::vector<Bound> bounds;
  for (int m = 0; m < model.nu(); ++m)
    if (const Motor& motor = model.motors()[m]; motor.hasEnvelope())
      bounds.push_back({"voltage of " + motor.name, m, -motor.drive.voltage, motor.drive.voltage});
  return bounds;
}

void addConstraint(const Bound& bound, std::unique_ptr<Residual> residual, StageSpec& stage) {
  const auto make = [](double value) { return VectorXd::Constant(1, value); };
  stage.path_constraints.push_back(
      {bound.name, std::move(residual), make(bound.lower), make(bound.upper), make(bound.scale)});
}

}  // namespace

bool addLimits(const Model& model, const LimitOptions& options, const VectorXd& q0, std::vector<StageSpec>& stages) {
  if (!options.enforced) {
    for (StageSpec& stage : stages)
      stage.effort_limits.setConstant(model.nu(), std::numeric_limits<double>::infinity());
    return false;
  }
  const double margin = options.dead_point_margin;
  requireOption(margin >= 0 && margin < 1, "dead_point_margin", "it is outside 0 .. 1", "give a share, e.g. 0.15");
  const VectorXd efforts = getEffortLimits(model, options);
  const std::vector<Bound> ranges = listRanges(model, q0), velocities = listVelocities(model, options),
                           powers = listPowers(model, options), voltages = listVoltages(model);
  const std::vector<Linkage> linkages = margin > 0 ? listLinkages(model, q0) : std::vector<Linkage>();
  for (size_t k = 0; k < stages.size(); ++k) {
    StageSpec& stage = stages[k];
    stage.effort_limits = efforts;
    const bool step = k + 1 < stages.size() && stage.kind == StageKind::Dynamics;
    for (size_t i = 0; step && i < voltages.size(); ++i)
      addConstraint(voltages[i], makeMotorVoltage(model, {voltages[i].index}), stage);
    if (k == 0) continue;
    for (const Bound& bound : ranges) addConstraint(bound, makeJointPosition(model, {bound.index}), stage);
    for (const Bound& bound : velocities) addConstraint(bound, makeJointVelocity({bound.index}), stage);
    for (const Linkage& linkage : linkages)
      addConstraint({"dead points of " + linkage.output, 0, margin, 1 / margin, 1}, makeTransmission(linkage), stage);
    for (size_t i = 0; step && i < powers.size(); ++i)
      addConstraint(powers[i], makeMotorPower(model, {powers[i].index}), stage);
  }
  return efforts.array().isFinite().any();
}

}  // namespace bielle
