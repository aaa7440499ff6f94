// Generated robots: possible bodies, loops that close, mobility as counted by hand, and the files that come along.
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/results/robot_info.h"
#include "bielle/robots/robot_loader.h"
#include "leg_biped.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "robot_directory.h"
#include "robots/cleobot.h"
#include "robots/delta.h"
#include "robots/kangaroo.h"
#include "robots/solid.h"
#include "robots/spring_biped.h"
#include "robots/spring_leg.h"
#include "selection.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

const std::string kRobots = std::string(BIELLE_SOURCE_DIR) + "/robots/";

// Same bodies, joints, closures, motors and feet; placements and inertias to the rounding of the files.
void checkSame(const Model& a, const Model& b) {
  REQUIRE(a.numBodies() == b.numBodies());
  for (int i = 1; i < a.numBodies(); ++i) {
    const Joint &ja = a.joints()[i], &jb = b.joints()[i];
    CAPTURE(ja.name);
    CHECK(ja.name == jb.name);
    if (ja.nv == 1) {
      CHECK(a.lowerLimits()[ja.idx_v] == b.lowerLimits()[jb.idx_v]);
      CHECK(a.upperLimits()[ja.idx_v] == b.upperLimits()[jb.idx_v]);
    }
    CHECK(a.bodies()[i].name == b.bodies()[i].name);
    CHECK(ja.kind == jb.kind);
    CHECK(ja.parent == jb.parent);
    CHECK(ja.position_importance == jb.position_importance);
    CHECK(ja.velocity_importance == jb.velocity_importance);
    CHECK((ja.X_PJ.p - jb.X_PJ.p).norm() < 1e-11);
    CHECK((ja.X_PJ.R - jb.X_PJ.R).norm() < 1e-11);
    if (ja.nv <= 2) CHECK((ja.axis - jb.axis).norm() < 1e-11);
    if (ja.nv == 2) CHECK((ja.axis2 - jb.axis2).norm() < 1e-11);
    const Matrix6d Ya = a.bodies()[i].inertia.toMatrix(), Yb = b.bodies()[i].inertia.toMatrix();
    CHECK((Ya - Yb).norm() < 1e-10 * (1 + Ya.norm()));
  }
  REQUIRE(a.closures().size() == b.closures().size());
  for (size_t c = 0; c < a.closures().size(); ++c) {
    const Closure &ca = a.closures()[c], &cb = b.closures()[c];
    CHECK(ca.name == cb.name);
    CHECK(ca.kind == cb.kind);
    CHECK(ca.body1 == cb.body1);
    CHECK(ca.body2 == cb.body2);
    CHECK((ca.X_B1.p - cb.X_B1.p).norm() < 1e-11);
    CHECK((ca.X_B2.p - cb.X_B2.p).norm() < 1e-11);
    CHECK(ca.offset == Approx(cb.offset).epsilon(1e-11));
    REQUIRE(ca.terms.size() == cb.terms.size());
    for (size_t i = 0; i < ca.terms.size(); ++i) {
      CHECK(ca.terms[i].dof == cb.terms[i].dof);
      CHECK(ca.terms[i].coefficient == Approx(cb.terms[i].coefficient).epsilon(1e-11));
    }
  }
  REQUIRE(a.jointForces().size() == b.jointForces().size());
  for (size_t i = 0; i < a.jointForces().size(); ++i) {
    const JointForce &fa = a.jointForces()[i], &fb = b.jointForces()[i];
    CHECK(fa.joint == fb.joint);
    for (double JointForce::*field : {&JointForce::stiffness, &JointForce::rest, &JointForce::preload,
                                      &JointForce::damping, &JointForce::friction, &JointForce::friction_speed})
      CHECK(fa.*field == Approx(fb.*field).epsilon(1e-11));
  }
  REQUIRE(a.pointSprings().size() == b.pointSprings().size());
  for (size_t i = 0; i < a.pointSprings().size(); ++i) {
    const PointSpring &sa = a.pointSprings()[i], &sb = b.pointSprings()[i];
    CHECK(sa.name == sb.name);
    CHECK(sa.body1 == sb.body1);
    CHECK(sa.body2 == sb.body2);
    CHECK((sa.point1 - sb.point1).norm() < 1e-11);
    CHECK((sa.point2 - sb.point2).norm() < 1e-11);
    for (double PointSpring::*field :
         {&PointSpring::stiffness, &PointSpring::rest, &PointSpring::preload, &PointSpring::damping})
      CHECK(sa.*field == Approx(sb.*field).epsilon(1e-11));
  }
  REQUIRE(a.nu() == b.nu());
  for (int m = 0; m < a.nu(); ++m) {
    CHECK(a.motors()[m].name == b.motors()[m].name);
    CHECK(a.motors()[m].effort_limit == b.motors()[m].effort_limit);
    CHECK(a.motors()[m].torque_loss == b.motors()[m].torque_loss);
  }
  CHECK((a.armature() - b.armature()).norm() < 1e-12);
  CHECK(a.lowerLimits() == b.lowerLimits());
  CHECK(a.upperLimits() == b.upperLimits());
  REQUIRE(a.contacts().size() == b.contacts().size());
  for (size_t c = 0; c < a.contacts().size(); ++c) {
    CHECK(a.contacts()[c].name == b.contacts()[c].name);
    CHECK(a.contacts()[c].half_length == Approx(b.contacts()[c].half_length));
    CHECK((a.contacts()[c].X_BF.p - b.contacts()[c].X_BF.p).norm() < 1e-11);
  }
  CHECK(a.serialJoints() == b.serialJoints());
  REQUIRE(a.visuals().size() == b.visuals().size());
  REQUIRE(a.references().size() == b.references().size());
  for (size_t r = 0; r < a.references().size(); ++r) {
    CHECK(a.references()[r].name == b.references()[r].name);
    CHECK(a.references()[r].joints.size() == b.references()[r].joints.size());
  }
}

// Properties of a generated robot that are known by hand.
struct Expected {
  int rows, rank, mobility, motors;
  double mass;  // kg
};

const std::map<std::string, Expected>& getExpected() {
  // Cleobot, Gruebler per leg. Hip: 7 bodies, 42 - 3 * 5 (motors) - 3 * 4 (universal) - 4 * 3 (balls) = 3. Lower leg: 7
  // bodies, 42 - 6 * 5 (motors and knees) - 3 * 3 (balls) = 3. The base has 6.
  // RSU biped, per leg: four serial joints, and the ankle with its chains: 6 bodies, 36 - 4 * 5 - 2 * 4 - 2 * 3 = 2.
  // Belt biped, per leg: four serial joints, three couplers over six more coordinates with three motors among them. One coupler
  // with the belt of the knee alone, two with the differential of the ankle alone; fewer pulleys of 0.1 kg.
  // A planar loop of hinges has three rows that count less the turn about its own hinge: 2. Five-bar leg: rail and four
  // hinges, 5 - 2. Spring leg: 10 joints, the heel rod's ball 3, the planar loop of the toe 2. Delta: 16 joints, the
  // platform moves in 3 directions. Chain: 3 joints and one planar loop per four-bar.
  // Spring biped, per leg: 17 coordinates (two more of leaves than motors), 9 rows of balls, and 6 of the base.
  // Kangaroo: robots/kangaroo.h counts 38 joints, 80 rows and the rank of 32 of a leg.
  static const std::map<std::string, Expected> expected = {
      {"kangaroo", {160, 64, 18, 12, 40.37}},  {"kangaroo_leg", {80, 32, 7, 6, 28.19}},
      {"cleobot", {30, 30, 18, 12, 24.6}},     {"rsu_biped", {12, 12, 18, 12, 25.68}},
      {"belt_biped", {6, 6, 18, 12, 26.5016}}, {"fivebar_leg", {5, 2, 3, 2, 1.83}},
      {"spring_leg", {8, 5, 5, 5, 8.297}},     {"delta", {25, 13, 3, 3, 3.918}},
      {"fourbar_chain", {15, 6, 3, 3, 4.8}},   {"spring_biped", {18, 18, 22, 12, 33.31}},
      {"belt_knee", {2, 2, 18, 12, 26.1016}},  {"differential_ankle", {4, 4, 18, 12, 25.44}},
      {"leg_biped", {10, 10, 18, 12, 25.86}},  {"humanoid", {18, 18, 26, 20, 29.2}},
  };
  return expected;
}

}  // namespace

TEST_CASE("solids: inertias by their own integrals") {
  // Second moments of a solid from a grid of points.
  const auto integrate = [](const Solid& solid, const auto& inside, const Vector3d& half) {
    const int n = 60;
    Matrix3d I = Matrix3d::Zero();
    int count = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k) {
          const Vector3d p = half.cwiseProduct(2 * Vector3d(i + 0.5, j + 0.5, k + 0.5) / n - Vector3d::Ones());
          if (!inside(p)) continue;
          ++count;
          const Vector3d r = solid.X_LS.R * p;
          I += r.squaredNorm() * Matrix3d::Identity() - r * r.transpose();
        }
    return Matrix3d(I * solid.mass / count);
  };
  const Solid box = makeBox({0.1, 0.2, 0.3}, {0.2, 0.3, 0.5}, 2, colors::kSteel);
  const Solid rod = makeRod({0.1, 0, 0.2}, {0.3, 0.4, -0.1}, 0.08, 3, colors::kRod);
  const Solid ball = makeSphere({0, 0, 1}, 0.2, 1.5, colors::kSteel);
  const double length = Vector3d(0.2, 0.4, -0.3).norm();
  CHECK(rod.mass == Approx(3 * length));
  CHECK((rod.X_LS.R.col(2) - Vector3d(0.2, 0.4, -0.3) / length).norm() < 1e-12);
  CHECK((calcInertia(rod).com - Vector3d(0.2, 0.2, 0.05)).norm() < 1e-12);
  const auto check = [&](const Solid& solid, const auto& inside, const Vector3d& half) {
    const Matrix3d I = integrate(solid, inside, half), J = calcInertia(solid).I_com;
    CHECK((I - J).norm() < 5e-3 * J.norm());
  };
  check(box, [](const Vector3d&) { return true; }, {0.1, 0.15, 0.25});
  check(rod, [](const Vector3d& p) { return p.head<2>().norm() < 0.08; }, {0.08, 0.08, length / 2});
  check(
      ball, [](const Vector3d& p) { return p.norm() < 0.2; }, Vector3d::Constant(0.2));
  const Inertia sum = calcInertia(std::vector<Solid>{box, ball});
  CHECK(sum.mass == Approx(3.5));
  CHECK(sum.com.z() == Approx((2 * 0.3 + 1.5) / 3.5));
}

TEST_CASE("generators: every body is possible, the loops close, mobility is what Gruebler counts") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const Model model = generator.make(generator.parameters);
    double mass = 0;
    for (int i = 1; i < model.numBodies(); ++i) {
      const Inertia& inertia = model.bodies()[i].inertia;
      CAPTURE(model.bodies()[i].name);
      CHECK(inertia.mass > 0);
      const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia.I_com).eigenvalues();
      CHECK(moments[0] > 0);
      CHECK(moments[2] < moments[0] + moments[1]);
      mass += inertia.mass;
    }
    REQUIRE(getExpected().count(generator.name) == 1);
    const Expected& expected = getExpected().at(generator.name);
    CHECK(mass == Approx(expected.mass).epsilon(0.005));
    const AssemblyResult closed = findClosedConfiguration(model);
    REQUIRE(closed.status == NumericalStatus::Ok);
    CHECK(closed.gap < 1e-11);
    const Mobility mobility = calcMobility(model, closed.q);
    CHECK(mobility.rows == expected.rows);
    CHECK(mobility.rank == expected.rank);
    CHECK(mobility.mobility == expected.mobility);
    CHECK(model.nu() == expected.motors);
    for (const Reference& reference : model.references())
      CHECK(assembleReference(model, reference.name).status == NumericalStatus::Ok);
  }
}

TEST_CASE("generators: references are assembled with the angles that they give, and those of robots that come along") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    CHECK(checkReferences({generator.make(generator.parameters), {}, "", "", {}, {}}).empty());
  }
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    if (name == "battobot") continue;  // its knees stand outside their published ranges: README.md
    CHECK(checkReferences(loadRobot(name)).empty());
  }
}

TEST_CASE("generators: robots that come along name theirs, and are the same from the files that it writes") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const std::string place = kRobots + generator.name + "/";
    CHECK(std::filesystem::exists(place + "README.md"));
    CHECK_FALSE(std::filesystem::exists(place + generator.name + ".urdf"));
    const LoadedRobot loaded = loadRobot(kRobots + generator.name);
    CHECK(loaded.warnings.empty());
    CHECK(loaded.file == place + generator.name + ".yaml");
    const Model model = generator.make(generator.parameters);
    CHECK(loaded.model.name() == model.name());
    checkSame(model, loaded.model);
    const RobotDirectory directory;
    writeRobot(model, directory.path() + "/written");
    const LoadedRobot written = loadRobot(directory.path() + "/written");
    CHECK(written.warnings.empty());
    checkSame(model, written.model);
    CHECK(written.model.gravity() == loaded.model.gravity());
    const auto calcMassMatrix = [](const Model& of) {
      Workspace ws(of);
      updatePositions(of, ws, of.makeNeutral());
      updateMassMatrix(of, ws);
      return ws.M;
    };
    CHECK(calcMassMatrix(written.model) == calcMassMatrix(loaded.model));
    const RobotText a = formatRobot(written.model), b = formatRobot(loaded.model);
    CHECK(a.urdf == b.urdf);
    CHECK(a.yaml == b.yaml);
  }
}

TEST_CASE("files that name a generator: parameters by number and choice, a fixed base, keys that complete them") {
  const RobotDirectory files;
  files.write("mine/mine.yaml", "generator: leg_biped\nset:\n  knee: belt\n  thigh_length: 0.25\n");
  const LoadedRobot mine = loadRobot(files.path() + "/mine");
  CHECK(mine.warnings.empty());
  checkSame(makeLegBiped({{"knee", "belt"}, {"thigh_length", 0.25}}), mine.model);
  CHECK(mine.model.hasFreeFlyer());
  LoadOptions fixed;
  fixed.base = BaseKind::Fixed;
  CHECK(loadRobot(files.path() + "/mine/mine.yaml", fixed).model.nv() == mine.model.nv() - 6);
  // Beside the generator, and in a file that completes the one with it.
  const std::string spring = "joint_forces: {knee_left: {stiffness: 20}}\n";
  files.write("springy/springy.yaml", "generator: leg_biped\nset: {knee: belt}\nbase: fixed\n" + spring);
  files.write("other/other.yaml", "model: ../mine\n" + spring);
  files.write("by_name/by_name.yaml", "model: rsu_biped\n" + spring);
  for (const std::string name : {"springy", "other", "by_name"}) {
    CAPTURE(name);
    const Model model = loadRobot(files.path() + "/" + name).model;
    REQUIRE(model.jointForces().size() == 1);
    CHECK(model.jointForces()[0].stiffness == 20);
    CHECK(model.hasFreeFlyer() == (name != "springy"));
    CHECK(model.nu() == 12);
  }
  // What a key replaces is told.
  files.write("geared/geared.yaml", "model: ../mine\nmotors:\n  hipz_left: {effort: 20}\n  hipz_right: {effort: 20}\n");
  const LoadedRobot geared = loadRobot(files.path() + "/geared");
  CHECK(geared.model.nu() == 2);
  REQUIRE(geared.warnings.size() == 1);
  CHECK_THAT(geared.warnings[0],
             Catch::Contains("geared.yaml: key 'motors': it replaces that of the robot: left out are") &&
                 Catch::Contains("hipy_left") && !Catch::Contains("hipz_left"));
  files.write("toes/toes.yaml",
              "model: ../mine\nreferences:\n  half_sitting: {joints: {hipz_left: 0.3, hipz_right: -0.3}}\n");
  const LoadedRobot toes = loadRobot(files.path() + "/toes");
  REQUIRE_FALSE(toes.warnings.empty());
  CHECK_THAT(toes.warnings[0], Catch::Contains("toes.yaml: reference 'half_sitting': it replaces that of the robot") &&
                                   Catch::Contains("knee_left") && Catch::Contains("its height, its feet"));
}

TEST_CASE("writer: robots that were read are written and read again") {
  for (const char* name : {"bipetto", "fourbar", "fivebar"}) {
    CAPTURE(name);
    const RobotDirectory directory;
    const Model model = loadRobot(kRobots + name).model;
    writeRobot(model, directory.path() + "/copy", "A copy.");
    const LoadedRobot copy = loadRobot(directory.path() + "/copy");
    CHECK(copy.warnings.empty());
    CHECK(copy.model.name() == model.name());
    checkSame(model, copy.model);
  }
}

TEST_CASE("writer: every number comes back to the last bit, attitudes to rounding", "[sweep]") {
  std::mt19937 rng(5);
  Selection selection;
  for (const MechanismKind& kind : listMechanismKinds())
    for (int repeat = 0; repeat < 3; ++repeat) {
      // Universal joints about oblique axes, which its files cannot express.
      if (kind.joint == JointKind::Universal || kind.base == MechanismBase::FreeFlyer || selection.isLeftOut())
        continue;
      CAPTURE(kind, repeat);
      const Model model = makeSprungMechanism(rng, kind.joint, kind.closure, kind.base).model;
      const RobotDirectory directory;
      writeRobot(model, directory.path() + "/copy", "");
      const Model copy = loadRobot(directory.path() + "/copy").model;
      REQUIRE(copy.numBodies() == model.numBodies());
      for (size_t i = 1; i < model.bodies().size(); ++i) {
        const Joint &a = model.joints()[i], &b = copy.joints()[copy.findJoint(a.name)];
        const Inertia &m = model.bodies()[i].inertia,
                      &n = copy.bodies()[static_cast<size_t>(&b - copy.joints().data())].inertia;
        CHECK(a.X_PJ.p == b.X_PJ.p);
        CHECK((a.X_PJ.R - b.X_PJ.R).cwiseAbs().maxCoeff() < 1e-14);
        CHECK(m.mass == n.mass);
        CHECK(m.com == n.com);
        CHECK(MatrixXd(m.I_com.triangularView<Eigen::Upper>()) == MatrixXd(n.I_com.triangularView<Eigen::Upper>()));
      }
      for (size_t c = 0; c < model.closures().size(); ++c) {
        CHECK(model.closures()[c].X_B1.p == copy.closures()[c].X_B1.p);
        CHECK(model.closures()[c].X_B2.p == copy.closures()[c].X_B2.p);
        CHECK(model.closures()[c].offset == copy.closures()[c].offset);
        CHECK(model.closures()[c].length == copy.closures()[c].length);
        if (hasAxis(kind.closure)) CHECK(model.closures()[c].axis == copy.closures()[c].axis);
      }
      for (size_t s = 0; s < model.pointSprings().size(); ++s)
        CHECK(model.pointSprings()[s].stiffness == copy.pointSprings()[s].stiffness);
    }
}

TEST_CASE("writer: names are escaped, what the files cannot say is refused") {
  const auto build = [](const Joint& joint, const JointLimits& limits = {}) {
    ModelBuilder builder("a & \"b\"");
    builder.addLink("arm <1>", "world", joint, {1, Vector3d::Zero(), Matrix3d::Identity()}, limits);
    return builder.build();
  };
  const RobotDirectory directory;
  Joint joint = makeRevolute("turn: \"one\" & more", {0, 0, 1}, Vector3d(1, 2, 2) / 3);
  joint.X_PJ.R = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()).toRotationMatrix();  // roll and yaw turn about one axis
  const Model model = build(joint);
  writeRobot(model, directory.path() + "/odd");
  checkSame(model, loadRobot(directory.path() + "/odd").model);

  ModelBuilder motors("motors");
  for (const char* name : {"known", "unknown"})
    motors.addLink(name, "world", makeRevolute(name, {0, 0, 0}, Vector3d::UnitZ()),
                   {1, Vector3d::Zero(), Matrix3d::Identity()});
  motors.addMotor("known", 0.1, 20, 3, 0.0625);
  motors.addMotor("unknown", 0.1);
  const Model driven = motors.build();
  writeRobot(driven, directory.path() + "/motors");
  checkSame(driven, loadRobot(directory.path() + "/motors").model);

  motors.addCoupler("belt", {{"known", 1.0 / 3}, {"unknown", -2}}, 0.7, 3, 4);
  JointForce force;
  force.stiffness = 2.5, force.rest = -0.1, force.preload = 3, force.damping = 0.2;
  motors.addJointForce("known", force);
  force = {};
  force.friction = 0.3, force.friction_speed = 0.05;
  motors.addJointForce("unknown", force);
  PointSpring spring;
  spring.name = "a: \"spring\"", spring.point1 = {0.1, 0.2, 0.3}, spring.point2 = {-1.0 / 3, 0, 0};
  spring.stiffness = 1000, spring.rest = 0.2, spring.preload = -30, spring.damping = 4;
  motors.addPointSpring("world", "known", spring);
  spring.name = "damper", spring.stiffness = spring.preload = 0;
  motors.addPointSpring("unknown", "known", spring);
  const Model belted = motors.build();
  writeRobot(belted, directory.path() + "/belted");
  checkSame(belted, loadRobot(directory.path() + "/belted").model);
  CHECK(loadRobot(directory.path() + "/belted").model.closures()[0].kd == 4);

  const Joint skew = makeUniversal("u", {0, 0, 0}, Vector3d(1, 1, 0).normalized(), Vector3d::UnitZ());
  CHECK_THROWS_WITH(formatRobot(build(skew)), Catch::Contains("universal joint 'u'"));
  JointLimits half;
  half.lower = VectorXd::Constant(1, -1);
  const Model halved = build(joint, half);
  writeRobot(halved, directory.path() + "/halved");
  checkSame(halved, loadRobot(directory.path() + "/halved").model);
}

TEST_CASE("generators: names stay when lengths change, bounds and names are checked") {
  for (const Generator& generator : listGenerators()) {
    CAPTURE(generator.name);
    const Model model = generator.make(generator.parameters);
    generator.parameters.check();
    OptionSet parameters = generator.parameters;
    for (const Option& p : generator.parameters) {
      CAPTURE(p.name);
      CHECK_FALSE(p.help.empty());
      if (const double* value = std::get_if<double>(&p.value)) parameters.set(p.name, 1.01 * *value);
    }
    const Model other = generator.make(parameters);
    REQUIRE(other.numBodies() == model.numBodies());
    for (int i = 1; i < model.numBodies(); ++i) CHECK(other.joints()[i].name == model.joints()[i].name);
    for (int m = 0; m < model.nu(); ++m) CHECK(other.motors()[m].name == model.motors()[m].name);
    CHECK(other.mass() != model.mass());
    const auto is_number = [](const Option& p) { return std::holds_alternative<double>(p.value); };
    const Option number = *std::find_if(parameters.begin(), parameters.end(), is_number);
    for (const double beyond : {number.bounds.upper + 1, std::numeric_limits<double>::quiet_NaN()}) {
      CHECK_THROWS_WITH(parameters.set(number.name, beyond), Catch::Contains("parameter '" + number.name + "'"));
      OptionSet unchecked;
      for (Option p : parameters) {
        if (p.name == number.name) p.value = beyond;
        unchecked.add(p);
      }
      CHECK_THROWS_WITH(generator.make(unchecked),
                        Catch::Contains(generator.name + ": parameter '" + number.name + "'"));
    }
    CHECK_THROWS_WITH(parameters.set("no_such", 1), Catch::Contains(number.name));
  }
  CHECK_THROWS_WITH(findGenerator("no_such"), Catch::Contains("cleobot"));
}

TEST_CASE("humanoid: fingers mimic the one that has the motor, tips stay parallel") {
  const Model model = loadRobot("humanoid").model;
  const auto index = [&](const char* joint) { return model.joints()[model.findJoint(joint)].idx_q; };
  VectorXd q = assembleReference(model, "half_sitting").q;
  q[index("finger1_joint_left")] = 0.3;
  const AssemblyResult closed = closeConfiguration(model, q);
  REQUIRE(closed.status == NumericalStatus::Ok);
  const double finger = closed.q[index("finger1_joint_left")];
  CHECK(std::abs(finger) > 0.05);
  CHECK(closed.q[index("finger2_joint_left")] == Approx(-finger));
  CHECK(closed.q[index("fingertip1_joint_left")] == Approx(-finger));
  CHECK(closed.q[index("fingertip2_joint_left")] == Approx(finger));
  CHECK(closed.q[index("finger1_joint_right")] == Approx(0).margin(1e-9));
  Workspace ws(model);
  updatePlacements(model, ws, closed.q);
  const auto getAttitude = [&](const char* joint) { return ws.X_WB[model.findJoint(joint)].R; };
  for (const char* tip : {"fingertip1_joint_left", "fingertip2_joint_left"})
    CHECK((getAttitude(tip) - getAttitude("elbow_left")).norm() < 1e-9);
}
