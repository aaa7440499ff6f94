#include "loops/problem.h"

#include <algorithm>
#include <charconv>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"

namespace bielle::loops {
namespace {

struct Entry {
  const char* name;
  Problem (*make)();
};

constexpr int kMostFourbars = 2000;

const Entry kProblems[] = {
    {"fourbars_2", [] { return makeFourbars(2); }},
    {"squeezer", makeSqueezer},
    {"bricard", makeBricard},
    {"slider_crank", makeSliderCrank},
    {"spatial_fourbar", makeSpatialFourbar},
    {"governor", [] { return makeGovernor(); }},
};

}  // namespace

void setEnergy(Problem& problem) {
  const Model model = problem.model;
  Workspace ws(model);
  problem.invariant = "energy";
  problem.calcInvariant = [model, forces = calcMotorForces(model, problem.torques), ws](const VectorXd& q,
                                                                                        const VectorXd& v) mutable {
    updatePositions(model, ws, q);
    updateVelocities<double>(model, ws, v);
    double energy = calcKineticEnergy(model, ws) + calcPotentialEnergy(model, ws);
    for (const Motor& motor : model.motors()) energy -= forces[motor.dof] * q[model.joints()[motor.joint].idx_q];
    return energy;
  };
  problem.invariant_scale = 0;
  for (const double time : problem.times) {
    const Motion motion = problem.calcMotion(time);
    updatePositions(model, ws, motion.q);
    updateVelocities<double>(model, ws, motion.v);
    problem.invariant_scale = std::max(problem.invariant_scale, calcKineticEnergy(model, ws));
  }
}

void setMotion(Problem& problem, const OneFreedom& motion, double s0, double speed) {
  const Posture posture = motion.calcPosture(s0);
  problem.start = {posture.q, speed * posture.q_slope};
  problem.calcMotion = [motion](double t) -> Motion {
    const OneFreedom::State state = motion.calcState(t);
    const Posture there = motion.calcPosture(state.s);
    return {there.q, state.rate * there.q_slope};
  };
}

std::vector<std::string> listProblems() {
  std::vector<std::string> names;
  for (const Entry& entry : kProblems) names.push_back(entry.name);
  return names;
}

Problem makeProblem(const std::string& name) {
  std::string known;
  for (const Entry& entry : kProblems) {
    if (entry.name == name) return entry.make();
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  const std::string fourbars = "fourbars_";
  int count = 0;
  const char* end = name.data() + name.size();
  if (name.rfind(fourbars, 0) == 0)
    if (const auto read = std::from_chars(name.data() + fourbars.size(), end, count);
        read.ec == std::errc() && read.ptr == end && count >= 1 && count <= kMostFourbars)
      return makeFourbars(count);
  throw InputError("", "problem '" + name + "'", "there is no such problem",
                   "choose one of: " + known + ", fourbars_N with N up to " + std::to_string(kMostFourbars));
}

}  // namespace bielle::loops
