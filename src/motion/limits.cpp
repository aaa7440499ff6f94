#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "motion/applied_options.h"

namespace bielle {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

PathConstraint makeBound(const std::string& name, double lower, double upper, std::unique_ptr<Residual> residual) {
  const auto make = [](double value) { return VectorXd::Constant(1, value); };
  const double scale = std::isfinite(upper - lower) ? 0.5 * (upper - lower) : 1;
  return {name, std::move(residual), make(lower), make(upper), make(scale)};
}

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

VectorXd getVelocityLimits(const Model& model, const LimitOptions& options) {
  VectorXd limits = model.velocityLimits(), of_motors(model.nu());
  for (int m = 0; m < model.nu(); ++m) of_motors[m] = limits[model.motors()[m].dof];
  of_motors = replaceByName(model, of_motors, options.velocities, "velocity");
  for (int m = 0; m < model.nu(); ++m) limits[model.motors()[m].dof] = of_motors[m];
  return limits;
}

VectorXd getPowerLimits(const Model& model, const LimitOptions& options) {
  return replaceByName(model, VectorXd::Constant(model.nu(), kNone), options.powers, "power");
}

namespace {

std::vector<PathConstraint> listRanges(const Model& model, const VectorXd& q0) {
  std::vector<PathConstraint> bounds;
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
    bounds.push_back(makeBound("range of " + joint.name, lower, upper, makeJointPosition(model, {k})));
  }
  return bounds;
}

std::vector<PathConstraint> listVelocities(const Model& model, const LimitOptions& options) {
  const VectorXd limits = getVelocityLimits(model, options);
  std::vector<PathConstraint> bounds;
  for (int k = 0; k < model.nv(); ++k)
    if (std::isfinite(limits[k]))
      bounds.push_back(makeBound("velocity of " + model.joints()[model.dofs()[k].joint].name, -limits[k], limits[k],
                                 makeJointVelocity({k})));
  return bounds;
}

std::vector<PathConstraint> listPowers(const Model& model, const LimitOptions& options) {
  const VectorXd limits = getPowerLimits(model, options);
  std::vector<PathConstraint> bounds;
  for (int m = 0; m < model.nu(); ++m)
    if (std::isfinite(limits[m]))
      bounds.push_back(
          makeBound("power of " + model.motors()[m].name, -limits[m], limits[m], makeMotorPower(model, {m})));
  return bounds;
}

std::vector<PathConstraint> listVoltages(const Model& model) {
  std::vector<PathConstraint> bounds;
  for (int m = 0; m < model.nu(); ++m)
    if (const Motor& motor = model.motors()[m]; motor.hasEnvelope())
      bounds.push_back(makeBound("voltage of " + motor.name, -motor.drive.voltage, motor.drive.voltage,
                                 makeMotorVoltage(model, {m})));
  return bounds;
}

std::vector<PathConstraint> listTransmissions(const Model& model, const VectorXd& q0, const LimitOptions& options) {
  std::vector<PathConstraint> bounds;
  std::map<std::string, double> margins = options.dead_point_margins;
  for (const Linkage& linkage : listLinkages(model, q0)) {
    margins.erase(linkage.output);
    const double margin = getDeadPointMargin(options, linkage.output);
    if (margin == 0) continue;
    bounds.push_back(
        makeBound("dead points of " + linkage.output, margin, 1 / margin, makeTransmission(linkage, 1 / margin)));
    bounds.back().scale[0] = 1;
  }
  if (!margins.empty())
    requireOption(false, "dead_point_margin", "there is no linkage of '" + margins.begin()->first + "'",
                  "see `bielle info`");
  return bounds;
}

void append(const std::vector<PathConstraint>& bounds, std::vector<PathConstraint>& all) {
  all.insert(all.end(), bounds.begin(), bounds.end());
}

}  // namespace

double getDeadPointMargin(const LimitOptions& options, const std::string& linkage) {
  const auto own = options.dead_point_margins.find(linkage);
  return own == options.dead_point_margins.end() ? options.dead_point_margin
                                                 : std::max(options.dead_point_margin, own->second);
}

Limits::Limits(const Model& model, const LimitOptions& options, const VectorXd& q0)
    : efforts_(VectorXd::Constant(model.nu(), kNone)) {
  if (!options.enforced) return;
  const auto requireShare = [](double margin, const std::string& name) {
    requireOption(margin >= 0 && margin < 1, name, "it is outside 0 .. 1", "give a share, e.g. 0.15");
  };
  requireShare(options.dead_point_margin, "dead_point_margin");
  for (const auto& [linkage, margin] : options.dead_point_margins)
    requireShare(margin, "dead_point_margin of '" + linkage + "'");
  efforts_ = getEffortLimits(model, options);
  states_ = listRanges(model, q0);
  append(listVelocities(model, options), states_);
  if (options.dead_point_margin > 0 || !options.dead_point_margins.empty())
    append(listTransmissions(model, q0, options), states_);
  powers_ = listPowers(model, options);
  voltages_ = listVoltages(model);
}

bool Limits::addTo(std::vector<StageSpec>& stages, bool cycle) const {
  for (size_t k = 0; k < stages.size(); ++k) {
    StageSpec& stage = stages[k];
    stage.effort_limits = efforts_;
    const bool step = k + 1 < stages.size() && stage.kind == StageKind::Dynamics;
    if (step) append(voltages_, stage.path_constraints);
    if (k > 0) append(states_, stage.path_constraints);
    if (step && (k > 0 || cycle)) append(powers_, stage.path_constraints);
  }
  return efforts_.array().isFinite().any();
}

}  // namespace bielle
