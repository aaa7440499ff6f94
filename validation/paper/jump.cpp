#include "paper/jump.h"

#include <cmath>
#include <numeric>

#include "bielle/dynamics/kinematics.h"

namespace bielle::paper {
namespace {

struct JumpPhase {
  std::string name;
  int nodes;
  double acceleration;  // of the centre of mass on average, less that of gravity in flight, m/s^2
  bool flies = false;
};

StageSpec makeJumpEnd(const Model& model, const JumpOptions& o, const VectorXd& q0) {
  const VectorXd selected = selectMainJoints(model);
  VectorXd weights(2 * model.nv());
  weights << selected, selected;
  weights.head<6>() << 0, 0, 100, 0, 0, 2500;  // height 10, yaw 50, squared
  return makeRegularizedStage(model, q0, o.terminal_weight, weights, 0);
}

VectorXd makeJumpWeights(const Model& model, const JumpOptions& o) {
  VectorXd weights = makeStateWeights(model);
  weights.head(model.nv()) = selectMainJoints(model);
  weights.segment<3>(3) << o.torso_weight, o.torso_weight, 0;
  return weights;
}

// At rest, but for the flight of a stone. \param t  since take-off, s
VectorXd makeJumpGuess(const Model& model, const VectorXd& q0, double take_off, double t) {
  VectorXd x(model.nq() + model.nv());
  x << q0, VectorXd::Zero(model.nv());
  const double g = model.gravity().norm();
  x[2] += take_off * t - 0.5 * g * t * t;
  x.segment<3>(model.nq()) = Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(&q0[3])).conjugate() *
                             ((take_off - g * t) * Vector3d::UnitZ());
  return x;
}

}  // namespace

Motion makeJump(const Model& model, const JumpOptions& o, const VectorXd& q0, Formulation formulation) {
  std::vector<int> all(model.contacts().size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<ContactTarget> feet = makeContactTargets(model, q0, all, o.contacts.kp, o.contacts.kd);
  Workspace ws(model);
  updatePositions(model, ws, q0);
  const Vector3d com = calcCom(model, ws);
  const int half = static_cast<int>(std::lround(o.flight / 2 / kTimeStep));
  const double g = model.gravity().norm(), flight = 2 * half * kTimeStep, take_off = 0.5 * g * flight,
               rise = g * flight * flight / 8, push = take_off / (o.nodes * kTimeStep);
  const VectorXd weights = makeJumpWeights(model, o);
  VectorXd standing = VectorXd::Zero(model.nq() + model.nv());
  standing.head(model.nq()) = q0;
  Motion motion;
  motion.name = "paper-jump";
  motion.ground.height = feet.front().X_WT.p.z();
  std::vector<StageSpec> stages;
  for (const JumpPhase& phase : {JumpPhase{"stand", o.nodes, 0},
                                 {"push", o.nodes, push},
                                 {"flight", 2 * half, 0, true},
                                 {"land", o.nodes, push},
                                 {"settle", o.nodes, 0}}) {
    const std::vector<ContactTarget> contacts = phase.flies ? std::vector<ContactTarget>{} : feet;
    addPhase(model, phase.name, phase.nodes, contacts, q0, motion);
    for (int i = 0; i < phase.nodes; ++i) {
      StageSpec stage = makeRegularizedStage(model, q0, o.state_weight, weights, o.control_weight);
      stage.constraints = makeConstraintSet(model, contacts);
      addGroundCosts(model, {o.force_weight, o.pressure_weight, ForceAxes::World},
                     VectorXd::Constant(contacts.size(), model.mass() * (g + phase.acceleration) / contacts.size()),
                     stage);
      if (phase.flies && i == half)
        stage.costs.push_back({"apex", o.apex_weight, Activation::makeQuadratic(Vector3d::UnitZ()),
                               makeComPosition(com + rise * Vector3d::UnitZ())});
      if (phase.name == "land" && i == 0)
        for (const ContactTarget& foot : feet)
          addLandingCosts(model.contacts()[foot.contact], foot.X_WT, o.touchdown,
                          " " + model.contacts()[foot.contact].name, stage);
      stages.push_back(std::move(stage));
      motion.guess.xs.push_back(phase.flies ? makeJumpGuess(model, q0, take_off, i * kTimeStep) : standing);
    }
  }
  stages.push_back(makeJumpEnd(model, o, q0));
  motion.guess.xs.push_back(standing);
  motion.goals = {{GoalKind::FlightTime, "flight", flight, calcTolerance(flight, 0), 0, motion.schedule.numStages()},
                  {GoalKind::Rise, "height", rise, calcTolerance(rise, 0.01), 0, motion.schedule.numStages()}};
  motion.options = {{"flight", flight}};
  motion.problem =
      std::make_unique<RobotProblem>(model, q0, VectorXd::Zero(model.nv()), std::move(stages), formulation);
  return motion;
}

}  // namespace bielle::paper
