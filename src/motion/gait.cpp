#include "motion/gait.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Quintic from 0 to 1 with no velocity and no acceleration at its ends.
double ease(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

int countNodes(double duration, double h) { return static_cast<int>(std::lround(duration / h)); }

void check(const GaitTiming& t, size_t steps) {
  const double h = t.time_step;
  requireOption(h > 0 && h <= 0.1, "time_step", "it is outside 0 .. 0.1 s", "give seconds");
  requireStages(t.start + steps * (t.single + t.both) + t.end, h);
  for (const auto& [name, value] : {std::pair("start_support", t.start), std::pair("single_support", t.single),
                                    std::pair("double_support", t.both), std::pair("end_support", t.end)})
    requireOption(value < 60 && countNodes(value, h) >= 1, name, "it is not at least a time step, or over a minute",
                  "give seconds");
  requireOption(countNodes(t.single, h) >= 4, "single_support", "it is shorter than four time steps", "give seconds");
}

std::vector<GaitPhase> makePhases(int steps, const GaitTiming& t) {
  const double h = t.time_step;
  std::vector<GaitPhase> phases{{countNodes(t.start, h), 0, false}};
  for (int i = 0; i < steps; ++i) {
    phases.push_back({countNodes(t.single, h), i, true});
    phases.push_back({countNodes(i + 1 < steps ? t.both : t.end, h), i + 1, false});
  }
  return phases;
}

// Share of the weight on the left foot at the end of a phase: all on the next stance foot, half at rest.
double calcLoadAfter(const FootstepPlan& plan, const GaitPhase& phase) {
  const int next = phase.steps_done;
  if (next == static_cast<int>(plan.steps.size())) return 0.5;
  return plan.steps[next].side == Side::Left ? 0 : 1;
}

// Solves Eq. (1) for each column of p (N + 1 rows), whose first and last rows are c_0 and c_N (Thomas' algorithm).
void solvePendulum(double ratio, Eigen::Ref<Eigen::Matrix2Xd> p) {
  const int last = static_cast<int>(p.cols()) - 1;
  VectorXd upper = VectorXd::Zero(last + 1);
  for (int k = 1; k < last; ++k) {
    const double pivot = 1 + 2 * ratio - ratio * upper[k - 1];
    upper[k] = ratio / pivot;
    p.col(k) = ((p.col(k) + ratio * p.col(k - 1)) / pivot).eval();
  }
  for (int k = last - 1; k > 0; --k) p.col(k) += upper[k] * p.col(k + 1);
}

void fillFeet(const FootstepPlan& plan, const SwingShape& shape, double h, Gait& gait) {
  const double start = calcHeading(calcMiddle(plan.start[0], plan.start[1]));
  double load = 0.5;
  size_t k = 0;
  for (size_t p = 0; p < gait.phases.size(); ++p) {
    const GaitPhase& phase = gait.phases[p];
    const auto stance = plan.getStance(phase.steps_done);
    const double after = phase.swings ? load : calcLoadAfter(plan, phase);
    for (int i = 0; i < phase.nodes; ++i, ++k) {
      GaitNode& node = gait.nodes[k];
      node.phase = static_cast<int>(p);
      const double share = (i + 1.0) / (phase.nodes + 1.0);
      node.load[0] = load + share * (after - load);
      node.load[1] = 1 - node.load[0];
      node.lands = i == 0 && !phase.swings && p > 0;
      std::array<SE3, 2> feet = stance;
      if (phase.swings) {
        const Footstep& step = plan.steps[phase.steps_done];
        node.progress = static_cast<double>(i) / phase.nodes;
        node.X_WF = calcSwing(shape, stance[static_cast<int>(step.side)], step.X_WF, node.progress);
        // The velocity at the end of an Euler step is that of the step.
        const SE3 before = calcSwing(shape, stance[static_cast<int>(step.side)], step.X_WF,
                                     std::max(0.0, node.progress - 1.0 / phase.nodes));
        node.V_F << node.X_WF.p - before.p, log3(node.X_WF.R * before.R.transpose());
        node.V_F /= h;
        feet[static_cast<int>(step.side)] = node.X_WF;
      }
      node.heading = std::remainder(calcHeading(calcMiddle(feet[0], feet[1])) - start, 2 * kPi);
    }
    load = after;
  }
  GaitNode& last = gait.nodes.back();
  last = gait.nodes[k - 1];
  last.lands = false;
}

// Height of the lower foot at touchdown, linear in time during swings, smoothed over +- window nodes.
VectorXd calcHeights(const FootstepPlan& plan, const Gait& gait, int window) {
  const auto getLower = [&plan](int steps_done) {
    const auto stance = plan.getStance(steps_done);
    return std::min(stance[0].p.z(), stance[1].p.z());
  };
  const int size = static_cast<int>(gait.nodes.size());
  VectorXd raw(size), z = VectorXd::Zero(size);
  for (int k = 0; k < size; ++k) {
    const GaitPhase& phase = gait.phases[gait.nodes[k].phase];
    raw[k] = getLower(phase.steps_done);
    if (phase.swings) raw[k] += gait.nodes[k].progress * (getLower(phase.steps_done + 1) - raw[k]);
  }
  for (int k = 0; k < size; ++k)
    for (int i = -window; i <= window; ++i)
      z[k] += (1 - std::abs(i) / (window + 1.0)) / (window + 1.0) * raw[std::clamp(k + i, 0, size - 1)];
  return z;
}

}  // namespace

SE3 calcSwing(const SwingShape& shape, const SE3& a, const SE3& b, double s) {
  const double t = ease((s - shape.leave) / (shape.arrive - shape.leave));
  const double top = std::max(a.p.z(), b.p.z()) + shape.height;
  SE3 X;
  X.p = a.p + t * (b.p - a.p);
  X.p.z() = s < shape.apex ? a.p.z() + (top - a.p.z()) * ease(s / shape.apex)
                           : b.p.z() + (top - b.p.z()) * ease((1 - s) / (1 - shape.apex));
  X.R = a.R * exp3(t * log3(a.R.transpose() * b.R));
  return X;
}

Gait makeGait(const FootstepPlan& plan, const GaitTiming& timing, const SwingShape& shape, const Vector3d& com,
              double gravity) {
  check(timing, plan.steps.size());
  Gait gait;
  gait.phases = makePhases(static_cast<int>(plan.steps.size()), timing);
  int stages = 0;
  for (const GaitPhase& phase : gait.phases) stages += phase.nodes;
  gait.nodes.resize(stages + 1);
  fillFeet(plan, shape, timing.time_step, gait);

  const auto end = plan.getStance(static_cast<int>(plan.steps.size()));
  const SE3 P0 = calcMiddle(plan.start[0], plan.start[1]), PN = calcMiddle(end[0], end[1]);
  const Vector3d rest = PN.act(P0.inverseTimes(SE3{Matrix3d::Identity(), com}).p);
  // The zero-moment point starts and ends under the resting centre of mass.
  Eigen::Matrix2Xd p(2, stages + 1);
  for (int k = 0; k <= stages; ++k) {
    const GaitNode& node = gait.nodes[k];
    const auto stance = plan.getStance(gait.phases[node.phase].steps_done);
    const double share = 1 - 2 * std::abs(node.load[0] - 0.5);  // 1 at rest, 0 on one foot
    p.col(k) = (node.load[0] * stance[0].p + node.load[1] * stance[1].p).head<2>();
    if (node.phase == 0) p.col(k) += share * (com - P0.p).head<2>();
    if (node.phase + 1 == static_cast<int>(gait.phases.size())) p.col(k) += share * (rest - PN.p).head<2>();
  }
  p.col(0) = com.head<2>();
  p.col(stages) = rest.head<2>();
  const double h = timing.time_step, height = com.z() - P0.p.z();
  solvePendulum(height / (gravity * h * h), p);

  const VectorXd z = calcHeights(plan, gait, countNodes(timing.stepDuration() / 4, h));
  for (int k = 0; k <= stages; ++k) gait.nodes[k].com << p.col(k), height + z[k];
  for (int k = 0; k < stages; ++k) {
    gait.nodes[k].com_velocity = (gait.nodes[k + 1].com - gait.nodes[k].com) / h;
    gait.nodes[k].heading_rate = std::remainder(gait.nodes[k + 1].heading - gait.nodes[k].heading, 2 * kPi) / h;
  }
  return gait;
}

std::vector<int> listLandings(const ContactSchedule& schedule) {
  std::vector<int> landings;
  size_t standing = schedule.phases.front().contacts.size();
  int node = 0;
  for (const ContactPhase& phase : schedule.phases) {
    if (phase.dt > 0 && phase.contacts.size() > standing) landings.push_back(node);
    if (phase.dt > 0) standing = phase.contacts.size();
    node += phase.nodes;
  }
  return landings;
}

}  // namespace bielle
