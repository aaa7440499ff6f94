// Linkages of generated robots move as their dimensions say: mirror images, closed forms, worked examples, rigid limits.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "math/so3.h"
#include "robots/cleobot.h"
#include "robots/delta.h"
#include "robots/kangaroo.h"
#include "robots/spring_biped.h"
#include "robots/spring_leg.h"

using namespace bielle;

TEST_CASE("Cleobot: its neutral configuration stands closed, the legs are mirror images") {
  const Model model = makeCleobot();
  Workspace ws(model);
  VectorXd q = model.makeNeutral();
  q[2] = 0.6;
  updatePositions(model, ws, q);
  CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-15);
  for (const ContactFrame& foot : model.contacts()) {
    const SE3 X = getPlacement(ws, foot.body, foot.X_BF);
    CHECK((X.p - Vector3d(0, foot.name == "foot_left" ? 0.125 : -0.125, 0)).norm() < 1e-12);
    CHECK(X.R.isIdentity(1e-12));
  }
  for (int i = 1; i < model.numBodies(); ++i) {
    std::string name = model.bodies()[i].name;
    const size_t at = name.find("_left");
    if (at == std::string::npos) continue;
    const int other = model.frames()[model.findFrame(name.replace(at, 5, "_right"))].body;
    const Vector3d mirror(1, -1, 1);
    CHECK((getPlacement(ws, i, {}).p - mirror.cwiseProduct(getPlacement(ws, other, {}).p)).norm() < 1e-12);
    const Inertia &a = model.bodies()[i].inertia, &b = model.bodies()[other].inertia;
    CHECK((a.com - mirror.cwiseProduct(b.com)).norm() < 1e-12);
    CHECK((a.I_com - Matrix3d(mirror.asDiagonal() * b.I_com * mirror.asDiagonal())).norm() < 1e-12);
  }
}

TEST_CASE("Cleobot: limbs that do not reach are refused") {
  CleobotParameters parameters;
  parameters.shank_length = 0.15;
  CHECK_THROWS_WITH(makeCleobot(parameters), Catch::Contains("do not meet"));
}

TEST_CASE("delta: the platform follows the closed form") {
  const DeltaParameters p;
  const Model model = makeDelta(p);
  const auto depth = [&](double angle) {
    const double reach = p.base_radius + p.upper_length * std::cos(angle) - p.platform_radius;
    return p.upper_length * std::sin(angle) + std::sqrt(p.forearm_length * p.forearm_length - reach * reach);
  };
  const Frame& effector = model.frames()[model.findFrame("effector")];
  for (double turn : {-0.5, 0.0, 0.4}) {
    AssemblyProblem problem;
    problem.q_ref = model.makeNeutral();
    problem.weights = VectorXd::Constant(model.nv(), 1e-6);
    for (const Motor& motor : model.motors()) {
      // The axis is z x d: a positive angle turns the arm down.
      problem.q_ref[model.joints()[motor.joint].idx_q] = turn;
      problem.weights[motor.dof] = 1;
    }
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    Workspace ws(model);
    updatePositions(model, ws, result.q);
    const SE3 X = getPlacement(ws, effector.body, effector.X_BF);
    CHECK((X.p + Vector3d(0, 0, depth(p.arm_angle + turn))).norm() < 1e-9);
    CHECK(X.R.isIdentity(1e-9));
  }
}

TEST_CASE("delta: the platform is where the worked examples of its source have it") {
  // R. L. Williams II, 2016, of the IRB 360-1/1600: motor angles, in degrees, for a place of the platform, in metres.
  // The first arm is along -y there and along x here.
  struct Example {
    Vector3d place, angles;
  };
  const DeltaParameters p;
  const Model model = makeDelta(p);
  const Frame& effector = model.frames()[model.findFrame("effector")];
  for (const Example& example :
       {Example{{0, 0, -0.9}, {-20.5, -20.5, -20.5}}, Example{{0.3, 0.5, -1.1}, {47.5, -11.6, 21.4}}}) {
    AssemblyProblem problem;
    problem.q_ref = model.makeNeutral();
    problem.weights = VectorXd::Constant(model.nv(), 1e-6);
    for (int m = 0; m < 3; ++m) {
      problem.q_ref[model.joints()[model.motors()[m].joint].idx_q] = example.angles[m] * M_PI / 180 - p.arm_angle;
      problem.weights[model.motors()[m].dof] = 1;
    }
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    Workspace ws(model);
    updatePositions(model, ws, result.q);
    const Vector3d& place = example.place;
    const Vector3d difference =
        getPlacement(ws, effector.body, effector.X_BF).p - Vector3d(-place.y(), place.x(), place.z());
    CAPTURE(difference.transpose());
    CHECK(difference.norm() < 2e-3);  // angles are printed to a tenth of a degree
  }
}

TEST_CASE("spring leg: the heel rod keeps the tarsus nearly parallel to itself while the knee bends") {
  const Model model = makeSpringLeg();
  const int tarsus = model.frames()[model.findFrame("tarsus_link")].body;
  Workspace ws(model);
  for (double bend : {-0.3, 0.3}) {
    AssemblyProblem problem;
    problem.q_ref = model.makeNeutral();
    problem.weights = VectorXd::Constant(model.nv(), 1e-6);
    for (const Motor& motor : model.motors()) problem.weights[motor.dof] = 1;
    problem.q_ref[model.joints()[model.findJoint("knee")].idx_q] = bend;
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    updatePositions(model, ws, result.q);
    CHECK(result.q[model.joints()[model.findJoint("knee")].idx_q] == Approx(bend).margin(0.05));
    CHECK(std::abs(log3(ws.X_WB[tarsus].R).y()) < 0.1 * std::abs(bend));
  }
}

TEST_CASE("spring biped: it stands as high as Cassie at the start of its published model, the tarsus as inclined") {
  // cassie.xml starts with the pelvis at 1.01 m, toes on the ground. In its hinges' angles, (0.497, -1.200, 1.427) rad of hip,
  // knee and tarsus are a closed posture: thigh 0.497, knee to tarsus joint -0.567, tarsus to toe 0.627 rad from straight down.
  const SpringBipedParameters p;
  const Model model = makeSpringBiped(p);
  Workspace ws(model);
  updatePositions(model, ws, model.makeNeutral());
  const auto locate = [&](const std::string& name) {
    const Frame& frame = model.frames()[model.findFrame(name)];
    return getPlacement(ws, frame.body, frame.X_BF).p;
  };
  CHECK(-locate("foot_left").z() == Approx(1.01).margin(0.01));
  const Vector3d tarsus = locate("toe_left") - locate("tarsus_link_left");
  CHECK(tarsus.norm() == Approx(p.tarsus_length));
  CHECK(std::atan2(tarsus.x(), -tarsus.z()) == Approx(0.627).margin(0.015));
  for (const char* name : {"foot", "heel", "shin", "plantar_rod1", "plantar_rod2"}) {
    CAPTURE(name);
    const Vector3d left = locate(name + std::string("_left")), right = locate(name + std::string("_right"));
    CHECK((left - Vector3d(1, -1, 1).cwiseProduct(right)).norm() < 1e-12);
  }
}

TEST_CASE("kangaroo: cranks turn with knee and ankle, screws and guides slide as far as their triangles say") {
  const KangarooParameters p;
  const Model model = makeKangarooLeg(p);
  const auto index = [&](const std::string& name) {
    REQUIRE(model.findJoint(name) >= 0);
    return model.joints()[model.findJoint(name)].idx_q;
  };
  const auto getArm = [](double arm, double angle, double turn) {  // forward, turned about y
    return Eigen::Vector2d(arm * std::cos(angle - turn), arm * std::sin(angle - turn));
  };
  for (const auto& [knee, pitch, roll] : {std::array<double, 3>{-0.2, 0.3, 0}, {0.6, -0.4, 0.1}, {1.3, -0.7, -0.15}}) {
    CAPTURE(knee, pitch, roll);
    AssemblyProblem problem;
    problem.q_ref = model.makeNeutral();
    problem.weights = VectorXd::Constant(model.nv(), 1e-6);
    for (const auto& [name, angle] :
         {std::pair<std::string, double>{"knee_left", knee}, {"ankley_left", pitch}, {"anklex_left", roll}}) {
      problem.q_ref[index(name)] = angle;
      problem.weights[model.joints()[model.findJoint(name)].idx_v] = 1;
    }
    const AssemblyResult result = assemble(model, problem);
    REQUIRE(result.status == NumericalStatus::Ok);
    const auto get = [&](const std::string& name) { return result.q[index(name)]; };
    REQUIRE(get("knee_left") == Approx(knee).margin(1e-6));
    CHECK(get("knee_crank_left_hinge") == Approx(get("knee_left")).margin(1e-9));
    const Eigen::Vector2d pivot(0, -p.thigh_length + p.knee_crank_height);
    const Eigen::Vector2d start(p.knee_arm * std::cos(p.knee_angle), -p.knee_screw_drop);
    const auto reach = [&](double turn) { return (pivot + getArm(p.knee_arm, p.knee_angle, turn) - start).norm(); };
    CHECK(get("motor_knee_screw_left") == Approx(reach(get("knee_left")) - reach(0)).margin(1e-9));
    CHECK(get("knee_screw_left_guide_slide") == Approx(get("motor_knee_screw_left")).margin(1e-9));
    // Without roll, the links of the ankle stay parallel to the shank; with it, the outer crank goes the other way.
    const double outer = get("upper_crank1_left_hinge"), inner = get("upper_crank2_left_hinge");
    CHECK(get("lower_crank1_left_hinge") == Approx(outer).margin(1e-9));
    CHECK(get("lower_crank2_left_hinge") == Approx(inner).margin(1e-9));
    if (roll == 0) {
      CHECK(outer == Approx(get("ankley_left")).margin(1e-9));
      CHECK(inner == Approx(get("ankley_left")).margin(1e-9));
    } else {
      CHECK((outer - inner) * roll > 0.5 * roll * roll);
      CHECK((outer + inner) / 2 == Approx(get("ankley_left")).margin(0.1));
    }
  }
  KangarooParameters short_thigh;
  short_thigh.knee_screw_drop = 0.3;
  CHECK_THROWS_WITH(makeKangaroo(short_thigh), Catch::Contains("no room for the knee screw"));
}

namespace {

// Angles of the motors (time steps x motors) of a leg that falls from its neutral posture for 0.1 s, by Runge-Kutta steps.
MatrixXd simulateFall(const Model& model, double step) {
  const ConstraintSet set = makeConstraintSet(model);
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const VectorXd tau = VectorXd::Zero(model.nv());
  VectorXd q = findClosedConfiguration(model).q, v = VectorXd::Zero(model.nv());
  const auto accelerate = [&](const VectorXd& q_at, const VectorXd& v_at) {
    REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q_at, v_at, tau) == NumericalStatus::Ok);
    return VectorXd(cws.a);
  };
  const int steps = static_cast<int>(std::lround(0.1 / step));
  MatrixXd out(steps, model.nu());
  for (int i = 0; i < steps; ++i) {
    const VectorXd a1 = accelerate(q, v);
    const VectorXd v2 = v + step / 2 * a1, a2 = accelerate(model.integrate(q, step / 2 * v), v2);
    const VectorXd v3 = v + step / 2 * a2, a3 = accelerate(model.integrate(q, step / 2 * v2), v3);
    const VectorXd v4 = v + step * a3, a4 = accelerate(model.integrate(q, step * v3), v4);
    q = model.integrate(q, step / 6 * (v + 2 * v2 + 2 * v3 + v4));
    v += step / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    for (int m = 0; m < model.nu(); ++m) out(i, m) = q[model.joints()[model.motors()[m].joint].idx_q];
  }
  return out;
}

}  // namespace

TEST_CASE("spring leg: with leaf springs it moves as with rigid ones, up to 1/k") {
  const double step = 5e-5;
  const MatrixXd rigid = simulateFall(makeSpringLeg(), step);
  CHECK(rigid.bottomRows(1).cwiseAbs().maxCoeff() > 0.05);
  double last = 0;
  for (const double stiffness : {1e3, 1e4, 1e5}) {
    SpringLegParameters p;
    p.shin_stiffness = p.heel_stiffness = stiffness;
    const Model model = makeSpringLeg(p);
    CHECK(model.mass() == Approx(makeSpringLeg().mass()));
    const Mobility mobility = calcMobility(model, findClosedConfiguration(model).q);
    CHECK(mobility.rank == 5);
    CHECK(mobility.mobility == 7);
    const double error = (simulateFall(model, step) - rigid).cwiseAbs().maxCoeff();
    CAPTURE(stiffness, error);
    if (last > 0) CHECK(std::log10(last / error) == Approx(1).margin(0.1));
    last = error;
  }
}
