#include "motion/feasibility.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/footsteps.h"
#include "dynamics/smooth_friction.h"
#include "formats/robot_text.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "model/rounded_text.h"
#include "motion/applied_options.h"
#include "motion/com_reach.h"
#include "motion/posture_checks.h"

namespace bielle {
namespace {

class FeasibilityCheck {
 public:
  FeasibilityCheck(const Motion& motion, const std::function<void(const std::string&)>& warn)
      : motion_(motion),
        problem_(*motion.problem),
        model_(problem_.model()),
        start_(motion.schedule.phases.front().contacts),
        ws_(model_),
        gravity_(model_.gravity().norm()) {
    if (warn)
      tell_ = [&warn](const std::string& doubt, const std::string& remedy) {
        warn("warning: " + doubt + "; " + remedy);
      };
    updatePositions(model_, ws_, getStart());
    com_ = calcCom(model_, ws_);
  }

  void check(const StartingPoint* given) {
    checkTrajectory(given ? given->trajectory : motion_.guess, given ? "start" : "guess");
    requireSolesApart(model_, start_);
    if (model_.nu() == 0 && model_.hasFreeFlyer())
      throw InputError(model_.name(), "motors", "the robot has none, so nothing holds it on its feet",
                       "name the joints that motors drive under `motors` in its YAML file");
    checkHeights();
    PostureChecks postures(motion_, tell_, com_);
    if (!motion_.cycle) postures.checkStart();  // a cycle starts in motion
    if (!tell_) return;
    doubtUnits();
    if (!motion_.cycle) doubtBalance();
    doubtSlopes();
    doubtTurns();
    doubtSpeed();
    doubtDampers();
    postures.doubt();
    if (given) doubtLoops(given->trajectory);
  }

 private:
  VectorXd getStart() const { return problem_.initialState().head(model_.nq()); }
  const ContactFrame& getContact(const ContactTarget& target) const { return model_.contacts()[target.contact]; }

  // Numbers that are not finite would be reported by whatever they meet first.
  void checkTrajectory(const ShootingTrajectory& trajectory, const std::string& what) const {
    const int N = problem_.numStages();
    const auto refuse = [&](const std::string& problem, const std::string& remedy) {
      throw InputError(model_.name(), what, problem, remedy);
    };
    if (static_cast<int>(trajectory.xs.size()) != N + 1 || static_cast<int>(trajectory.us.size()) != N)
      refuse("it has " + std::to_string(trajectory.xs.size()) + " states and " + std::to_string(trajectory.us.size()) +
                 " controls, the motion " + std::to_string(N + 1) + " and " + std::to_string(N),
             "give one state a node and one control a stage; a recorded motion of another length is resampled as a "
             "warm start");
    const std::vector<std::string> q = makePositionNames(model_), v = makeVelocityNames(model_);
    for (int k = 0; k <= N; ++k) {
      const VectorXd& x = trajectory.xs[static_cast<size_t>(k)];
      const VectorXd u = k < N ? trajectory.us[static_cast<size_t>(k)] : VectorXd();
      if (x.size() != problem_.stateSize() || (k < N && u.size() != problem_.controlSize(k)))
        refuse("node " + std::to_string(k) + " has " + std::to_string(x.size()) + " states and " +
                   std::to_string(u.size()) + " controls, the robot " + std::to_string(problem_.stateSize()) + " and " +
                   std::to_string(k < N ? problem_.controlSize(k) : 0),
               "give a start of the same robot");
      const auto refuseNumber = [&](const std::string& name) {
        refuse("node " + std::to_string(k) + ": " + name + " is not finite", "give finite numbers, or no start");
      };
      for (int i = 0; i < x.size(); ++i)
        if (!std::isfinite(x[i]))
          refuseNumber(i < model_.nq()                 ? "the position " + q[static_cast<size_t>(i)]
                       : i < model_.nq() + model_.nv() ? "the velocity " + v[static_cast<size_t>(i - model_.nq())]
                                                       : "a time scale");
      for (int i = 0; i < u.size(); ++i)
        if (!std::isfinite(u[i]))
          refuseNumber(i < model_.nu() ? "the control of " + model_.motors()[static_cast<size_t>(i)].name
                                       : "a time scale");
    }
  }

  // Whether standing legs are long enough, and fold far enough, for the height of the centre of mass.
  void checkHeights() const {
    for (const Goal& goal : motion_.goals) {
      if (goal.kind != GoalKind::Height) continue;
      double level = 0;
      std::vector<FrameTarget> feet;
      for (const ContactTarget& target : start_) {
        level += target.X_WT.p.z() / static_cast<double>(start_.size());
        feet.push_back(makeFrameTarget(getContact(target), target.X_WT));
      }
      const double start = com_.z() - level, needed = start * goal.requested;
      const ConstraintSet constraints = makeConstraintSet(model_, start_);
      const double reached = calcReachedComHeight(model_, constraints, feet, getStart(), level + needed) - level;
      if (std::abs(reached - needed) <= start * goal.tolerance) continue;
      const bool too_high = reached < needed;
      const double ratio = std::round(100 * reached / start) / 100;  // within the tolerance of a goal
      throw InputError(
          model_.name(), "--" + goal.name + " " + formatNumber(goal.requested),
          "the centre of mass would have to be " + formatNumber(needed, "%.3g") + " m over the feet, and " +
              (too_high ? "with straight legs" : "with legs folded up to the limits of joints") + " it is " +
              formatNumber(reached, "%.3g") + " m",
          "give " + std::string(too_high ? "at most " : "at least ") + formatNumber(ratio, "%.2f") +
              ", and less of it for a motion with room to spare, e.g. " + formatNumber(1 + 0.5 * (ratio - 1), "%.2f"));
    }
  }

  void doubtUnits() const {
    constexpr double kLowest = 0.02, kHighest = 10, kLightest = 0.02, kHeaviest = 5000;  // m, kg
    constexpr double kWeakest = 0.5, kStrongest = 30, kTilted = 0.01;                    // m/s^2, rad
    constexpr double kEarths = 0.05;  // from 1 m/s^2, which no planet or large moon has
    constexpr double kDensest = 5e4;  // mass over the cube of the height, kg/m^3: robots have 100 to 1000
    double ground = com_.z();
    for (const ContactTarget& foot : start_) ground = std::min(ground, foot.X_WT.p.z());
    const double height = com_.z() - ground;
    if (height > 0 && (height < kLowest || height > kHighest))
      tell_("the centre of mass is " + formatNumber(height) + " m high at the start",
            "give lengths in m if the robot's file has other ones (`scale` of meshes, millimetres of a CAD program)");
    if (model_.mass() < kLightest || model_.mass() > kHeaviest)
      tell_("the robot has a mass of " + formatNumber(model_.mass()) + " kg",
            "give masses in kg if they are in other units");
    else if (height > 0 && model_.mass() > kDensest * height * height * height)
      tell_("the robot has a mass of " + formatNumber(model_.mass()) + " kg, and its centre of mass is " +
                formatNumber(height, "%.3g") + " m high",
            "give masses in kg if they are in g");
    if (gravity_ < kWeakest || gravity_ > kStrongest)
      tell_("gravity is " + formatNumber(gravity_) + " m/s^2", "give it in m/s^2 if it is not meant so");
    else if (std::abs(gravity_ - 1) < kEarths)
      tell_("gravity is " + formatNumber(gravity_) + " m/s^2, a tenth of the Earth's",
            "give [0, 0, -9.81] if it is meant as a multiple of that");
    const double tilt = std::acos(std::clamp(-model_.gravity().z() / gravity_, -1.0, 1.0));
    if (tilt > kTilted)
      tell_("gravity points " + formatNumber(tilt, "%.3g") + " rad beside down",
            "motions are planned for level ground: give [0, 0, -9.81] if that is not meant");
  }

  // Whether the weight falls into the area between the soles.
  void doubtBalance() const {
    constexpr int kDirections = 720;
    constexpr double kBeyond = 1e-3;  // m
    if (!model_.hasFreeFlyer() || start_.empty()) return;
    double most = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2 * kPi * i / kDirections;
      const Vector3d out(std::cos(angle), std::sin(angle), 0);
      double beyond = std::numeric_limits<double>::infinity();
      for (const ContactTarget& foot : start_)
        for (double x : {-1, 1})
          for (double y : {-1, 1}) {
            const ContactFrame& sole = getContact(foot);
            const Vector3d corner = foot.X_WT.act(Vector3d(x * sole.half_length, y * sole.half_width, 0));
            const Vector3d foothold = com_ + (corner.z() - com_.z()) / model_.gravity().z() * model_.gravity();
            beyond = std::min(beyond, out.dot(foothold - corner));
          }
      most = std::max(most, beyond);
    }
    if (most > kBeyond)
      tell_("the robot falls over where it starts: its centre of mass is " + formatNumber(most, "%.3g") +
                " m beyond its soles",
            "give a reference in which it is above them");
  }

  // A foot that stands alone on an inclined foothold must not slip.
  void doubtSlopes() const {
    const Vector3d up = -model_.gravity() / gravity_;
    double most = 0;
    const ContactPhase* steepest = nullptr;
    for (const ContactPhase& phase : motion_.schedule.phases) {
      if (phase.contacts.size() != 1 || getContact(phase.contacts[0]).kind != ContactKind::Surface6D) continue;
      const Vector3d f = phase.contacts[0].X_WT.R.transpose() * up;
      const double needed = kPyramid * std::max(std::abs(f.x()), std::abs(f.y())) / f.z();
      if (needed <= most) continue;
      most = needed;
      steepest = &phase;
    }
    if (most > motion_.ground.friction)
      tell_(getContact(steepest->contacts[0]).name +
                " would slip on an inclined foothold on which it stands alone: it needs a friction of " +
                formatAbove(most, 3) + " (with the pyramids and the margin of docs/constraints.md), the ground has " +
                formatNumber(motion_.ground.friction),
            "give a less inclined foothold, or `friction`");
  }

  // Feet that turn far against each other, or in a step: angles may have been meant as degrees.
  void doubtTurns() const {
    std::map<int, double> headings;  // by contact, where each stood last
    double most = 0;
    std::string turned;
    for (const ContactPhase& phase : motion_.schedule.phases)
      for (const ContactTarget& target : phase.contacts) {
        if (getContact(target).kind == ContactKind::Point3D) continue;
        const double heading = calcHeading(target.X_WT);
        for (const auto& [contact, last] : headings) {
          const double turn = std::abs(std::remainder(heading - last, 2 * kPi));
          if (turn <= most) continue;
          most = turn;
          turned = getContact(target).name +
                   (contact == target.contact ? "" : " against " + model_.contacts()[contact].name);
        }
        headings[target.contact] = heading;
      }
    if (most > kLargeTurn)
      tell_(turned + " turns by " + formatNumber(most, "%.3g") + " rad",
            "give radians if degrees were meant, or turn less at a time");
  }

  // R. McN. Alexander, "The gaits of bipedal and quadrupedal animals", 1984: at a Froude number v^2 / (g l) of 1 the weight does
  // not hold the body on the arc about a straight leg any more.
  void doubtSpeed() const {
    for (const ContactPhase& phase : motion_.schedule.phases)
      if (phase.contacts.empty()) return;
    for (const Goal& goal : motion_.goals) {
      if (goal.kind != GoalKind::Speed) continue;
      const double length = com_.z() - start_.front().X_WT.p.z();
      const double froude = goal.requested * goal.requested / (gravity_ * length);
      if (froude > 1)
        tell_("a walk of " + formatNumber(goal.requested) + " m/s has a Froude number of " +
                  formatNumber(froude, "%.2g") + ", walks have less than 1: up to " +
                  formatBelow(std::sqrt(gravity_ * length), 2) + " m/s",
              "request a lower speed, or a run");
    }
  }

  // Whether steps can follow friction and dampers of joints near rest, with the feet of every phase.
  void doubtDampers() const {
    constexpr double kBorne = 2;  // rate times step
    std::set<std::vector<int>> seen;
    std::map<int, JointForce> raised;  // by joint
    SmoothFriction fastest;
    double step = 0;  // s
    int node = 0;
    for (const ContactPhase& phase : motion_.schedule.phases) {
      std::vector<int> feet;
      for (const ContactTarget& target : phase.contacts) feet.push_back(target.contact);
      if (phase.dt > 0 && !model_.jointForces().empty() && seen.insert(feet).second) {
        const SmoothFriction found =
            calcSmoothFriction(model_, problem_.spec(node).constraints,
                               motion_.guess.xs[static_cast<size_t>(node)].head(model_.nq()), phase.dt);
        if (found.rate * phase.dt > std::max(kBorne, fastest.rate * step)) fastest = found, step = phase.dt;
        for (const JointForce& force : found.raised)
          if (const auto at = raised.try_emplace(force.joint, force).first;
              force.friction_speed > at->second.friction_speed)
            at->second = force;
      }
      node += phase.nodes;
    }
    if (step == 0) return;
    const std::string steps = formatNumber(1e3 * step, "%.3g") + " ms",
                      borne = ", steps bear " + formatNumber(kBorne / step, "%.2g");
    if (const double rate = raised.empty() ? fastest.rate : fastest.damped; rate * step > kBorne)
      return tell_("steps of " + steps + " are too long for the damper of " + "joint '" +
                       model_.joints()[static_cast<size_t>(fastest.joint)].name + "'" +
                       ": motions near rest decay at " + formatNumber(rate, "%.2g") + "/s" + borne,
                   "give shorter ones (--set time_step=" + formatNumber(1 / rate, "%.1g") + ")");
    std::string names, entries;
    for (WholeJointForce whole : joinJointForces(model_)) {
      const auto at = raised.find(whole.force.joint);
      if (at == raised.end()) continue;
      const int joint = at->first;
      whole.force.friction_speed = at->second.friction_speed;
      whole.stribeck_speed = std::max(whole.stribeck_speed, 2 * whole.force.friction_speed);
      const std::string& name = model_.joints()[static_cast<size_t>(joint)].name;
      names += (names.empty() ? "" : ", ") + name;
      entries += (entries.empty() ? "" : ", ") + name + ": {";
      for (const auto& [key, value] : getJointForceData(whole))
        entries += std::string(key) + ": " + value + (key == std::string("friction_speed") ? "}" : ", ");
    }
    tell_("steps of " + steps + " are too long for the friction of " + names +
              ", which acts like a damper below its friction_speed: motions near rest decay at " +
              formatNumber(fastest.rate, "%.2g") + "/s" + borne,
          "give larger speeds in the robot's YAML file (`joint_forces: {" + entries + "}`)");
  }

  // Of a start: that of another robot has open loops here.
  void doubtLoops(const ShootingTrajectory& start) {
    constexpr double kOpen = 1e-3;  // m, rad
    const ConstraintSet loops = makeConstraintSet(model_);
    double most = 0;
    std::string widest;
    for (const size_t k : {size_t{0}, start.xs.size() / 2, start.xs.size() - 1}) {
      updatePositions(model_, ws_, start.xs[k].head(model_.nq()));
      for (const Closure& closure : loops.closures) {
        const ClosureGap gap = calcClosureGap(ws_, closure);
        const double open = std::max(gap.position, gap.angle);
        if (open <= most) continue;
        most = open;
        widest = closure.name + "' at node " + std::to_string(k);
      }
    }
    if (most > kOpen)
      tell_("the start has open loops, by " + formatNumber(most, "%.2g") + " m (or rad) in '" + widest,
            "it is of another robot, or of this one before it was changed: give a result of this robot");
  }

  const Motion& motion_;
  const RobotProblem& problem_;
  const Model& model_;
  const std::vector<ContactTarget>& start_;
  TellDoubt tell_;
  Workspace ws_;
  double gravity_;  // m/s^2
  Vector3d com_;    // at the start
};

}  // namespace

void requireGravity(const Model& model, double friction) {
  constexpr double kMost = 300;  // m/s^2, more than a centrifuge; in mm/s^2 that of the Earth is 9810
  const Vector3d& g = model.gravity();
  const auto refuse = [&](const std::string& problem) {
    throw InputError(model.name(), "gravity", problem,
                     "give it in m/s^2, e.g. `gravity: [0, 0, -9.81]` in the robot's YAML file");
  };
  if (!(g.norm() > 0)) refuse("there is none, and nothing presses the feet on the ground");
  if (g.norm() > kMost) refuse("it is " + formatNumber(g.norm()) + " m/s^2");
  const double slope = g.z() < 0 ? std::hypot(g.x(), g.y()) / -g.z() : std::numeric_limits<double>::infinity();
  if (slope > friction)
    refuse(g.z() < 0 ? "it points aside: on level ground feet need a friction of " + formatAbove(slope, 3) +
                           ", the ground has " + formatNumber(friction)
                     : std::string("it does not point down"));
}

void requireSolesApart(const Model& model, const std::vector<ContactTarget>& soles) {
  constexpr double kTouching = 1e-6, kLevel = 1e-3;  // m
  for (size_t i = 0; i < soles.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const ContactFrame &a = model.contacts()[soles[j].contact], &b = model.contacts()[soles[i].contact];
      if (a.body == b.body || std::abs(soles[i].X_WT.p.z() - soles[j].X_WT.p.z()) > kLevel) continue;
      const double distance = calcSoleDistance(a, soles[j].X_WT, b, soles[i].X_WT);
      if (distance < -kTouching)
        throw InputError(model.name(), "contacts '" + a.name + "' and '" + b.name + "'",
                         "their soles overlap by " + formatAbove(-distance, 3) + " m where the robot starts",
                         "place the feet farther apart in the reference, by as much, or give narrower soles");
    }
}

void checkFeasibility(const Motion& motion, const StartingPoint* given,
                      const std::function<void(const std::string&)>& warn) {
  FeasibilityCheck(motion, warn).check(given);
}

}  // namespace bielle
