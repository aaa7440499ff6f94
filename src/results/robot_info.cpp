#include "bielle/results/robot_info.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/ground.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/linkage.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "dynamics/idle_spins.h"
#include "dynamics/loop_problem.h"
#include "dynamics/point_spring.h"
#include "dynamics/regular_mobility.h"
#include "math/constants.h"
#include "model/frame_name.h"
#include "model/number_text.h"
#include "model/stiction.h"
#include "results/json_text.h"

namespace bielle {
namespace {

struct Posture {
  std::string name;
  VectorXd q;
  bool closed;
  std::string message;
};

// The unchanged neutral configuration, and every reference, closed as far as possible.
std::vector<Posture> makePostures(const Model& model) {
  std::vector<Posture> postures = {{"neutral", model.makeNeutral(), true, ""}};
  for (const Reference& reference : model.references()) {
    const AssemblyResult result = assembleReference(model, reference.name);
    postures.push_back({reference.name, result.q, result.status == NumericalStatus::Ok, result.message});
  }
  return postures;
}

Json orNull(double limit) { return std::isfinite(limit) ? Json(limit) : Json(nullptr); }

// A number for a joint of one coordinate, else a list.
Json toJson(const VectorXd& q) { return q.size() == 1 ? Json(q[0]) : Json(std::vector<double>(q.begin(), q.end())); }

// "motor - 2 knee + 0.5 knee^2"
std::string describeTerms(const Model& model, const Closure& coupler) {
  std::string text;
  const auto add = [&text](double coefficient, const std::string& power) {
    if (coefficient == 0) return;
    const double size = std::abs(coefficient);
    text += coefficient < 0 ? (text.empty() ? "-" : " - ") : (text.empty() ? "" : " + ");
    if (size != 1) text += formatNumber(size) + " ";
    text += power;
  };
  for (const CouplerTerm& term : coupler.terms) {
    const std::string& joint = model.joints()[term.joint].name;
    add(term.coefficient, joint);
    for (size_t k = 0; k < term.higher.size(); ++k) add(term.higher[k], joint + "^" + std::to_string(k + 2));
  }
  return text;
}

Json describeClosures(const Model& model, const std::vector<Posture>& postures) {
  Json closures = Json::array();
  for (const Closure& closure : model.closures()) {
    const bool coupler = closure.kind == ClosureKind::Coupler;
    closures.push_back(
        {{"name", closure.name},
         {"kind", getName(closure.kind)},
         {"frame1", coupler ? describeTerms(model, closure) : findFrameName(model, closure.body1, closure.X_B1)},
         {"frame2", coupler ? "= " + formatNumber(closure.offset) : findFrameName(model, closure.body2, closure.X_B2)},
         {"rows", getRows(closure.kind)},
         {"loop_dofs", closure.dofs.size()}});
  }
  Workspace ws(model);
  for (const Posture& posture : postures) {
    updatePositions(model, ws, posture.q);
    for (size_t c = 0; c < closures.size(); ++c) {
      const ClosureGap gap = calcClosureGap(ws, model.closures()[c]);
      closures[c]["gap " + posture.name] = {gap.position, gap.angle};
    }
  }
  return closures;
}

// Distances between the pivots of each body that is part of a loop: its joint, those that it carries, the ends of closures; and
// rods without a body.
Json describeLengths(const Model& model) {
  constexpr double kSame = 1e-6;  // m
  struct Pivot {
    std::string name;
    Vector3d place;
  };
  std::vector<std::vector<Pivot>> pivots(model.numBodies());
  std::vector<bool> in_loop(model.numBodies(), false);
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    pivots[i].push_back({joint.name, Vector3d::Zero()});
    if (joint.kind != JointKind::FreeFlyer) pivots[joint.parent].push_back({joint.name, joint.X_PJ.p});
  }
  for (const LoopCluster& cluster : model.clusters())
    for (const int dof : cluster.dofs) {
      const int body = model.dofs()[dof].joint;
      in_loop[body] = in_loop[model.joints()[body].parent] = true;
    }
  for (const Closure& closure : model.closures()) {
    if (closure.kind == ClosureKind::Coupler) continue;
    pivots[closure.body1].push_back({closure.name, closure.X_B1.p});
    pivots[closure.body2].push_back({closure.name, closure.X_B2.p});
  }
  Json lengths = Json::array();
  for (const Closure& closure : model.closures())
    if (closure.kind == ClosureKind::Distance)
      lengths.push_back({{"body", closure.name},
                         {"from", findFrameName(model, closure.body1, closure.X_B1)},
                         {"to", findFrameName(model, closure.body2, closure.X_B2)},
                         {"length", closure.length}});
  for (int body = 1; body < model.numBodies(); ++body) {
    if (!in_loop[body] || model.joints()[body].kind == JointKind::FreeFlyer) continue;
    for (auto a = pivots[body].begin(); a != pivots[body].end(); ++a)
      for (auto b = a + 1; b != pivots[body].end(); ++b)
        if (const double length = (b->place - a->place).norm(); length > kSame)
          lengths.push_back(
              {{"body", model.bodies()[body].name}, {"from", a->name}, {"to", b->name}, {"length", length}});
  }
  return lengths;
}

Json describeJointForces(const Model& model) {
  Json forces = Json::array();
  for (const auto& [force, stiction, stribeck_speed] : joinJointForces(model))
    forces.push_back({{"name", model.joints()[force.joint].name},
                      {"stiffness", force.stiffness},
                      {"rest", force.rest},
                      {"preload", force.preload},
                      {"damping", force.damping},
                      {"friction", force.friction},
                      {"friction_speed", force.friction_speed},
                      {"stiction", stiction},
                      {"stribeck_speed", stribeck_speed}});
  return forces;
}

Json describePointSprings(const Model& model, const std::vector<Posture>& postures) {
  Json springs = Json::array();
  for (const PointSpring& spring : model.pointSprings())
    springs.push_back({{"name", spring.name},
                       {"body1", model.bodies()[spring.body1].name},
                       {"body2", model.bodies()[spring.body2].name},
                       {"stiffness", spring.stiffness},
                       {"rest", spring.rest},
                       {"preload", spring.preload},
                       {"damping", spring.damping}});
  Workspace ws(model);
  for (const Posture& posture : postures) {
    updatePositions(model, ws, posture.q);
    for (size_t s = 0; s < springs.size(); ++s)
      springs[s]["length " + posture.name] = calcPointSpringLength(model.pointSprings()[s], ws);
  }
  return springs;
}

// Freedoms that rows of closures take over a way, though they say the same in a posture: linkages that are rounded too much.
// \param least  singular values of the whole robot below it count as zero
int countLocked(const LoadedRobot& robot, ConstVectorRef q, double least) {
  int locked = 0;
  for (const LockedLoops& loops : robot.locked) {
    const Model part = selectClosures(robot.model, loops.closures);
    const int dofs = static_cast<int>(part.clusters().front().dofs.size());
    const auto rank = static_cast<int>((calcMobility(part, q).singular_values.array() > least).count());
    locked += std::max(0, dofs - loops.mobility - rank);
  }
  return locked;
}

// At the first reference that closes, else at a closed configuration near neutral; beside it where it is singular.
Json describeMobility(const LoadedRobot& robot, const std::vector<Posture>& postures) {
  const Model& model = robot.model;
  std::string place = "closed neutral";
  const AssemblyResult found = findClosedConfiguration(model);
  VectorXd q = found.q;
  bool closed = found.status == NumericalStatus::Ok;
  for (size_t i = postures.size(); i-- > 1;)
    if (postures[i].closed) place = postures[i].name, q = postures[i].q, closed = true;
  const Mobility mobility = calcMobility(model, q), regular = closed ? calcRegularMobility(model, q) : mobility;
  const int locked =
      closed && regular.rows > 0 ? countLocked(robot, q, kRankTolerance * regular.singular_values[0]) : 0;
  if (regular.rank > mobility.rank)
    place += " (singular: rank " + std::to_string(mobility.rank) + " there, this beside it)";
  return {{"posture", place},
          {"closed", closed},
          {"singular", regular.rank > mobility.rank},
          {"rows", regular.rows},
          {"rank", regular.rank + locked},
          {"mobility", regular.mobility - locked},
          {"locked", locked},
          {"idle_spins", closed && regular.mobility > 0 ? countIdleSpins(model, q) : 0}};
}

// Of every linkage.
void addDeadPoints(const Model& model, const Posture& posture, Json& out) {
  if (calcMobility(model, posture.q).mobility == 0) return;  // nothing moves
  for (const DeadPointTrace& linkage : traceDeadPoints(model, posture.q.transpose())) {
    const DeadPoint& nearest = linkage.getNearest();
    const bool far = nearest.kind == DeadPointKind::None;
    out.push_back({{"reference", posture.name},
                   {"linkage", linkage.output},
                   {"distance", orNull(nearest.distance)},
                   {"of", far ? "none within " + formatNumber(kFarthestDeadPoint) : getName(nearest.kind)}});
  }
  if (!posture.closed) return;
  for (const LinkageLeftOut& linkage : listLinkagesLeftOut(model, posture.q))
    if (linkage.has_motors)
      out.push_back({{"reference", posture.name},
                     {"linkage", linkage.name},
                     {"distance", nullptr},
                     {"of", "not known: " + linkage.why}});
}

// Least distances of shapes between two legs, within legs and trunk, and to the ground under the feet, which are left out.
Json describeDistances(const Model& model, const Posture& posture) {
  Workspace ws(model);
  updatePlacements(model, ws, posture.q);
  Json distances = Json::array();
  const auto add = [&](const char* between, double distance, const std::string& body1, const std::string& body2) {
    distances.push_back(
        {{"between", between}, {"distance", distance}, {"body1", body1}, {"body2", body2}, {"posture", posture.name}});
  };
  const auto getBody = [&](int shape) { return model.bodies()[model.shapes()[shape].body].name; };
  std::vector<ShapePair> legs, others;
  for (const ShapePair& pair : listShapePairs(model)) (pair.of_two_legs ? legs : others).push_back(pair);
  for (const auto& [between, pairs] : {std::pair{"legs", legs}, {"other bodies", others}})
    if (const NearestPair nearest = findNearestPair(model, ws.X_WB, pairs); nearest.pair >= 0)
      add(between, nearest.distance.distance, getBody(pairs[nearest.pair].b), getBody(pairs[nearest.pair].a));
  std::set<int> feet = {0};
  Ground ground;
  ground.height = std::numeric_limits<double>::infinity();
  for (const ContactFrame& contact : model.contacts()) {
    feet.insert(contact.body);
    ground.height = std::min(ground.height, getPlacement(ws, contact.body, contact.X_BF).p.z());
  }
  int lowest = -1;
  double least = 0;
  for (int s = 0; s < static_cast<int>(model.shapes().size()) && feet.size() > 1; ++s) {
    const Shape& shape = model.shapes()[s];
    if (feet.count(shape.body)) continue;
    const double distance = calcGroundDistance(ground, shape, ws.X_WB[shape.body]).distance;
    if (lowest < 0 || distance < least) least = distance, lowest = s;
  }
  if (lowest >= 0) add("ground", least, getBody(lowest), "ground");
  return distances;
}

// Of the first reference that closes, else of the neutral configuration.
const Posture& chooseStanding(const std::vector<Posture>& postures) {
  for (size_t i = 1; i < postures.size(); ++i)
    if (postures[i].closed) return postures[i];
  return postures.front();
}

Json describeDrive(const Motor& motor) {
  const MotorDrive& drive = motor.drive;
  return {{"name", motor.name},
          {"type", drive.type},
          {"ratio", drive.ratio},
          {"rotor_inertia", drive.rotor_inertia},
          {"torque_constant", drive.torque_constant},
          {"resistance", drive.resistance},
          {"voltage", orNull(drive.voltage)},
          {"current", orNull(drive.current)},
          {"continuous_current", orNull(drive.continuous_current)},
          {"continuous_effort", orNull(motor.continuous_effort)},
          {"efficiency", drive.efficiency},
          {"back_efficiency", drive.back_efficiency},
          {"mass", drive.mass}};
}

std::string format(const VectorXd& q) {
  std::string text;
  for (double value : q) text += (text.empty() ? "" : " ") + formatNumber(value, "%.4g");
  return text;
}

// "its range of -1 to 0.98", if a given value is outside; else empty.
std::string describeMissedRange(const Model& model, const ReferenceJoint& of) {
  constexpr double kRounding = 1e-3;  // rad or m: 1.571 for a quarter turn
  const Joint& joint = model.joints()[of.joint];
  if (joint.nq != joint.nv) return "";
  const VectorXd lower = model.lowerLimits().segment(joint.idx_v, joint.nv),
                 upper = model.upperLimits().segment(joint.idx_v, joint.nv);
  if ((of.given - lower).minCoeff() >= -kRounding && (upper - of.given).minCoeff() >= -kRounding) return "";
  return "its range of " + format(lower) + " to " + format(upper);
}

// Whether an angle may have been meant as degrees.
bool isTurnedFar(const Joint& joint, const VectorXd& given) {
  return (joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous) && std::abs(given[0]) > 2 * kPi;
}

Json describePlay(const LoadedRobot& robot) {
  Json plays = Json::array();
  for (const Play& play : robot.wear.plays) plays.push_back({{"name", play.name}, {"size", play.size}});
  return plays;
}

Json describeRodFriction(const LoadedRobot& robot) {
  Json frictions = Json::array();
  for (const RodFriction& friction : robot.wear.frictions)
    frictions.push_back({{"name", friction.closure},
                         {"coefficient", friction.coefficient},
                         {"radius", friction.radius},
                         {"friction_speed", friction.friction_speed},
                         {"stiction", std::max(friction.coefficient, friction.stiction)},
                         {"stribeck_speed", friction.stribeck_speed},
                         {"joints", friction.joints}});
  return frictions;
}

}  // namespace

std::vector<std::string> checkReferences(const LoadedRobot& robot) {
  const Model& model = robot.model;
  std::filesystem::path file = robot.path();
  if (file.extension() == ".urdf") file.replace_extension(".yaml");
  std::vector<std::string> warnings;
  for (const Reference& reference : model.references()) {
    const AssemblyResult result = assembleReference(model, reference.name);
    const bool closed = result.status == NumericalStatus::Ok;
    const std::string element = "reference '" + reference.name + "'";
    std::string moved, outside, turned;
    for (const ReferenceJoint& of : listReferenceJoints(model, reference, result.q)) {
      const std::string joint = "'" + model.joints()[of.joint].name + "'", range = describeMissedRange(model, of);
      const bool is_met = closed && of.moved <= kReferenceTolerance;
      if (!range.empty() && !is_met)
        throw InputError(file.string(), element,
                         "joint " + joint + " cannot be at " + format(of.given) + ", outside " + range,
                         "give a value that it can have, or correct the range");
      if (!range.empty()) outside += (outside.empty() ? "" : ", ") + joint + " is outside " + range;
      if (isTurnedFar(model.joints()[of.joint], of.given))
        turned += (turned.empty() ? "" : ", ") + joint + " at " + format(of.given);
      if (closed && !is_met)
        moved +=
            (moved.empty() ? "" : ", ") + joint + " at " + format(of.assembled) + " instead of " + format(of.given);
    }
    if (!outside.empty())
      warnings.push_back(file.string() + ": " + element + ": " + outside +
                         "; motions that start there need --no-limits");
    if (!turned.empty())
      warnings.push_back(file.string() + ": " + element + ": " + turned +
                         " rad is more than a turn; give radians if degrees were meant");
    if (!moved.empty())
      warnings.push_back(file.string() + ": " + element + ": it is assembled with " + moved +
                         ", because loops, height and feet come before given angles; give angles that the robot can "
                         "have together, or omit them");
  }
  return warnings;
}

std::string makeRobotInfo(const LoadedRobot& robot) {
  const Model& model = robot.model;
  const std::vector<Posture> postures = makePostures(model);
  const size_t given = std::count_if(model.shapes().begin(), model.shapes().end(), [](auto& s) { return !s.fitted; });
  Json json = {{"name", model.name()},
               {"directory", robot.directory},
               {"base", model.hasFreeFlyer() ? "free" : "fixed"},
               {"mass", model.mass()},
               {"nq", model.nq()},
               {"nv", model.nv()},
               {"nu", model.nu()},
               {"closure_rows", model.numClosureRows()},
               {"mobility", describeMobility(robot, postures)},
               {"joints", Json::array()},
               {"closures", describeClosures(model, postures)},
               {"clusters", Json::array()},
               {"lengths", describeLengths(model)},
               {"motors", Json::array()},
               {"drives", Json::array()},
               {"joint_forces", describeJointForces(model)},
               {"point_springs", describePointSprings(model, postures)},
               {"play", describePlay(robot)},
               {"rod_friction", describeRodFriction(robot)},
               {"shapes", {{"given", given}, {"fitted", model.shapes().size() - given}}},
               {"distances", describeDistances(model, chooseStanding(postures))},
               {"contacts", Json::array()},
               {"references", Json::array()},
               {"reference_joints", Json::array()},
               {"dead_points", Json::array()},
               {"warnings", robot.warnings}};
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    json["joints"].push_back({{"name", joint.name},
                              {"kind", getName(joint.kind)},
                              {"parent", model.bodies()[joint.parent].name},
                              {"child", model.bodies()[i].name},
                              {"nq", joint.nq},
                              {"nv", joint.nv}});
  }
  for (const LoopCluster& cluster : model.clusters()) {
    Json names = Json::array();
    for (int c : cluster.closures) names.push_back(model.closures()[c].name);
    json["clusters"].push_back({{"closures", names}, {"rows", cluster.rows}, {"dofs", cluster.dofs.size()}});
  }
  for (const Motor& motor : model.motors())
    json["motors"].push_back({{"name", motor.name},
                              {"armature", motor.armature},
                              {"effort_limit", orNull(motor.effort_limit)},
                              {"velocity_limit", orNull(motor.velocity_limit)},
                              {"torque_loss", motor.torque_loss ? Json(*motor.torque_loss) : Json()}});
  for (const Motor& motor : model.motors())
    if (motor.drive.isGiven() || std::isfinite(motor.continuous_effort)) json["drives"].push_back(describeDrive(motor));
  for (const ContactFrame& contact : model.contacts())
    json["contacts"].push_back({{"name", contact.name},
                                {"kind", getName(contact.kind)},
                                {"body", model.bodies()[contact.body].name},
                                {"sole", {2 * contact.half_length, 2 * contact.half_width}}});
  for (size_t i = 1; i < postures.size(); ++i) {
    json["references"].push_back(
        {{"name", postures[i].name}, {"closed", postures[i].closed}, {"message", postures[i].message}});
    if (postures[i].closed) addDeadPoints(model, postures[i], json["dead_points"]);
    for (const ReferenceJoint& joint : listReferenceJoints(model, model.references()[i - 1], postures[i].q))
      json["reference_joints"].push_back({{"reference", postures[i].name},
                                          {"joint", model.joints()[joint.joint].name},
                                          {"given", toJson(joint.given)},
                                          {"assembled", toJson(joint.assembled)}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace bielle
