#include "motion/cycle.h"

#include <cmath>

#include "math/constants.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr int kSteps = 2, kUnderWay = 2;  // of a cycle; that begin within the last one at most and end after it

// A stance phase, which begins with a landing, is cut in its middle.
struct Cut {
  size_t phase = 0;
  int node = 0;    // the first of the phase
  int before = 0;  // nodes of it before the cut, at least one
};

Cut findCut(const Gait& gait, int steps_done) {
  Cut cut;
  while (gait.phases[cut.phase].steps_done < steps_done) cut.node += gait.phases[cut.phase++].nodes;
  cut.before = (gait.phases[cut.phase].nodes + 1) / 2;
  return cut;
}

// Over the ground, from one placement to another.
SE3 calcDisplacement(const SE3& from, const SE3& to) {
  SE3 X = to * from.inverse();
  X.R = makeAxisRotation(Vector3d::UnitZ(), calcHeading(X));
  X.p = to.p - X.R * from.p;
  X.p.z() = 0;
  return X;
}

SE3 calcMiddle(const std::array<SE3, 2>& feet) { return bielle::calcMiddle(feet[0], feet[1]); }

void move(const SE3& X, FootstepPlan& plan) {
  for (SE3& foot : plan.start) foot = X * foot;
  for (Footstep& step : plan.steps) step.X_WF = X * step.X_WF;
}

void move(const SE3& X, GaitNode& node) {
  node.com = X.act(node.com);
  node.com_velocity = X.R * node.com_velocity;
  node.heading = std::remainder(node.heading + calcHeading(X), 2 * kPi);
  for (SwingNode& swing : node.swings) {
    swing.X_WF = X * swing.X_WF;
    swing.V_F << X.R * swing.V_F.head<3>(), X.R * swing.V_F.tail<3>();
  }
}

}  // namespace

SE3 cutCycle(const SE3& middle, LocomotionTask& task, Gait& gait) {
  const int lead = task.lead, steps = kSteps * task.cycles;
  const Cut from = findCut(gait, lead), to = findCut(gait, lead + steps);
  const int begin = from.node + from.before, end = to.node + to.before;

  Gait cycle;
  cycle.phases.assign(gait.phases.begin() + static_cast<long>(from.phase),
                      gait.phases.begin() + static_cast<long>(to.phase) + 1);
  cycle.phases.front().nodes -= from.before;
  cycle.phases.back().nodes = to.before;
  const bool is_short = cycle.phases.front().nodes == 0;
  if (is_short) cycle.phases.erase(cycle.phases.begin());
  for (GaitPhase& phase : cycle.phases) {
    phase.steps_done -= lead;
    for (int& step : phase.steps)
      if (step >= 0) step -= lead;
  }
  cycle.nodes.assign(gait.nodes.begin() + begin, gait.nodes.begin() + end + 1);
  const int first = static_cast<int>(from.phase) + (is_short ? 1 : 0), last = static_cast<int>(cycle.phases.size()) - 1;
  for (GaitNode& node : cycle.nodes) {
    node.phase = std::min(node.phase - first, last);
    if (node.landed >= 0) node.landed -= lead;
  }
  cycle.nodes.back().landed = -1;
  const auto keep = [lead, steps](const auto& all) {
    return std::decay_t<decltype(all)>(all.begin() + lead, all.begin() + lead + steps + kUnderWay);
  };
  cycle.swings = keep(gait.swings);
  for (SwingSpan& span : cycle.swings) span = {span.begin - begin, span.end - begin};

  task.plan = {task.plan.getStance(lead), keep(task.plan.steps)};
  const SE3 X = calcDisplacement(calcMiddle(task.plan.start), middle);
  move(X, task.plan);
  for (GaitNode& node : cycle.nodes) move(X, node);
  gait = std::move(cycle);
  return calcDisplacement(calcMiddle(task.plan.start), calcMiddle(task.plan.getStance(steps)));
}

}  // namespace bielle
