#include "bielle/motion/squat.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "math/constants.h"
#include "model/number_text.h"
#include "model/rounded_text.h"
#include "motion/feasibility.h"
#include "motion/foot_tasks.h"
#include "motion/robot_size.h"
#include "motion/statics.h"

namespace bielle {
namespace {

constexpr double kTimeStep = 0.015;  // s

// \param given  time_step, 0 for the usual one
void check(const Model& model, const SquatOptions& o, double given) {
  listOptions(o).check();
  requireOption(given > 0 || o.time_step <= o.duration / 4, "duration",
                "it is shorter than four stages of " + formatNumber(1e3 * o.time_step, "%.3g") + " ms",
                "give seconds, e.g. 3");
  requireOption(o.time_step <= o.duration / 4, "time_step", "it exceeds a quarter of the motion",
                "give seconds, e.g. " + formatBelow(std::min(kTimeStep, o.duration / 4), 2));
  requireStages(o.duration + 2 * o.settle, o.time_step);
  requireGravity(model, o.friction);
  if (model.contacts().empty())
    throw InputError(model.name(), "contacts", "a squat needs feet, but the robot has no contact frames",
                     "add `contacts` to its YAML file");
}

// \param o  whose weights suit the size
StageSpec makeStage(const Model& model, const RobotSize& size, const SquatOptions& o,
                    const std::vector<ContactTarget>& contacts, const VectorXd& q0, const Vector3d& com) {
  StageSpec stage;
  stage.dt = o.time_step;
  stage.constraints = makeConstraintSet(model, contacts);
  setClosureGains({o.closure_kp, o.closure_kd}, stage.constraints);
  stage.state = {o.state_weight, q0, VectorXd::Zero(model.nv()), makeStateWeights(model), calcWeightAxes(size)};
  if (model.hasFreeFlyer()) stage.state.weights.segment<2>(3).setConstant(o.torso_weight);
  raiseMotorWeights(model, o.motor_weight, stage.state.weights);
  scaleStateWeights(model, size, stage.state.weights);
  stage.control = {o.control_weight, VectorXd::Zero(model.nu()), makeControlWeights(model, size)};
  stage.costs.push_back(
      {"com height", o.com_weight, Activation::makeQuadratic(Vector3d::UnitZ()), makeComPosition(com), true});
  const double weight = model.mass() * model.gravity().norm();
  addGroundCosts(model, {o.force_weight, o.pressure_weight, ForceAxes::Contact, size.length},
                 VectorXd::Constant(contacts.size(), weight / contacts.size()), stage);
  addWrenchCones(model, o.friction, o.cone_margin, stage);
  return stage;
}

std::string nameSupport(size_t feet) {
  return feet == 1 ? "single support" : feet == 2 ? "double support" : "support by " + std::to_string(feet) + " feet";
}

}  // namespace

void describe(OptionFields& f, SquatOptions& o) {
  f.number("depth", o.depth, "1", {0.05, 2}, "lowest height of the centre of mass divided by its initial height");
  f.number("duration", o.duration, "s", kPositive, "time to go down and come back");
  f.number("settle", o.settle, "s", kNotNegative, "time at rest before and after");
  f.number("time_step", o.time_step, "s", kNotNegative, "length of a shooting stage; 0: 15 ms, less with springs");
  f.number("com_weight", o.com_weight, "1/m^2", kNotNegative, "follow the height of the centre of mass");
  describe(f, static_cast<MotionOptions&>(o));
  f.number("closure_kp", o.closure_kp, "1/s^2", kNotNegative, "position gain of the stabilisation of closures");
  f.number("closure_kd", o.closure_kd, "1/s", kNotNegative, "velocity gain of the stabilisation of closures");
}

double calcSquatHeight(const SquatOptions& o, double t) {
  const double s = (t - o.settle) / o.duration;
  if (s <= 0 || s >= 1) return 1;
  return 1 - (1 - o.depth) * 0.5 * (1 - std::cos(2 * kPi * s));
}

MotionPlan planSquat(const Model& model, const SquatOptions& requested, const StandingRobot& standing) {
  SquatOptions options = requested;
  if (options.time_step == 0)
    options.time_step = std::min(kTimeStep, calcSpringStage(model, standing.q, makeContactTargets(standing, 0, 0)));
  check(model, options, requested.time_step);
  const RobotSize size = calcRobotSize(model, standing);
  scaleWeights(size, options);
  options.com_weight /= size.length * size.length * size.time;
  const VectorXd& q0 = standing.q;
  const Vector3d& com0 = standing.com;
  const std::vector<ContactTarget> contacts = makeContactTargets(standing, options.contact_kp, options.contact_kd);
  double level = 0;  // of the soles
  for (const ContactTarget& contact : contacts) level += contact.X_WT.p.z() / static_cast<double>(contacts.size());

  MotionPlan plan;
  plan.name = "squat";
  plan.ground = makeGroundUnder(model, contacts);
  plan.ground.friction = options.friction;
  const int nodes = static_cast<int>(std::ceil((options.duration + 2 * options.settle) / options.time_step - 1e-9));
  plan.schedule.phases = {{nameSupport(contacts.size()), nodes, options.time_step, contacts}};
  for (int k = 0; k <= nodes; ++k) {
    const double height = (com0.z() - level) * calcSquatHeight(options, k * options.time_step);
    const Vector3d com(com0.x(), com0.y(), level + height);
    plan.stages.push_back(makeStage(model, size, options, contacts, q0, com));
  }
  StageSpec& terminal = plan.stages.back();
  terminal.constraints = {};
  terminal.control.weight = 0;
  terminal.state.weight *= size.time;
  terminal.path_constraints.clear();
  terminal.costs.resize(1);  // the height; forces have no meaning at the terminal node
  terminal.costs[0].weight *= size.time;
  addRest(model, size, terminal);

  VectorXd x0 = VectorXd::Zero(model.nq() + model.nv());
  x0.head(model.nq()) = q0;
  plan.guess.xs.assign(nodes + 1, x0);
  plan.guess.us.assign(nodes, calcStaticTorques(model, makeConstraintSet(model, contacts), q0).u);
  plan.q_start = plan.q_end = q0;
  plan.options = listOptions(requested).listValues();
  Goal depth{GoalKind::Height, "depth", options.depth, calcTolerance(1 - options.depth, 0.01), 0, nodes};
  depth.contacts = getContactNames(model, contacts);
  plan.goals = {depth};
  return plan;
}

Motion makeSquat(const Model& model, const SquatOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planSquat(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
