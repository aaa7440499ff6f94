#include "design/robot_ratios.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/error.h"

namespace bielle {
namespace {

// Cubic with both derivatives: samples are as far apart as the steps of the sweep.
double interpolate(const RatioSample& a, const RatioSample& b, double angle) {
  const double w = b.joints[0] - a.joints[0], t = (angle - a.joints[0]) / w;
  const double p = a.ratio.R(0, 0), m = w * a.ratio.dR[0](0, 0), r = b.ratio.R(0, 0), n = w * b.ratio.dR[0](0, 0);
  return (2 * t * t * t - 3 * t * t + 1) * p + (t * t * t - 2 * t * t + t) * m + (3 * t * t - 2 * t * t * t) * r +
         (t * t * t - t * t) * n;
}

// Linear, which is enough for a way.
double interpolateMotor(const RatioSample& a, const RatioSample& b, double angle) {
  return a.motors[0] + (b.motors[0] - a.motors[0]) * (angle - a.joints[0]) / (b.joints[0] - a.joints[0]);
}

// Where the joint turns round and round, the turns before and after it too.
std::vector<RatioSample> repeatTurns(const RatioSweep& sweep) {
  const std::vector<RatioSample>& once = sweep.samples;
  // The last sample is short of the first one, by less than a step.
  const auto round_turns = [](double angle) { return 2 * M_PI * std::round(angle / (2 * M_PI)); };
  const double turn = round_turns(once.back().joints[0] - once.front().joints[0]),
               motor = round_turns(once.back().motors[0] - once.front().motors[0]);
  if (!sweep.full_turn || turn == 0) return once;
  std::vector<RatioSample> out;
  for (const int k : {-1, 0, 1})
    for (const RatioSample& sample : once) {
      out.push_back(sample);
      out.back().joints[0] += k * turn, out.back().motors[0] += k * motor;
    }
  return out;
}

}  // namespace

JointRatios calcJointRatios(const Model& model, const std::string& joint, const VectorXd& angles) {
  const AssemblyResult start = findClosedConfiguration(model);
  if (start.status != NumericalStatus::Ok)
    throw InputError(model.name(), "loops", "they do not close", "correct the lengths, or the posture");
  const Linkage linkage = makeLinkage(model, start.q, {joint});
  if (linkage.size() != 1)
    throw InputError(model.name(), "joint '" + joint + "'", "its linkage has several motors",
                     "name a joint whose linkage has one motor");
  const std::vector<RatioSample> samples = repeatTurns(sweepRatio(model, linkage, start.q));
  JointRatios out{VectorXd::Constant(angles.size(), -1), std::numeric_limits<double>::infinity()};
  const double ends[] = {angles.minCoeff(), angles.maxCoeff()};
  double motors[] = {NAN, NAN};
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    const RatioSample &a = samples[i], &b = samples[i + 1];
    if (a.branch != 0 || b.branch != 0 || a.dead != DeadPointKind::None || b.dead != DeadPointKind::None) continue;
    const auto is_between = [&](double angle) { return (angle - a.joints[0]) * (angle - b.joints[0]) <= 0; };
    for (Eigen::Index k = 0; k < angles.size(); ++k)
      if (is_between(angles[k])) out.ratios[k] = std::abs(interpolate(a, b, angles[k]));
    for (int end = 0; end < 2; ++end)
      if (is_between(ends[end])) motors[end] = interpolateMotor(a, b, ends[end]);
  }
  for (const RatioSample& dead : samples) {
    if (dead.dead == DeadPointKind::None && !dead.loses_rank) continue;
    if (dead.joints[0] > ends[0] && dead.joints[0] < ends[1] && dead.branch == 0) out.ratios.setConstant(-1);
    for (int end = 0; end < 2; ++end)
      out.distance = std::min(out.distance,
                              std::max(std::abs(dead.joints[0] - ends[end]), std::abs(dead.motors[0] - motors[end])));
  }
  if (out.ratios.minCoeff() < 0)
    throw InputError(model.name(), "joint '" + joint + "'",
                     "its linkage does not reach the whole range without a dead point",
                     "`bielle ratio` shows how far it goes; narrow the range");
  return out;
}

LinkageFamily makeRobotLinkages(const Parametrization& robot, const std::string& joint, const VectorXd& angles,
                                double distance) {
  const auto calc_ratios = [robot, joint, angles, distance](const VectorXd& x, VectorXd& ratios, double& margin) {
    try {
      const JointRatios found = calcJointRatios(robot.make(x), joint, angles);
      ratios = found.ratios, margin = found.distance;
    } catch (const InputError&) {  // of what these numbers do not make
      return false;
    }
    return margin >= distance && ratios.minCoeff() > 0;
  };
  return {robot.lower(), robot.upper(), calc_ratios};
}

}  // namespace bielle
