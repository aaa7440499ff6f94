#include "motion/posture_checks.h"

#include <algorithm>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "model/rounded_text.h"
#include "motion/applied_options.h"
#include "motion/motor_scale.h"

namespace bielle {
namespace {

// Of the limits, at a start at rest. It need not be held: a squat may begin to sink at once, and a biped with serial knees
// straightens its legs first with limits that are 1.4 times too low; with 1.75 and 2.3 times no motion was found.
constexpr double kTooWeak = 1.5;

// What planned postures need beyond what is allowed before it is doubtful: motions find others. Walks of rsu_biped were found with 0.7
// of the torques, and with a third to a half of the friction; with 0.11 of the power, but in four times the iterations.
constexpr double kDoubtfulEffort = 1.25, kDoubtfulPower = 2, kDoubtfulFriction = 2;

// Velocities are those between postures that are so far apart, since the guess goes from one to the next in small jumps, s.
constexpr double kApart = 0.1;

std::string quote(const std::string& kind, const std::string& name) { return kind + " '" + name + "'"; }

}  // namespace

PostureChecks::PostureChecks(const Motion& motion, const TellDoubt& tell, const Vector3d& com)
    : motion_(motion),
      problem_(*motion.problem),
      model_(problem_.model()),
      tell_(tell),
      ws_(model_),
      gravity_(model_.gravity().norm()),
      com_(com) {
  start_.phase = &motion.schedule.phases.front();
  listMoments();
}

std::string PostureChecks::formatEffort(const Motor& motor, double value) const {
  return formatNumber(value, "%.3g") + (isLinear(model_, motor) ? " N" : " N m");
}

// The first and the middle node of every phase with feet on the ground.
void PostureChecks::listMoments() {
  std::vector<const ContactPhase*> phases;
  for (const ContactPhase& phase : motion_.schedule.phases)
    if (phase.dt > 0 || phase.contacts.empty()) phases.push_back(&phase);
  const auto getFlight = [&](size_t i) {  // s
    return i < phases.size() && phases[i]->contacts.empty() ? phases[i]->nodes * phases[i]->dt : 0;
  };
  int node = 0;
  double time = 0;
  size_t i = 0;
  for (const ContactPhase& phase : motion_.schedule.phases) {
    const bool timed = i < phases.size() && phases[i] == &phase;
    const StageSpec& spec = problem_.spec(node);
    const double dt = phase.dt * (spec.timing.phase >= 0 ? spec.timing.upper : 1);
    if (timed && !phase.contacts.empty()) {
      // A flight of the time T takes off, and ends, with the velocity g T / 2, which the ground gives, and takes.
      const double flights = (i > 0 ? getFlight(i - 1) : 0) + getFlight(i + 1);
      const double load = 1 + 0.5 * flights / (phase.nodes * phase.dt);
      moments_.push_back({node, time, &phase, load, false});
      moments_.push_back({node + phase.nodes / 2, time + phase.nodes / 2 * dt, &phase, load, true});
    }
    node += phase.nodes;
    time += phase.nodes * dt;
    if (timed) ++i;
  }
}

// Acceleration of the centre of mass beyond that at rest; in single support, while the weight falls past a sole that is not under
// it as the linear inverted pendulum does, from the nearest place of the sole.
Vector3d PostureChecks::calcFall(const Moment& moment, const Vector3d& com) const {
  Vector3d a = (moment.load - 1) * gravity_ * Vector3d::UnitZ();
  const std::vector<ContactTarget>& feet = moment.phase->contacts;
  if (feet.size() == 1 && model_.hasFreeFlyer()) {
    const ContactFrame& sole = getContact(feet[0]);
    Vector3d p = feet[0].X_WT.inverse().act(com);
    const double height = com.z() - feet[0].X_WT.p.z();
    p = feet[0].X_WT.act(Vector3d(std::clamp(p.x(), -sole.half_length, sole.half_length),
                                  std::clamp(p.y(), -sole.half_width, sole.half_width), 0));
    if (height > 0) a.head<2>() = moment.load * gravity_ / height * (com - p).head<2>();
  }
  return a;
}

// Torques that hold a posture of the plan.
HoldingShare PostureChecks::calcShare(const Moment& moment, ConstVectorRef q, const Vector3d& com,
                                      const VectorXd& limits) const {
  return calcHoldingShare(model_, makeConstraintSet(model_, moment.phase->contacts), q, calcFall(moment, com), limits,
                          motion_.ground.friction);
}

// With the voltage of the supply, at standstill.
VectorXd PostureChecks::getLimits(int node) const {
  VectorXd limits = problem_.spec(node).effort_limits;
  if (limits.size() == 0) limits.setConstant(model_.nu(), std::numeric_limits<double>::infinity());
  for (int m = 0; m < model_.nu(); ++m)
    if (const Motor& motor = model_.motors()[static_cast<size_t>(m)];
        motor.hasEnvelope() && motion_.problem_options.limits.enforced)
      limits[m] = std::min(limits[m], motor.drive.voltage / motor.voltsPerEffort());
  return limits;
}

std::string PostureChecks::listMotors(const VectorXd& u, const VectorXd& limits) const {
  std::string list;
  for (int m = 0; m < model_.nu(); ++m)
    if (std::abs(u[m]) > limits[m]) {
      const Motor& motor = model_.motors()[static_cast<size_t>(m)];
      list += (list.empty() ? "" : ", ") + motor.name + " needs " + formatEffort(motor, std::abs(u[m])) +
              ", its limit is " + formatEffort(motor, limits[m]);
    }
  return list;
}

void PostureChecks::checkStart() {
  const VectorXd limits = getLimits(0);
  if (start_.phase->contacts.empty() && model_.hasFreeFlyer()) return;
  const HoldingShare share = calcShare(start_, getStart(), com_, limits);
  if (!share.isTooMuch()) return;
  int weakest = 0;
  std::string remedy;
  for (int m = 0; m < model_.nu(); ++m) {
    if (std::abs(share.u[m]) / limits[m] > std::abs(share.u[weakest]) / limits[weakest]) weakest = m;
    if (std::abs(share.u[m]) > limits[m])
      remedy += " --limit " + model_.motors()[static_cast<size_t>(m)].name + "=" +
                formatNumber(1.05 * std::abs(share.u[m]), "%.3g");
  }
  const std::string problem = "the starting posture cannot be held: " + listMotors(share.u, limits) +
                              " (however the load is shared, " + formatNumber(share.least, "%.3g") +
                              " times the limits)";
  remedy = "give larger limits (" + remedy.substr(1) + "), a start with straighter legs, or ignore them (--no-limits)";
  held_ = true;
  if (startsAtRest() && share.least > kTooWeak)
    throw InputError(model_.name(), quote("motor", model_.motors()[static_cast<size_t>(weakest)].name), problem,
                     remedy);
  if (tell_) tell_(problem, remedy);
}

void PostureChecks::doubt() {
  std::vector<Need> efforts(static_cast<size_t>(model_.nu())), powers(efforts),
      speeds(static_cast<size_t>(model_.nv()));
  const VectorXd velocity_limits = motion_.problem_options.limits.enforced
                                       ? getVelocityLimits(model_, motion_.problem_options.limits)
                                       : VectorXd::Constant(model_.nv(), std::numeric_limits<double>::infinity());
  Need reach, friction{0, motion_.ground.friction, {}};
  std::string foot;
  const Moment* before = nullptr;
  for (const Moment& moment : moments_) {
    const VectorXd q = getPosture(moment.node);
    updatePositions(model_, ws_, q);
    if (needReach(moment, reach, foot)) {
      before = nullptr;  // such a posture says nothing of motors
      continue;
    }
    needFriction(moment, friction);
    if (moment.middle && !held_) needEfforts(moment, q, efforts);
    if (before && moment.time - before->time < kApart) continue;
    if (before) needSpeeds(*before, moment, velocity_limits, speeds);
    if (before && moment.middle && !held_) needPowers(*before, moment, powers);
    before = &moment;
  }
  if (reach.needed > 0)
    tell_("no posture was found in which the legs reach: " + foot + " stays " + formatNumber(reach.needed, "%.2g") +
              " m (or rad) off its place " + reach.moment.describe(),
          "request shorter, lower or less turned steps");
  friction.needed /= kDoubtfulFriction;
  if (friction.needed > friction.allowed)
    tell_(getContact(friction.moment.phase->contacts[0]).name +
              " would slip: even with the weight half as far off as planned " + friction.moment.describe() +
              ", it needs a friction of " + formatAbove(friction.needed, 2) + " at least, the ground has " +
              formatNumber(friction.allowed),
          "request a slower motion or shorter steps, or give `friction` if the ground has more");
  tellEfforts(efforts);
  tellSpeeds(speeds);
  tellPowers(powers);
}

// Of a level foot that stands alone; doubtSlopes() sees the others.
void PostureChecks::needFriction(const Moment& moment, Need& friction) const {
  constexpr double kLevel = 1e-3;  // rad
  const std::vector<ContactTarget>& feet = moment.phase->contacts;
  if (feet.size() != 1 || !(feet[0].X_WT.R.row(2).head<2>().norm() < kLevel)) return;
  const Vector3d a = feet[0].X_WT.R.transpose() * calcFall(moment, calcCom(model_, ws_));
  const double needed = kPyramid * std::max(std::abs(a.x()), std::abs(a.y())) / (moment.load * gravity_);
  if (needed > friction.needed) friction.needed = needed, friction.moment = moment;
}

// Whether feet of the guess are off their places.
bool PostureChecks::needReach(const Moment& moment, Need& reach, std::string& foot) {
  constexpr double kOff = 5e-3;  // m, rad
  bool off = false;
  for (const ContactTarget& target : moment.phase->contacts) {
    const ContactFrame& contact = getContact(target);
    const SE3 error = target.X_WT.inverseTimes(getPlacement(ws_, contact.body, contact.X_BF));
    double size = error.p.norm();
    if (contact.kind == ContactKind::Surface6D) size = std::max(size, log3(error.R).norm());
    if (!(size > kOff)) continue;
    off = true;
    if (size <= reach.needed) continue;
    reach = {size, 0, moment};
    foot = contact.name;
  }
  return off;
}

void PostureChecks::needEfforts(const Moment& moment, const VectorXd& q, std::vector<Need>& efforts) {
  const VectorXd limits = getLimits(moment.node);
  const HoldingShare share = calcShare(moment, q, calcCom(model_, ws_), limits);
  if (!share.isTooMuch()) return;
  for (size_t m = 0; m < efforts.size(); ++m) {
    const Need need{std::abs(share.u[static_cast<Eigen::Index>(m)]), limits[static_cast<Eigen::Index>(m)], moment};
    if (need.share() > std::max(kDoubtfulEffort, efforts[m].share())) efforts[m] = need;
  }
}

void PostureChecks::needSpeeds(const Moment& before, const Moment& after, const VectorXd& limits,
                               std::vector<Need>& speeds) const {
  const VectorXd v = model_.difference(getPosture(before.node), getPosture(after.node)) / (after.time - before.time);
  for (size_t k = 0; k < speeds.size(); ++k) {
    const Need need{std::abs(v[static_cast<Eigen::Index>(k)]), limits[static_cast<Eigen::Index>(k)], before};
    if (need.share() > std::max(1.0, speeds[k].share())) speeds[k] = need;
  }
}

// A motor of limited power that moves from one posture to the next at its mean speed can hold the second with so much torque alone.
void PostureChecks::needPowers(const Moment& before, const Moment& after, std::vector<Need>& powers) {
  constexpr double kLeast = 1e-3;  // N m or N: linear programs want limits that are not next to nothing
  const LimitOptions& options = motion_.problem_options.limits;
  if (!options.enforced || options.powers.empty()) return;
  const VectorXd q = getPosture(after.node), most = getPowerLimits(model_, options),
                 v = model_.difference(getPosture(before.node), q) / (after.time - before.time);
  VectorXd limits = getLimits(after.node), speeds(model_.nu());
  for (int m = 0; m < model_.nu(); ++m) {
    speeds[m] = std::abs(v[model_.motors()[static_cast<size_t>(m)].dof]);
    if (std::isfinite(most[m]) && speeds[m] > 0) limits[m] = std::min(limits[m], std::max(most[m] / speeds[m], kLeast));
  }
  const HoldingShare share = calcShare(after, q, calcCom(model_, ws_), limits);
  if (!share.isTooMuch()) return;
  for (int m = 0; m < model_.nu(); ++m) {
    const Need need{std::abs(share.u[m]) * speeds[m], most[m], after};
    if (need.share() > std::max(kDoubtfulPower, powers[static_cast<size_t>(m)].share()))
      powers[static_cast<size_t>(m)] = need;
  }
}

void PostureChecks::tellEfforts(const std::vector<Need>& efforts) const {
  for (size_t m = 0; m < efforts.size(); ++m)
    if (efforts[m].needed > 0) {
      const Motor& motor = model_.motors()[m];
      tell_(quote("motor", motor.name) + " may be too weak: the posture planned " + efforts[m].moment.describe() +
                " needs " + formatEffort(motor, efforts[m].needed) + ", its limit is " +
                formatEffort(motor, efforts[m].allowed),
            "give a larger limit (--limit " + motor.name + "=" + formatNumber(1.05 * efforts[m].needed, "%.3g") +
                "), or request a slower or shorter motion");
    }
}

void PostureChecks::tellSpeeds(const std::vector<Need>& speeds) const {
  for (size_t k = 0; k < speeds.size(); ++k)
    if (speeds[k].needed > 0) {
      const Joint& joint = model_.joints()[static_cast<size_t>(model_.dofs()[k].joint)];
      const std::string unit = joint.kind == JointKind::Prismatic ? " m/s" : " rad/s";
      tell_(quote("joint", joint.name) + " may be too slow: from one planned posture to the next, " +
                speeds[k].moment.describe() + ", it needs " + formatNumber(speeds[k].needed, "%.3g") + unit +
                ", its limit is " + formatNumber(speeds[k].allowed, "%.3g") + unit,
            "request a slower or shorter motion, longer phases, or a larger limit");
    }
}

void PostureChecks::tellPowers(const std::vector<Need>& powers) const {
  for (size_t m = 0; m < powers.size(); ++m)
    if (powers[m].needed > 0) {
      const std::string& name = model_.motors()[m].name;
      tell_(quote("motor", name) + " may have too little power: at its mean speed to the posture planned " +
                powers[m].moment.describe() + ", this needs " + formatNumber(powers[m].needed, "%.3g") +
                " W, its limit is " + formatNumber(powers[m].allowed, "%.3g") + " W",
            "give a larger limit (--power-limit " + name + "=" + formatNumber(1.05 * powers[m].needed, "%.3g") +
                "), or request a slower or shorter motion");
    }
}

}  // namespace bielle
