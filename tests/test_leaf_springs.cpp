// Springs that no motor moves: postures in which they balance the weight, and stages that follow them.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/modes.h"
#include "bielle/model/builder.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/walk.h"
#include "bielle/robots/robot_loader.h"
#include "motion/statics.h"

using namespace bielle;

namespace {

Model loadLeafRobot(const std::string& place) { return loadRobot(std::string(BIELLE_SOURCE_DIR) + "/" + place).model; }

// Largest acceleration that motor torques leave on these contacts, by the derivatives' own dynamics.
double calcAcceleration(const Model& model, const std::vector<ContactTarget>& contacts, const VectorXd& q,
                        const VectorXd& u) {
  const Modes modes = calcModes(model, makeConstraintSet(model, contacts), q, calcMotorForces(model, u));
  REQUIRE(modes.status == NumericalStatus::Ok);
  return modes.acceleration;
}

}  // namespace

TEST_CASE("leaf springs: beside the middle of its feet a robot rests where they balance its weight") {
  const Model model = loadLeafRobot("robots/spring_biped");
  const StandingRobot standing = makeStandingRobot(model);
  const std::vector<ContactTarget> contacts = makeContactTargets(standing, 0, 0);
  AssemblyProblem aside;
  aside.q_ref = standing.q;
  aside.q_ref[1] += 0.02;
  for (size_t c = 0; c < contacts.size(); ++c)
    aside.frames.push_back(makeFrameTarget(model.contacts()[c], contacts[c].X_WT));
  aside.frames.push_back({"trunk", 1, SE3(), {Matrix3d::Identity(), aside.q_ref.head<3>()}});
  aside.frames.back().mask << false, true, true, false, false, false;
  const AssemblyResult moved = assemble(model, aside);
  REQUIRE(moved.status == NumericalStatus::Ok);
  const VectorXd q = settlePosture(model, contacts, moved.q);
  const VectorXd change = model.difference(moved.q, q);
  CHECK(change.cwiseAbs().maxCoeff() < 0.05);
  Workspace ws(model);
  updatePositions(model, ws, q);
  for (size_t c = 0; c < contacts.size(); ++c) {
    const SE3 X = getPlacement(ws, model.contacts()[c].body, model.contacts()[c].X_BF);
    CHECK((X.p - contacts[c].X_WT.p).norm() < 1e-11);
    CHECK((X.R - contacts[c].X_WT.R).norm() < 1e-11);
  }
  const int left = model.joints()[model.findJoint("shin_spring_left")].idx_q,
            right = model.joints()[model.findJoint("shin_spring_right")].idx_q;
  CHECK(std::abs(q[left] - q[right]) > 1e-3);  // the left leg bears more
  const StaticTorques hold = calcStaticTorques(model, makeConstraintSet(model, contacts), q);
  CHECK(hold.residual < 1e-6);
  CHECK(hold.u.cwiseAbs().maxCoeff() < 100);
  CHECK(calcAcceleration(model, contacts, q, hold.u) < 1e-4);
  // As it was moved no moderate torque holds it.
  const VectorXd u = calcStaticTorques(model, makeConstraintSet(model, contacts), moved.q).u;
  CHECK((u.cwiseAbs().maxCoeff() > 100 || calcAcceleration(model, contacts, moved.q, u) > 0.1));

  const Model stiff = loadLeafRobot("robots/bipetto");
  const StandingRobot other = makeStandingRobot(stiff);
  CHECK(settlePosture(stiff, makeContactTargets(other, 0, 0), other.q) == other.q);
}

TEST_CASE("leaf springs: stages follow the fastest of their modes") {
  const Model model = loadLeafRobot("robots/spring_biped");
  const StandingRobot standing = makeStandingRobot(model);
  const std::vector<ContactTarget> contacts = makeContactTargets(standing, 0, 0);
  CHECK(calcSpringStage(model, standing.q, contacts) == 0.005);  // 34 Hz
  CHECK(makeSquat(model).problem->spec(0).dt == 0.005);
  CHECK(makeWalk(model).problem->spec(0).dt == 0.005);
  // A quarter of the stiffness: half the frequency, but for what gravity adds.
  ModelParts parts = takeParts(model);
  for (JointForce& force : parts.joint_forces) force.stiffness /= 4;
  const double soft = calcSpringStage(ModelBuilder::restore(parts), standing.q, contacts);
  CHECK(soft >= 0.009);
  CHECK(soft <= 0.013);
  for (const char* place : {"robots/bipetto", "examples/better_leg"}) {  // without springs, and with slow ones
    CAPTURE(place);
    const Model other = loadLeafRobot(place);
    CHECK(makeSquat(other).problem->spec(0).dt == 0.015);
    CHECK(makeWalk(other).problem->spec(0).dt == 0.012);
  }
}
