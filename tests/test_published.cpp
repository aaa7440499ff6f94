// Models published by others, in the format of our robots. They are not part of the project: if they are not available,
// the tests are skipped and say so. validation/ compares them with Simbody.
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "formats/adopt.h"
#include "measure_steps.h"
#include "published_robots.h"
#include "robot_directory.h"
#include "robots/spring_leg.h"
#include "solve_in_place.h"

using namespace bielle;
using namespace bielle::testing;
namespace fs = std::filesystem;

namespace {

const std::string kSource = BIELLE_SOURCE_DIR;

// A robot here that completes a published one.
LoadedRobot loadCompleted(const std::string& name) { return loadRobot(kSource + "/robots/" + name); }

FddpSummary solvePublished(Motion& motion) {
  FddpOptions solver;
  solver.max_iterations = 60;
  return test::solveInPlace(*motion.problem, motion.guess, solver);
}

void checkSteps(Motion& motion) {
  const FddpSummary summary = solvePublished(motion);
  CAPTURE(motion.name, summary.message, summary.iterations);
  CHECK(summary.termination == FddpTermination::Converged);
  const StepMeasures m = StepMeter(motion, motion.guess).measure();
  checkFeet(m);
  CHECK(m.tilt < 0.05);
  CHECK(m.torque < 80);
  CHECK(m.velocity_jump < 5);
  CHECK(m.final_speed < 0.02);
}

}  // namespace

TEST_CASE("published models load and close, with the rank and mobility that they have") {
  struct Expected {
    int rows, rank, mobility;  // on a fixed base
  };
  // 5bar_linkage: five hinges and the welded pin, 6 joints; a planar loop holds 3. robot_delta: 14 hinges, planar too,
  // three loops. The bipeds: no rod is held twice.
  const std::map<std::string, Expected> published = {{"5bar_linkage", {6, 3, 3}},
                                                     {"robot_delta", {18, 9, 5}},
                                                     {"digit_like_2legs", {36, 36, 12}},
                                                     {"battobot_6d", {36, 36, 12}}};
  for (const auto& [name, expected] : published) {
    const std::string directory = findPublished(name);
    if (directory.empty()) continue;
    CAPTURE(name);
    LoadOptions options;
    options.base = BaseKind::Fixed;
    const Model model = loadRobot(directory, options).model;
    const AssemblyResult closed = findClosedConfiguration(model);
    CHECK(closed.status == NumericalStatus::Ok);
    CHECK(closed.gap < 1e-10);
    const Mobility mobility = calcMobility(model, closed.q);
    CHECK(mobility.rows == expected.rows);
    CHECK(mobility.rank == expected.rank);
    CHECK(mobility.mobility == expected.mobility);
  }
}

TEST_CASE("the spring leg has the lengths, angles and masses of Digit's published leg") {
  if (findPublished("digit_like_2legs").empty()) return;
  LoadOptions options;
  options.base = BaseKind::Fixed;
  const Model digit = loadRobot(findPublished("digit_like_2legs"), options).model;
  Workspace ws(digit);
  updatePositions(digit, ws, digit.makeNeutral());
  const auto find = [&](const std::string& name) {
    const int joint = digit.findJoint(name), index = digit.findFrame(name);
    REQUIRE((joint >= 0 || index >= 0));
    if (joint >= 0) return ws.X_WB[joint];
    return getPlacement(ws, digit.frames()[index].body, digit.frames()[index].X_BF);
  };
  // The plane of the right leg is square to the axis of hip pitch.
  const int pitch = digit.findJoint("motor_hip_y");
  const Vector3d axis = ws.X_WB[pitch].R * digit.joints()[pitch].axis;
  const auto span = [&](const std::string& from, const std::string& to) { return Vector3d(find(to).p - find(from).p); };
  const auto flatten = [&](const Vector3d& a) { return Vector3d(a - axis * axis.dot(a)); };
  const auto turn = [&](const Vector3d& a, const Vector3d& b) {  // from a to b
    return std::atan2(axis.dot(flatten(b).cross(flatten(a))), flatten(a).dot(flatten(b)));
  };
  const SpringLegParameters p;
  const Vector3d tarsus = span("free_knee", "free_foot1"), heel = span("free_knee", "spherical_free_knee"),
                 crank_place = span("free_knee", "motor_shin1");
  const double to_figures = 6e-5;  // four digits
  CHECK(span("motor_hip_y", "motor_knee").norm() == Approx(p.thigh_length).margin(to_figures));
  CHECK(flatten(span("motor_knee", "free_knee")).norm() == Approx(p.shin_length).margin(to_figures));
  CHECK(flatten(tarsus).norm() == Approx(p.tarsus_length).margin(to_figures));
  CHECK(heel.norm() == Approx(p.heel_length).margin(to_figures));
  CHECK(turn(-heel, tarsus) == Approx(p.heel_bend).margin(5e-4));
  CHECK(flatten(span("motor_hip_y", "spherical_free_hip")).norm() < 1e-6);  // the heel rod starts on the pitch axis
  CHECK(axis.dot(span("motor_hip_y", "spherical_free_hip") - span("motor_knee", "free_knee")) ==
        Approx(p.rod_offset).margin(to_figures));
  CHECK(span("spherical_free_hip", "closedloop1_A").norm() + span("spherical_free_knee", "closedloop1_B").norm() ==
        Approx(p.heel_rod_length).margin(to_figures));
  CHECK(flatten(crank_place).norm() == Approx(p.crank_place).margin(to_figures));
  CHECK(turn(crank_place, tarsus) == Approx(p.crank_bend).margin(5e-4));
  CHECK(flatten(span("motor_shin1", "spherical_free_shin2")).norm() == Approx(p.crank_length).margin(to_figures));
  CHECK(span("spherical_free_shin2", "closedloop2_A").norm() + span("spherical_free_foot2", "closedloop2_B").norm() ==
        Approx(p.plantar_length).margin(to_figures));
  // In the frame of the foot: z up, x forward.
  const SE3 foot = find("foot");
  const Vector3d toe = foot.R.transpose() * (find("free_foot1").p - foot.p),
                 lever = foot.R.transpose() * span("free_foot1", "spherical_free_foot1");
  CHECK(toe.z() == Approx(p.ankle_height).margin(to_figures));
  CHECK(-toe.x() == Approx(p.sole_offset).margin(to_figures));
  CHECK(std::hypot(lever.x(), lever.z()) == Approx(p.lever_length).margin(to_figures));
  CHECK(std::atan2(lever.x(), -lever.z()) == Approx(p.lever_angle).margin(5e-4));
  const Vector3d yaw = find("motor_hip_z").p - find("motor_hip_x").p, drop = span("motor_hip_z", "motor_hip_y");
  CHECK(-yaw.x() == Approx(p.yaw_offset).margin(to_figures));
  CHECK(-yaw.z() == Approx(p.yaw_drop).margin(to_figures));
  CHECK(-drop.z() == Approx(p.pitch_drop).margin(to_figures));

  const auto mass = [&](const std::string& joint) { return digit.bodies()[digit.findJoint(joint)].inertia.mass; };
  CHECK(mass("motor_hip_x") == Approx(p.hip_roll_mass).epsilon(0.002));
  CHECK(mass("motor_hip_z") == Approx(p.hip_yaw_mass).epsilon(0.002));
  CHECK(mass("motor_hip_y") == Approx(p.thigh_mass).epsilon(0.002));
  CHECK(mass("motor_knee") == Approx(p.shin_mass).epsilon(0.002));
  CHECK(mass("free_knee") == Approx(p.tarsus_mass).epsilon(0.002));
  CHECK(mass("free_foot1") + mass("free_foot2") == Approx(p.foot_mass).epsilon(0.002));
  CHECK(mass("spherical_free_hip") + mass("spherical_free_knee") == Approx(p.heel_rod_mass).epsilon(0.002));
  CHECK(mass("motor_shin1") + mass("motor_shin2") == Approx(p.crank_mass).epsilon(0.01));
  CHECK(mass("spherical_free_shin1") + mass("spherical_free_shin2") + mass("spherical_free_foot1") +
            mass("spherical_free_foot2") ==
        Approx(p.plantar_mass).epsilon(0.01));
}

TEST_CASE("Digit squats, walks and climbs stairs with the feet and the posture that come along") {
  if (findPublished("digit_like_2legs").empty()) return;
  const LoadedRobot robot = loadCompleted("digit");
  const Model& model = robot.model;
  CHECK(robot.warnings.size() == 1);  // its meshes are elsewhere
  CHECK(robot.file.substr(robot.file.size() - 10) == "digit.yaml");
  CHECK(model.nu() == 12);
  CHECK(model.armature().sum() == Approx(12e-3));

  SquatOptions squat;
  squat.depth = 0.6;
  Motion down = makeSquat(model, squat);
  const FddpSummary summary = solvePublished(down);
  CHECK(summary.termination == FddpTermination::Converged);
  Workspace ws(model);
  double start = 0, lowest = 1e9;
  for (const VectorXd& x : down.guess.xs) {
    updatePositions(model, ws, x.head(model.nq()));
    if (start == 0) start = calcCom(model, ws).z();
    lowest = std::min(lowest, calcCom(model, ws).z());
    CHECK(calcLargestGap(ws, makeConstraintSet(model)) < 1e-10);
    for (const ContactFrame& foot : model.contacts())
      CHECK(std::abs(getPlacement(ws, foot.body, foot.X_BF).p.z()) < 1e-3);
  }
  CHECK(lowest == Approx(0.6 * start).margin(3e-3));

  for (double speed : {0.5, 0.8}) {
    WalkOptions options;
    options.speed = speed;
    Motion walk = makeWalk(model, options);
    checkSteps(walk);
  }
  StairsOptions stairs;
  stairs.stairs = 3;
  Motion climb = makeStairs(model, stairs);
  checkSteps(climb);
}

TEST_CASE("the published model of Bipetto, completed, squats as Bipetto does") {
  if (findPublished("battobot_6d").empty()) return;
  const LoadedRobot published = loadCompleted("battobot");
  const Model ours = loadRobot(kSource + "/robots/bipetto").model;
  SquatOptions options;
  options.depth = 0.8;
  LimitOptions none;  // the published ranges do not hold the posture
  none.enforced = false;
  Motion a = makeSquat(published.model, options, {Formulation::Reduced, none}), b = makeSquat(ours, options);
  const FddpSummary of_published = solvePublished(a), of_ours = solvePublished(b);
  CHECK(of_published.termination == FddpTermination::Converged);
  CHECK(of_published.cost == Approx(of_ours.cost).epsilon(1e-4));
  // The bodies are listed in another order: compare by name.
  for (const std::string joint : {"knee_left", "ankley_right", "motor_ankle1_left"}) {
    const int i = published.model.joints()[published.model.findJoint(joint)].idx_q,
              j = ours.joints()[ours.findJoint(joint)].idx_q;
    for (size_t k = 0; k < a.guess.xs.size(); ++k) CHECK(std::abs(a.guess.xs[k][i] - b.guess.xs[k][j]) < 1e-3);
  }
}

TEST_CASE("Digit's published model, adopted, squats") {
  if (findPublished("digit_like_2legs").empty()) return;
  const fs::path published = fs::absolute(findPublished("digit_like_2legs") + "/robot.urdf").lexically_normal();
  const Adoption adoption = adoptRobot(loadRobot(published.string()), published.string());
  const RobotDirectory directory;
  const Model model = loadRobot(directory.write("mine/mine.yaml", adoption.yaml)).model;
  REQUIRE(model.contacts().size() == 2);
  SquatOptions options;
  options.depth = 0.8;
  Motion squat = makeSquat(model, options);
  const FddpSummary summary = solvePublished(squat);
  CAPTURE(adoption.yaml, summary.message);
  CHECK(summary.termination == FddpTermination::Converged);
}
