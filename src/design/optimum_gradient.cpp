#include "design/optimum_gradient.h"

#include <cmath>
#include <stdexcept>

#include "bielle/design/cost_gradient.h"
#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr int kSweeps = 3;  // leave an error of some per mille of the change of torques

MotorSlopes makeSlopes(const MotionOutcome& outcome, Eigen::Index variables) {
  const MotorTrace& trace = outcome.measures.trace;
  MotorSlopes out;
  out.dt = trace.dt, out.u = trace.torque, out.v = trace.speed;
  out.du.assign(static_cast<size_t>(variables), MatrixXd::Zero(out.u.rows(), out.u.cols()));
  out.dv = out.du;
  out.cost = outcome.measures.cost;
  out.dcost.setZero(variables);
  return out;
}

// Adds one side of a difference along variable i.
bool addSide(const MotionOutcome& outcome, const MotionEnvelope& envelope, const Motion& changed, Eigen::Index i,
             double weight, MotorSlopes& slopes) {
  const double cost = envelope.calcLagrangian(changed);
  const auto optimum = followOptimum(*outcome.motion, outcome.multipliers, changed, kSweeps);
  if (!std::isfinite(cost) || !optimum) return false;
  const MotorTrace trace = makeMotorTrace(changed.problem->model(), slopes.dt, *optimum);
  slopes.dcost[i] += weight * cost;
  slopes.du[static_cast<size_t>(i)] += weight * trace.torque;
  slopes.dv[static_cast<size_t>(i)] += weight * trace.speed;
  return true;
}

}  // namespace

std::vector<MotorSlopes> calcOptimumSlopes(const Parametrization& robot, const VectorXd& x,
                                           const std::vector<DesignMotion>& motions,
                                           const std::vector<MotionOutcome>& outcomes) {
  std::vector<MotorSlopes> out;
  std::vector<std::unique_ptr<MotionEnvelope>> envelopes;
  try {
    for (const MotionOutcome& outcome : outcomes) {
      out.push_back(makeSlopes(outcome, x.size()));
      envelopes.push_back(std::make_unique<MotionEnvelope>(*outcome.motion, outcome.multipliers));
    }
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const double h = kDesignStep * (robot.upper()[i] - robot.lower()[i]);
      for (const double side : {1.0, -1.0}) {
        const Model model = robot.make(x + side * h * VectorXd::Unit(x.size(), i));
        const VectorXd posture = makeStandingPosture(model);
        for (size_t m = 0; m < motions.size(); ++m) {
          const Motion changed = makeDesignMotion(model, motions[m], posture);
          if (addSide(outcomes[m], *envelopes[m], changed, i, side / (2 * h), out[m])) continue;
          out.back().failure = "no gradient along " + robot.variables()[static_cast<size_t>(i)].name + ": " +
                               motions[m].name + " cannot be followed";
          return out;
        }
      }
    }
  } catch (const std::invalid_argument& error) {  // an optimum that is none to second order, a plan with other stages
    out.back().failure = std::string("no gradient: ") + error.what();
  } catch (const ModelError& error) {
    out.back().failure = std::string("no gradient: ") + error.what();
  }
  return out;
}

}  // namespace bielle
