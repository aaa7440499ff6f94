#include "bielle/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/assembly_refinement.h"
#include "motion/applied_options.h"
#include "motion/motor_scale.h"
#include "motion/neighbour_plans.h"
#include "motion/statics.h"

namespace bielle {

void requireStages(double seconds, double time_step) {
  requireOption(seconds <= 1e5 * time_step, "time_step", "it divides the motion into more than 100000 stages",
                "give longer stages, e.g. 0.01 s, or a shorter motion");
}

void requireOption(bool ok, const std::string& option, const std::string& problem, const std::string& remedy) {
  if (!ok) throw InputError("", "option '" + option + "'", problem, remedy);
}

namespace {

// A problem without limits has none of the motors either.
void leaveTorquesFree(const Model& model, std::vector<StageSpec>& stages) {
  for (StageSpec& stage : stages) stage.effort_limits.setConstant(model.nu(), std::numeric_limits<double>::infinity());
}

void requireFixedCycle(const ProblemOptions& options) {
  const auto require = [](bool ok, const char* problem, const char* remedy) {
    requireOption(ok, "periodic", problem, remedy);
  };
  require(!options.timings.areGiven(), "a cycle has no free durations", "leave out --free-timings");
  require(options.objective.objective != Objective::PeakTorque, "a cycle of least peak torque is not solved",
          "take --objective effort or energy");
  require(options.formulation == Formulation::Reduced, "the loops of its first state have to be closed",
          "leave out --formulation full");
}

}  // namespace

Motion makeMotion(const Model& model, MotionPlan plan, const ProblemOptions& options) {
  if (plan.cycle) requireFixedCycle(options);
  for (StageSpec& stage : plan.stages) stage.step = options.step;
  Motion motion;
  motion.within_limits = Limits(model, options.limits, plan.q_start).addTo(plan.stages, plan.cycle.has_value());
  freeTimings(options.timings, plan.schedule, plan.stages);
  for (StageSpec& stage : plan.stages)  // at an impact h vanishes, and gains have no effect
    if (stage.dt > 0) limitGains(options.step, stage.dt * std::max(1.0, stage.timing.upper), stage.constraints);
  setObjective(model, options.objective, plan.stages);
  motion.problem_options = options;
  if (!motion.within_limits) leaveTorquesFree(model, plan.stages);
  motion.problem = std::make_shared<RobotProblem>(model, plan.q_start, VectorXd::Zero(model.nv()),
                                                  std::move(plan.stages), options.formulation);
  static_cast<MotionOutline&>(motion) = std::move(plan);
  fitTimings(*motion.problem, motion.guess);
  return motion;
}

VectorXd makeStandingPosture(const Model& model) { return makeStandingPosture(model, nullptr); }

VectorXd makeStandingPosture(const Model& model, NeighbourPlans* neighbours) {
  if (model.references().empty())
    throw InputError(model.name(), "references", "the robot has no reference posture to start from",
                     "add `references: {half_sitting: ...}` to its YAML file");
  const Reference* standing = &model.references().front();
  for (const Reference& reference : model.references())
    if (reference.name == "half_sitting") standing = &reference;
  AssemblyResult result;
  if (neighbours && neighbours->posture.size() == model.nq())
    result = refineAssembly(model, makeReferenceProblem(model, *standing), neighbours->posture);
  if (result.status != NumericalStatus::Ok) {
    result = assembleReference(model, standing->name);
    if (neighbours && result.status == NumericalStatus::Ok) {  // as exact as those of the others
      const AssemblyResult refined = refineAssembly(model, makeReferenceProblem(model, *standing), result.q);
      if (refined.status == NumericalStatus::Ok) result = refined;
      neighbours->posture = result.q;
    }
  }
  if (result.status != NumericalStatus::Ok)
    throw InputError(model.name(), "reference '" + standing->name + "'", result.message, "correct its targets");
  return settleReference(model, *standing, result.q);
}

StandingRobot makeStandingRobot(const Model& model) { return makeStandingRobot(model, makeStandingPosture(model)); }

StandingRobot makeStandingRobot(const Model& model, const VectorXd& q, NeighbourPlans* neighbours) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  StandingRobot standing{q, calcCom(model, ws), {}, neighbours};
  for (const ContactFrame& contact : model.contacts())
    standing.contacts.push_back(getPlacement(ws, contact.body, contact.X_BF));
  return standing;
}

VectorXd carryPosture(const Model& model, ConstVectorRef q, const SE3& X) {
  VectorXd carried = q;
  if (!model.hasFreeFlyer()) return carried;
  carried.head<3>() = X.act(q.head<3>());
  const Eigen::Quaterniond turn(X.R), base(Eigen::Vector4d(q.segment<4>(3)));
  carried.segment<4>(3) = (turn * base).coeffs();
  return carried;
}

VectorXd carryState(const Model& model, const VectorXd& x, const SE3& X) {
  VectorXd carried = x;
  carried.head(model.nq()) = carryPosture(model, x.head(model.nq()), X);
  return carried;
}

void limitGains(StepRule rule, double h, ConstraintSet& constraints) {
  const double most = rule == StepRule::Euler ? 1.0 / 2 : 1.0 / 3;
  for (Closure& closure : constraints.closures) {
    closure.kp = std::min(closure.kp, most / (h * h));
    closure.kd = std::min(closure.kd, 1 / h);
  }
}

void setClosureGains(const ContactGains& gains, ConstraintSet& constraints) {
  for (int c = 0; c < constraints.num_loops; ++c) {
    constraints.closures[c].kp = gains.kp;
    constraints.closures[c].kd = gains.kd;
  }
}

std::vector<ContactTarget> makeContactTargets(const Model& model, ConstVectorRef q, const std::vector<int>& contacts,
                                              double kp, double kd) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  std::vector<ContactTarget> targets;
  for (int c : contacts)
    targets.push_back({c, getPlacement(ws, model.contacts()[c].body, model.contacts()[c].X_BF), kp, kd});
  return targets;
}

std::vector<ContactTarget> makeContactTargets(const StandingRobot& standing, double kp, double kd) {
  std::vector<ContactTarget> targets;
  for (const SE3& X : standing.contacts) targets.push_back({static_cast<int>(targets.size()), X, kp, kd});
  return targets;
}

std::vector<std::string> getContactNames(const Model& model, const std::vector<ContactTarget>& targets) {
  std::vector<std::string> names;
  for (const ContactTarget& target : targets) names.push_back(model.contacts()[target.contact].name);
  return names;
}

VectorXd selectMainJoints(const Model& model) {
  VectorXd selected = VectorXd::Zero(model.nv());
  for (int i : model.serialJoints()) selected.segment(model.joints()[i].idx_v, model.joints()[i].nv).setOnes();
  if (!model.serialJoints().empty()) return selected;
  selected.setOnes();
  if (model.hasFreeFlyer()) selected.head<6>().setZero();
  return selected;
}

VectorXd makeStateWeights(const Model& model) {
  const int nv = model.nv();
  VectorXd importance = VectorXd::Zero(2 * nv);
  if (model.hasFreeFlyer()) {
    importance.segment<6>(0) << 0, 0, 0, 50, 50, 0;
    importance.segment<6>(nv) << 0, 0, 0, 3, 3, 1;
  }
  const VectorXd selected = selectMainJoints(model);
  for (int k = 0; k < nv; ++k) {
    if (selected[k] == 0) continue;
    importance[k] = model.joints()[model.dofs()[k].joint].position_importance;
    importance[nv + k] = model.joints()[model.dofs()[k].joint].velocity_importance;
  }
  return importance.cwiseAbs2();
}

void describe(OptionFields& f, MotionOptions& o) {
  f.number("state_weight", o.state_weight, "1", kNotNegative, "stay near the standing posture, at rest");
  f.number("torso_weight", o.torso_weight, "1", kNotNegative,
           "keep the torso upright, within the state regularization");
  f.number("motor_weight", o.motor_weight, "1", kNotNegative, "keep motors slow, within the state regularization");
  f.number("control_weight", o.control_weight, "1/(N m)^2", kNotNegative, "keep motor torques small");
  f.number("force_weight", o.force_weight, "1", kNotNegative,
           "spread the load evenly over feet and time, relative to (m g)^2");
  f.number("pressure_weight", o.pressure_weight, "1", kNotNegative,
           "keep the centre of pressure in the middle of the sole");
  f.number("friction", o.friction, "1", kPositive, "friction coefficient");
  f.number("cone_margin", o.cone_margin, "1", {0, 0.99}, "share of friction and soles that wrenches leave unused");
  f.number("contact_kp", o.contact_kp, "1/s^2", kNotNegative,
           "position gain of the stabilisation of contacts, in jumps also of closures (at most 1/(3 h^2) with the time "
           "step h; Euler: 1/(2 h^2))");
  f.number("contact_kd", o.contact_kd, "1/s", kNotNegative,
           "velocity gain of the stabilisation of contacts, in jumps also of closures (at most 1/h)");
}

void raiseMotorWeights(const Model& model, double weight, VectorXd& weights) {
  for (const Motor& motor : model.motors()) {
    double& w = weights[model.nv() + motor.dof];
    w = std::max(w, isLinear(model, motor) ? weight / (kScrewArm * kScrewArm) : weight);
  }
}

namespace {

// \param unit  force or impulse that counts as 1   \param normal, others  least of the normal row and of all others, over it
void addCone(const Model& model, int c, double friction, double margin, double unit, double normal, double others,
             ForceAxes axes, StageSpec& stage) {
  const ConstraintSet& set = stage.constraints;
  const ContactFrame& contact = model.contacts()[set.getContact(c)];
  const double X = (1 - margin) * contact.half_length, Y = (1 - margin) * contact.half_width;
  // Points and edges tilt on the ground; a point has no planned attitude.
  if (contact.kind != ContactKind::Surface6D) axes = ForceAxes::Ground;
  std::unique_ptr<Residual> cone = makeWrenchCone(set, c, X, Y, (1 - margin) * friction / std::sqrt(2), axes);
  const int rows = cone->size();
  const double least = 0.01;  // m, of soles without size
  VectorXd scale = VectorXd::Constant(rows, unit);
  if (contact.kind == ContactKind::Edge5D) {
    scale.tail<6>() *= std::max(least, X);
  } else if (contact.kind == ContactKind::Surface6D) {
    scale.segment<2>(5) *= std::max(least, Y);
    scale.segment<2>(7) *= std::max(least, X);
    scale.tail<8>() *= std::max(least, X + Y);
  }
  VectorXd lower = others * scale;
  lower[0] = normal * unit;
  stage.path_constraints.push_back({"wrench cone of " + contact.name, std::move(cone), lower,
                                    VectorXd::Constant(rows, std::numeric_limits<double>::infinity()), scale});
}

}  // namespace

void addWrenchCones(const Model& model, double friction, double margin, StageSpec& stage, ForceAxes axes) {
  constexpr double kLeastLoad = 1e-3;
  const ConstraintSet& set = stage.constraints;
  for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c)
    addCone(model, c, friction, margin, model.mass() * model.gravity().norm(), kLeastLoad, 0, axes, stage);
}

void addImpulseCones(const Model& model, double friction, double margin, int landing, StageSpec& stage) {
  constexpr double kApex = 1e-4;
  const ConstraintSet& set = stage.constraints;
  for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c) {
    const double least = set.getContact(c) == landing ? 0 : -kApex;
    addCone(model, c, friction, margin, model.mass(), least, least, ForceAxes::Contact, stage);
  }
}

void addGroundCosts(const Model& model, const GroundCosts& costs, const VectorXd& loads, StageSpec& stage) {
  const ConstraintSet& set = stage.constraints;
  const double weight = model.mass() * model.gravity().norm();
  for (int c = set.num_loops; c < static_cast<int>(set.closures.size()); ++c) {
    const ContactFrame& contact = model.contacts()[set.getContact(c)];
    const int rows = countForces(set, c);
    VectorXd reference = VectorXd::Zero(rows);
    reference[2] = loads[c - set.num_loops];
    VectorXd weights = VectorXd::Ones(rows);
    weights.tail(rows - 3) /= costs.arm * costs.arm;
    if (costs.force_weight != 0)
      stage.costs.push_back({"force " + contact.name, costs.force_weight / (weight * weight),
                             Activation::makeQuadratic(weights), makeContactForce(set, c, reference, costs.axes)});
    if (costs.pressure_weight == 0 || rows != 6 || contact.half_length <= 0) continue;
    const double half_length = contact.half_length, half_width = contact.half_width;  // the latter is none of edges
    const Eigen::Vector2d pressure(1 / (half_length * half_length), half_width > 0 ? 1 / (half_width * half_width) : 0);
    stage.costs.push_back({"pressure " + contact.name, costs.pressure_weight, Activation::makeQuadratic(pressure),
                           makeCenterOfPressure(set, c, costs.axes)});
  }
}

}  // namespace bielle
