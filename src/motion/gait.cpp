#include "motion/gait.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "motion/quintic.h"

namespace bielle {
namespace {

// Quintic from 0 to 1 with no velocity and no acceleration at its ends.
double ease(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

void check(const GaitTiming& t, size_t steps) {
  const double h = t.time_step;
  requireOption(h > 0 && h <= 0.1, "time_step", "it is outside 0 .. 0.1 s", "give seconds, e.g. 0.02");
  for (const auto& [name, value] : {std::pair("start_support", t.start), std::pair("single_support", t.single),
                                    std::pair("double_support", t.both), std::pair("end_support", t.end)})
    requireOption(value < 60 && countNodes(value, h) >= 1, name,
                  "it is shorter than a time step, or longer than a minute",
                  "give seconds, e.g. " + formatNumber(std::max(0.1, 4 * h)));
  requireStages(t.start + steps * t.stepDuration() + t.end, h);
  requireOption(t.flight == 0 || (countNodes(t.flight, h) >= 2 && t.flight <= 1), "flight",
                "it is outside two time steps .. 1 s", "give seconds, e.g. 0.1");
  requireOption(countNodes(t.single, h) >= 4, "single_support", "it is shorter than four time steps",
                "give seconds, e.g. 0.4");
}

// The next step of a foot, from step i on.
int findStep(const FootstepPlan& plan, Side side, int i) {
  const int size = static_cast<int>(plan.steps.size());
  while (i < size && plan.steps[i].side != side) ++i;
  return i < size ? i : -1;
}

std::vector<GaitPhase> makePhases(const LocomotionTask& task, const GaitTiming& t) {
  const FootstepPlan& plan = task.plan;
  const int steps = static_cast<int>(plan.steps.size());
  const double h = t.time_step;
  std::vector<GaitPhase> phases{{countNodes(t.start, h), 0, {-1, -1}}};
  Side support = task.support;
  for (int i = 0; i < steps; ++i) {
    const bool last = i + 1 == steps;
    if (t.flight == 0) support = getOther(plan.steps[i].side);
    std::array<int, 2> in_air{findStep(plan, Side::Left, i), findStep(plan, Side::Right, i)};
    const std::array<int, 2> in_flight = in_air;
    in_air[static_cast<int>(support)] = -1;
    phases.push_back({countNodes(t.single, h), i, in_air});
    if (t.flight > 0 && !last)
      phases.push_back({countNodes(t.flight, h), i, in_flight});
    else
      phases.push_back({countNodes(last ? t.end : t.both, h), i + 1, {-1, -1}});
    support = plan.steps[i].side;
  }
  return phases;
}

std::vector<SwingSpan> listSwings(const std::vector<GaitPhase>& phases, size_t steps) {
  std::vector<SwingSpan> swings(steps, {-1, -1});
  int node = 0;
  for (const GaitPhase& phase : phases) {
    for (int step : phase.steps) {
      if (step < 0) continue;
      if (swings[step].begin < 0) swings[step].begin = node;
      swings[step].end = node + phase.nodes;
    }
    node += phase.nodes;
  }
  return swings;
}

// Share of the left foot in the load: all on a single foot, half at rest.
double calcShare(const GaitPhase& phase) {
  if (phase.isDoubleSupport()) return 0.5;
  return phase.stands(Side::Left) ? 1 : 0;
}

// Solves Eq. (1) for each row of p (N + 1 columns), whose first and last columns are c_0 and c_N (Thomas' algorithm).
// \param ratio  z_k / (g h^2)
void solvePendulum(const VectorXd& ratio, const VectorXd& load, Eigen::Ref<Eigen::Matrix2Xd> p) {
  const int last = static_cast<int>(p.cols()) - 1;
  VectorXd upper = VectorXd::Zero(last + 1);
  for (int k = 1; k < last; ++k) {
    const double pivot = load[k] + 2 * ratio[k] - ratio[k] * upper[k - 1];
    upper[k] = ratio[k] / pivot;
    p.col(k) = ((load[k] * p.col(k) + ratio[k] * p.col(k - 1)) / pivot).eval();
  }
  for (int k = last - 1; k > 0; --k) p.col(k) += upper[k] * p.col(k + 1);
}

// A foot in the air k nodes after it left the ground, of n.
SwingNode makeSwingNode(const SwingShape& shape, const SE3& from, const SE3& to, int k, int n, double h) {
  SwingNode node;
  node.progress = static_cast<double>(k) / n;
  node.X_WF = calcSwing(shape, from, to, node.progress);
  // Of the step that ends here: that of an Euler step; a midpoint step's is half a step older.
  const SE3 before = calcSwing(shape, from, to, std::max(0.0, node.progress - 1.0 / n));
  node.V_F << node.X_WF.p - before.p, log3(node.X_WF.R * before.R.transpose());
  node.V_F /= h;
  return node;
}

void fillFeet(const FootstepPlan& plan, const SwingShape& shape, double h, Gait& gait) {
  const double start = calcHeading(calcMiddle(plan.start[0], plan.start[1]));
  const int size = static_cast<int>(gait.phases.size());
  int k = 0;
  for (int p = 0; p < size; ++p) {
    const GaitPhase& phase = gait.phases[p];
    const double before = calcShare(gait.phases[phase.isDoubleSupport() ? std::max(0, p - 1) : p]),
                 after = calcShare(gait.phases[phase.isDoubleSupport() ? std::min(p + 1, size - 1) : p]);
    for (int i = 0; i < phase.nodes; ++i, ++k) {
      GaitNode& node = gait.nodes[k];
      node.phase = p;
      const double share = (i + 1.0) / (phase.nodes + 1.0);
      node.load[0] = before + share * (after - before);
      node.load[1] = 1 - node.load[0];
      if (i == 0 && p > 0 && phase.steps_done > gait.phases[p - 1].steps_done) node.landed = phase.steps_done - 1;
      std::array<SE3, 2> feet = plan.getStance(phase.steps_done);
      for (int foot = 0; foot < 2; ++foot) {
        if (phase.steps[foot] < 0) continue;
        const SwingSpan& span = gait.swings[phase.steps[foot]];
        node.swings[foot] = makeSwingNode(shape, feet[foot], plan.steps[phase.steps[foot]].X_WF, k - span.begin,
                                          span.end - span.begin, h);
        feet[foot] = node.swings[foot].X_WF;
      }
      node.heading = std::remainder(calcHeading(calcMiddle(feet[0], feet[1])) - start, 2 * kPi);
    }
  }
  GaitNode& last = gait.nodes.back();
  last = gait.nodes[k - 1];
  last.landed = -1;
}

// Height over that of the pendulum at every node, and the load during the step from it over the weight: Eqs. (2), (3).
struct Bounce {
  VectorXd rise, load;
};
Bounce calcBounce(const Gait& gait, double h, double stretch, double gravity) {
  const int size = static_cast<int>(gait.nodes.size());
  Bounce bounce{VectorXd::Zero(size), VectorXd::Ones(size)};
  int k = 0;
  for (size_t p = 0; p < gait.phases.size(); k += gait.phases[p].nodes, ++p) {
    const GaitPhase& phase = gait.phases[p];
    if (phase.isDoubleSupport()) continue;
    const auto getSpeed = [&](const GaitPhase& flight) { return gravity * flight.nodes * h / 2; };
    PolynomialEnd begin, end;
    if (phase.flies()) {
      begin = {stretch, getSpeed(phase), -gravity};
      end = {stretch, -getSpeed(phase), -gravity};
    } else {
      if (p > 0 && gait.phases[p - 1].flies()) begin = {stretch, -getSpeed(gait.phases[p - 1]), -gravity};
      if (p + 1 < gait.phases.size() && gait.phases[p + 1].flies())
        end = {stretch, getSpeed(gait.phases[p + 1]), -gravity};
    }
    const Quintic height(begin, end, phase.nodes * h);
    for (int i = 0; i < phase.nodes; ++i) {
      bounce.rise[k + i] = height.calc(i * h);
      bounce.load[k + i] = phase.flies() ? 0 : 1 + height.calcAcceleration((i + 0.5) * h) / gravity;
    }
  }
  return bounce;
}

// Height of the lower foot at touchdown, linear in time during swings, smoothed over +- window nodes.
VectorXd calcHeights(const FootstepPlan& plan, const Gait& gait, int window) {
  const auto getLower = [&plan](int steps_done) {
    const auto stance = plan.getStance(steps_done);
    return std::min(stance[0].p.z(), stance[1].p.z());
  };
  const int size = static_cast<int>(gait.nodes.size());
  VectorXd raw(size);
  for (int k = 0; k < size; ++k) {
    const GaitPhase& phase = gait.phases[gait.nodes[k].phase];
    raw[k] = getLower(phase.steps_done);
    for (int foot = 0; foot < 2; ++foot)
      if (phase.steps[foot] == phase.steps_done)
        raw[k] += gait.nodes[k].swings[foot].progress * (getLower(phase.steps_done + 1) - raw[k]);
  }
  return smoothen(raw, window);
}

}  // namespace

VectorXd smoothen(const VectorXd& raw, int window) {
  const int size = static_cast<int>(raw.size());
  VectorXd z = VectorXd::Zero(size);
  for (int k = 0; k < size; ++k)
    for (int i = -window; i <= window; ++i)
      z[k] += (1 - std::abs(i) / (window + 1.0)) / (window + 1.0) * raw[std::clamp(k + i, 0, size - 1)];
  return z;
}

int countNodes(double duration, double time_step) { return static_cast<int>(std::lround(duration / time_step)); }

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

double chooseTimeStep(const LocomotionTask& task, const GaitTiming& timing, const SwingShape& shape, double longest) {
  constexpr double kWalking = 0.012, kRunning = 0.005, kShortest = 0.002, kUnit = 0.001, kSpeed = 4.1;
  const double usual = timing.flight > 0 ? kRunning : kWalking;
  constexpr int kPoints = 100;
  double fastest = 0;
  for (size_t i = 0; i < task.plan.steps.size(); ++i) {
    const Footstep& step = task.plan.steps[i];
    const SE3 from = task.plan.getStance(static_cast<int>(i))[static_cast<int>(step.side)];
    SE3 before = from;
    for (int k = 1; k <= kPoints; ++k) {
      const SE3 X = calcSwing(shape, from, step.X_WF, static_cast<double>(k) / kPoints);
      fastest = std::max(fastest, (X.p - before.p).norm() * kPoints / (timing.single + 2 * timing.flight));
      before = X;
    }
  }
  if (!(fastest > kSpeed)) return std::min(usual, longest);
  return std::min(longest, std::max(kShortest, kUnit * std::floor(usual * std::pow(kSpeed / fastest, 2) / kUnit)));
}

Gait makeGait(const LocomotionTask& task, const GaitTiming& timing, const SwingShape& shape, double stretch,
              const Vector3d& com, double gravity) {
  check(timing, task.plan.steps.size());
  return makeGait(task, makePhases(task, timing), timing, shape, stretch, {com, com}, gravity);
}

Gait makeGait(const LocomotionTask& task, std::vector<GaitPhase> phases, const GaitTiming& timing,
              const SwingShape& shape, double stretch, const GaitStart& start, double gravity) {
  const FootstepPlan& plan = task.plan;
  Gait gait;
  gait.phases = std::move(phases);
  gait.swings = listSwings(gait.phases, plan.steps.size());
  int stages = 0;
  for (const GaitPhase& phase : gait.phases) stages += phase.nodes;
  gait.nodes.resize(stages + 1);
  const double h = timing.time_step;
  fillFeet(plan, shape, h, gait);
  const Bounce bounce = calcBounce(gait, h, stretch, gravity);

  const auto end = plan.getStance(static_cast<int>(plan.steps.size()));
  const SE3 P0 = calcMiddle(plan.start[0], plan.start[1]), PN = calcMiddle(end[0], end[1]);
  const Vector3d rest = PN.act(P0.inverseTimes(SE3{Matrix3d::Identity(), start.rest}).p);
  // The zero-moment point starts and ends under the resting centre of mass.
  Eigen::Matrix2Xd p(2, stages + 1);
  for (int k = 0; k <= stages; ++k) {
    GaitNode& node = gait.nodes[k];
    const auto stance = plan.getStance(gait.phases[node.phase].steps_done);
    const double share = 1 - 2 * std::abs(node.load[0] - 0.5);  // 1 at rest, 0 on one foot
    p.col(k) = (node.load[0] * stance[0].p + node.load[1] * stance[1].p).head<2>();
    if (node.phase == 0) {
      p.col(k) += share * (start.rest - P0.p).head<2>();
    } else if (gait.phases[node.phase].steps_done == static_cast<int>(plan.steps.size())) {
      p.col(k) += share * (rest - PN.p).head<2>();
    }
    for (double& load : node.load) load *= bounce.load[k];
  }
  p.col(0) = start.com.head<2>();
  p.col(stages) = rest.head<2>();
  const double left = plan.start[0].p.z(), right = plan.start[1].p.z();
  const double height = start.rest.z() - (std::abs(left - right) < kLevelSoles ? P0.p.z() : std::min(left, right));
  solvePendulum((bounce.rise.array() + height) / (gravity * h * h), bounce.load, p);

  const VectorXd z = calcHeights(plan, gait, countNodes(timing.stepDuration() / 4, h));
  for (int k = 0; k <= stages; ++k) gait.nodes[k].com << p.col(k), height + z[k] + bounce.rise[k];
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
