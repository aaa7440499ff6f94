// Robots out as URDF for Drake and in again: the same mechanism; numbers that are wrong, and entries that lack, show.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/model/builder.h"
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "get_error.h"
#include "mechanisms.h"
#include "model/number_text.h"
#include "published_robots.h"
#include "robot_difference.h"
#include "robot_directory.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

bool contains(const std::vector<std::string>& warnings, const std::string& text) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

Model readDrake(const std::string& urdf) {
  const RobotDirectory directory;
  return loadRobot(directory.writeRobot(urdf, "")).model;
}

bool isCoupler(const Closure& closure) { return closure.kind == ClosureKind::Coupler; }
bool isLost(const Closure& closure) {
  return isCoupler(closure) || closure.kind == ClosureKind::Distance || closure.kind == ClosureKind::Slider;
}

void removeCouplersAndMeshes(ModelParts& parts) {
  const auto remove = [](auto& from, const auto& which) {
    from.erase(std::remove_if(from.begin(), from.end(), which), from.end());
  };
  remove(parts.closures, isLost);
  remove(parts.visuals, [](const Visual& visual) { return visual.shape == Visual::Shape::Mesh; });
}

// The robot without what the format cannot say, and balls for its hinges and welds; without couplers.
Model makeExpected(const Model& model) {
  ModelParts parts = takeParts(model);
  removeCouplersAndMeshes(parts);
  std::vector<Closure> balls;
  for (const Closure& closure : parts.closures) {
    std::vector<Vector3d> points = {Vector3d::Zero()};
    if (closure.kind == ClosureKind::Hinge5D) points = {0.05 * closure.axis, -0.05 * closure.axis};
    if (closure.kind == ClosureKind::Weld6D)
      points = {0.1 * Vector3d::UnitX(), 0.1 * Vector3d::UnitY(), 0.1 * Vector3d::UnitZ()};
    for (size_t k = 0; k < points.size(); ++k) {
      Closure ball = closure;
      ball.kind = ClosureKind::Ball3D;
      if (points.size() > 1) ball.name += "." + std::to_string(k + 1);
      ball.X_B1.p = closure.X_B1.act(points[k]);
      ball.X_B2.p = closure.X_B2.act(points[k]);
      balls.push_back(ball);
    }
  }
  parts.closures = balls;
  parts.contacts.clear();
  parts.references.clear();
  parts.serial_joints.clear();
  parts.gravity = {0, 0, -9.81};
  for (const Joint& joint : parts.joints) {
    if (joint.nv == 1 && model.findMotor(joint.name) < 0) parts.armature[joint.idx_v] = 0;
    if (joint.nv <= 1) continue;
    parts.armature.segment(joint.idx_v, joint.nv).setZero();
    parts.lower_limits.segment(joint.idx_v, joint.nv).setConstant(-HUGE_VAL);
    parts.upper_limits.segment(joint.idx_v, joint.nv).setConstant(HUGE_VAL);
  }
  for (JointForce& force : parts.joint_forces) {
    force.stiffness = force.rest = force.preload = 0;
    force.friction_speed = JointForce().friction_speed;
  }
  std::vector<PointSpring> springs;
  for (PointSpring& spring : parts.point_springs) {
    if (spring.stiffness == 0) spring.preload = 0;
    if (spring.stiffness == 0 ? spring.damping != 0 : spring.rest - spring.preload / spring.stiffness > 0)
      springs.push_back(spring);
  }
  parts.point_springs = springs;
  return ModelBuilder::restore(parts);
}

Difference compareWithDrake(const Model& model, const Model& back) {
  ModelParts parts = takeParts(back);
  removeCouplersAndMeshes(parts);
  return compare(makeExpected(model), ModelBuilder::restore(parts), model.makeNeutral());
}

// Of the motors and limits that compare() does not look at.
double calcMotorError(const Model& a, const Model& b) {
  double worst = 0;
  const auto add = [&worst](double x, double y) {
    if (x != y) worst = std::max(worst, std::abs(x - y) / std::max(std::abs(x), 1e-12));
  };
  for (int m = 0; m < a.nu(); ++m) {
    add(a.motors()[m].armature, b.motors()[m].armature);
    add(a.motors()[m].effort_limit, b.motors()[m].effort_limit);
  }
  for (const Joint& joint : a.joints())
    if (joint.nv == 1)
      add(a.velocityLimits()[joint.idx_v], b.velocityLimits()[b.joints()[b.findJoint(joint.name)].idx_v]);
  return worst;
}

double calcGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  return calcLargestGap(ws, makeConstraintSet(model));
}

// Couplers of `back` are those of `model` up to a factor; returns how many of `model`, and how many distances and sliders, have
// none, each of which must be told.
int countLost(const Model& model, const Model& back, const std::vector<std::string>& warnings) {
  const auto match = [&](const Closure& a, const Closure& b) {
    if (a.terms.size() != b.terms.size()) return false;
    VectorXd of_a = VectorXd::Zero(model.nv() + 1), of_b = of_a;
    for (const CouplerTerm& t : a.terms) of_a[t.dof] = t.coefficient;
    for (const CouplerTerm& t : b.terms) {
      const int joint = model.findJoint(back.joints()[t.joint].name);
      of_b[model.joints()[joint].idx_v] = t.coefficient;
    }
    of_a[model.nv()] = a.offset, of_b[model.nv()] = b.offset;
    return std::abs(std::abs(of_a.normalized().dot(of_b.normalized())) - 1) < 1e-14;
  };
  int lost = 0;
  for (const Closure& b : back.closures())
    if (isCoupler(b))
      CHECK(std::any_of(model.closures().begin(), model.closures().end(),
                        [&](const Closure& a) { return isCoupler(a) && match(a, b); }));
  for (const Closure& a : model.closures()) {
    if (isLost(a) && !isCoupler(a)) {
      ++lost;
      CHECK(contains(warnings, "closure '" + a.name + "': it is left out: Drake"));
    }
    if (!isCoupler(a) || std::any_of(back.closures().begin(), back.closures().end(),
                                     [&](const Closure& b) { return isCoupler(b) && match(a, b); }))
      continue;
    ++lost;
    CHECK(a.terms.size() != 2);
    CHECK(contains(warnings, "closure '" + a.name + "': it is left out: <mimic> couples"));
  }
  return lost;
}

void checkDrakeRoundTrip(const Model& model, ConstVectorRef q_closed) {
  const UrdfText text = formatDrake(model);
  const Model back = readDrake(text.urdf);
  const Difference d = compareWithDrake(model, back);
  CHECK(d.missing == "");
  CHECK(d.mass_matrix < kTolerance);
  CHECK(d.bias < kTolerance);
  CHECK(d.closures < kTolerance);
  if (!d.missing.empty()) return;
  CHECK(calcMotorError(model, back) < kTolerance);

  const int lost = countLost(model, back, text.warnings);
  // The same configurations are closed, and there it moves alike: rows were added, rank was not.
  const VectorXd neutral = model.makeNeutral(), q = mapConfiguration(model, back, neutral, q_closed);
  CHECK(calcGap(model, q_closed) < 1e-9);
  CHECK(calcGap(back, q) < 1e-9);
  if (lost > 0) return;
  const Mobility before = calcMobility(model, q_closed), after = calcMobility(back, q);
  CHECK(after.rank == before.rank);
  CHECK(after.mobility == before.mobility);
  std::mt19937 rng(3);
  const VectorXd near = back.integrate(q, randomVector(rng, back.nv(), 0.01));
  const AssemblyResult closed = closeConfiguration(back, near);
  CHECK(closed.status == NumericalStatus::Ok);
  CHECK(calcGap(model, mapConfiguration(back, model, back.makeNeutral(), closed.q)) < 1e-9);
}

// Axes of universal joints at right angles, as Drake wants them, and the loop closed again.
Mechanism makeSquare(const Mechanism& mechanism) {
  ModelParts parts = takeParts(mechanism.model);
  for (Joint& joint : parts.joints)
    if (joint.kind == JointKind::Universal)
      joint.axis2 = (joint.axis2 - joint.axis * joint.axis.dot(joint.axis2)).normalized();
  const Model model = ModelBuilder::restore(parts);
  return {model, closeConfiguration(model, mechanism.q_closed).q};
}

}  // namespace

TEST_CASE("every robot comes back from Drake's URDF as the same mechanism, with its motors") {
  for (const char* published : {"battobot_6d", "digit_like_2legs"}) findPublished(published);  // warns without them
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    checkDrakeRoundTrip(model, findClosedConfiguration(model).q);
    const UrdfText text = formatDrake(model);
    for (const ContactFrame& contact : model.contacts()) CHECK(contains(text.warnings, "'" + contact.name + "'"));
    for (const Reference& reference : model.references()) CHECK(contains(text.warnings, "'" + reference.name + "'"));
  }
}

TEST_CASE("generated robots come back from Drake's URDF") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const Model model = generator.make(generator.parameters);
    checkDrakeRoundTrip(model, findClosedConfiguration(model).q);
  }
}

TEST_CASE("random mechanisms come back from Drake's URDF: every joint, closure, base, springs and belts", "[sweep]") {
  unsigned seed = 0;
  Selection selection;
  for (const MechanismKind& kind : listMechanismKinds()) {
    CAPTURE(kind);
    std::mt19937 rng(++seed);
    if (selection.isLeftOut()) continue;
    const Mechanism plain = makeSquare(makeRandomMechanism(rng, kind.joint, kind.closure, kind.base));
    checkDrakeRoundTrip(plain.model, plain.q_closed);
    const Mechanism belted = makeSquare(makeBeltedMechanism(rng, kind.joint, kind.closure, kind.base, true));
    checkDrakeRoundTrip(belted.model, belted.q_closed);
    const Mechanism sprung = makeSquare(makeSprungMechanism(rng, kind.joint, kind.closure, kind.base));
    checkDrakeRoundTrip(sprung.model, sprung.q_closed);
  }
}

namespace {

// A slide on a swing, tied to the ground and to a plate on a universal joint, with springs.
Model makeToy() {
  ModelBuilder builder("toy <1>");
  const Inertia inertia = {2, Vector3d(0.1, 0.2, 0.3), 0.1 * Matrix3d::Identity()};
  Joint joint;
  joint.name = "swing", joint.kind = JointKind::Revolute, joint.axis = Vector3d::UnitY(), joint.X_PJ.p = {0, 0, 1};
  JointLimits limits;
  limits.lower = VectorXd::Constant(1, -1), limits.upper = VectorXd::Constant(1, HUGE_VAL);
  builder.addLink("arm", "world", joint, inertia, limits);
  joint.name = "slide", joint.kind = JointKind::Prismatic;
  builder.addLink("block", "arm", joint, inertia);
  joint.name = "cross", joint.kind = JointKind::Universal, joint.axis = Vector3d::UnitZ();
  joint.axis2 = Vector3d(1, 1, 0).normalized();
  builder.addLink("plate", "arm", joint, inertia);
  joint.name = "knob", joint.kind = JointKind::Spherical;
  builder.addLink("knob", "plate", joint, inertia);
  const auto addFrame = [&](const char* name, const char* link, const Vector3d& p) {
    builder.addFrame(name, link, {Matrix3d::Identity(), p});
  };
  addFrame("ground", "world", {3, 0, 0});  // the name that would be made
  addFrame("end", "block", {0, 0.5, 0});
  addFrame("corner", "plate", {0.25, 0, 0});
  builder.addClosure("pin", ClosureKind::Ball3D, "ground", "end");
  builder.addClosure("hinge", ClosureKind::Hinge5D, "end", "corner", Vector3d::UnitY());
  builder.addMotor("swing", 0.125, 7, 3);
  builder.addMotor("slide", 0, HUGE_VAL, HUGE_VAL);
  PointSpring spring;
  spring.name = "spring", spring.point1 = {1, 0, 0}, spring.point2 = {0, 0, 0.5};
  spring.stiffness = 10, spring.rest = 0.5, spring.preload = 2.5, spring.damping = 2;
  builder.addPointSpring("world", "plate", spring);
  JointForce force;
  force.damping = 0.5, force.friction = 0.25, force.stiffness = 3;
  builder.addJointForce("slide", force);
  return builder.build();
}

}  // namespace

TEST_CASE("Drake's URDF in its words, and what they lose") {
  ModelParts parts = takeParts(makeToy());
  Motor& geared = parts.motors[0];
  geared.drive.ratio = 5, geared.drive.rotor_inertia = 0.005, geared.drive.efficiency = 0.7;
  PointSpring other = parts.point_springs[0];
  other.name = "short", other.preload = 6;
  parts.point_springs.push_back(other);
  other.name = "constant", other.stiffness = 0;
  parts.point_springs.push_back(other);
  parts.closures[0].kp = 1;
  parts.armature[parts.joints[4].idx_v] = 0.5;
  parts.gravity = {0, 0, -1};
  const Model model = ModelBuilder::restore(parts);
  const UrdfText text = formatDrake(model);
  for (const char* part :
       {"<robot name=\"toy &lt;1&gt;\" xmlns:drake=\"http://drake.mit.edu\">",
        "<drake:joint name=\"cross\" type=\"universal\">", "<drake:joint name=\"knob\" type=\"ball\">",
        "<limit lower=\"-1\" effort=\"7\" velocity=\"3\"/>", "<dynamics damping=\"0.5\" friction=\"0.25\"/>",
        "<drake:ball_constraint_body_A name=\"ground_\"/>", "<drake:ball_constraint_p_AP value=\"3 0 0\"/>",
        "<drake:ball_constraint_p_BQ value=\"0 0.5 0\"/>", "<drake:ball_constraint_p_AP value=\"0 0.55",
        "<drake:linear_spring_damper_free_length value=\"0.25\"/>",
        "<drake:linear_spring_damper_stiffness value=\"10\"/>", "<drake:linear_spring_damper_damping value=\"2\"/>",
        "<type>transmission_interface/SimpleTransmission</type>",
        "<actuator name=\"swing\">\n      <drake:rotor_inertia value=\"0.005\"/>\n      "
        "<drake:gear_ratio value=\"5\"/>"})
    CHECK_THAT(text.urdf, Catch::Contains(part));
  CHECK(text.urdf.find("effort=\"0\"") == std::string::npos);  // of which Drake would make no motor
  for (const char* lost : {"closure 'pin': its gains", "link 'plate': its frame is turned",
                           "point spring 'short': it is left out", "point spring 'constant': its preload",
                           "joint 'slide': its friction is written, but", "joint 'slide': its spring",
                           "joints 'knob': their armature", "gravity", "motor 'swing': its winding and the losses"})
    CHECK(contains(text.warnings, lost));
  CHECK(text.warnings.size() == 9);
  const Model back = readDrake(text.urdf);
  const Difference d = compareWithDrake(model, back);
  CHECK(d.missing == "");
  CHECK(std::max({d.mass_matrix, d.bias, d.closures}) < kTolerance);
  CHECK(back.motors()[0].drive.ratio == 5);
  CHECK(back.motors()[0].armature == 0.125);
  CHECK(back.closures()[0].name == "pin");  // exactly: what was a ball stays one
  CHECK(back.closures()[0].X_B2.p == model.closures()[0].X_B2.p);
  CHECK(back.lowerLimits()[0] == -1);
  CHECK(std::isinf(back.upperLimits()[0]));

  for (Joint& joint : parts.joints)
    if (joint.kind == JointKind::Universal) joint.axis2 = Vector3d(0, 1, 1).normalized();
  CHECK_THAT(getError([&] { formatDrake(ModelBuilder::restore(parts)); }),
             Catch::Contains("universal joint 'cross': its axes are not perpendicular"));
}

TEST_CASE("a number of Drake's URDF that is wrong by a millionth shows") {
  const Model model = makeToy();
  const std::string urdf = formatDrake(model).urdf;
  const auto isSame = [&](const std::string& text) {
    const Model back = readDrake(text);
    const Difference d = compareWithDrake(model, back);
    return d.isZero() && calcMotorError(model, back) < kTolerance;
  };
  REQUIRE(isSame(urdf));
  for (const char* start :
       {"ball_constraint_p_AP value=\"", "ball_constraint_p_BQ value=\"0 ", "rotor_inertia value=\"",
        "gear_ratio value=\"", "linear_spring_damper_p_AP value=\"", "linear_spring_damper_free_length value=\"",
        "linear_spring_damper_stiffness value=\"", "linear_spring_damper_damping value=\"", "damping=\"", "friction=\"",
        "effort=\"", "velocity=\"", "lower=\"", "mass value=\""}) {
    CAPTURE(start);
    const size_t at = urdf.find(start) + std::string(start).size(), end = urdf.find_first_of(" \"", at);
    REQUIRE(urdf.find(start) != std::string::npos);
    std::string poisoned = urdf;
    poisoned.replace(at, end - at, formatNumber(std::stod(urdf.substr(at, end - at)) * (1 + 1e-6), "%.17g"));
    REQUIRE(poisoned != urdf);
    CHECK(!isSame(poisoned));
  }
}

TEST_CASE("numbers of Drake's URDF are written however large they are") {
  ModelParts parts = takeParts(loadRobot("fourbar").model);
  parts.joints.back().X_PJ.p = Vector3d(12345.6789, -1e300, 0.1);
  const std::string urdf = formatDrake(ModelBuilder::restore(parts)).urdf;
  CHECK_THAT(urdf, Catch::Contains("xyz=\"12345.6789 -1e+300 0.1\""));
  CHECK_THAT(urdf, !Catch::Contains("inf"));
}
