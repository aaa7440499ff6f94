#include "design/optimum_gradient.h"

#include <cmath>
#include <stdexcept>

#include "bielle/design/cost_gradient.h"
#include "bielle/model/error.h"

namespace bielle {
namespace {

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

// Torques, then speeds.
VectorXd readMotors(const Motion& motion, const std::vector<double>& dt, const ShootingTrajectory& trajectory) {
  const MotorTrace trace = makeMotorTrace(motion.problem->model(), dt, trajectory);
  VectorXd out(2 * trace.torque.size());
  out << trace.torque.reshaped(), trace.speed.reshaped();
  return out;
}

// The derivatives by variable i, from motions at `step` on either side; false if there are none.
bool addSlopes(const MotionOutcome& outcome, const MotionEnvelope& envelope, const Motion& ahead, const Motion& behind,
               double step, Eigen::Index i, MotorSlopes& slopes) {
  const double dcost = envelope.calcDerivative(ahead, behind, step);
  const auto dmotors = differentiateOptimum(*outcome.motion, outcome.multipliers, ahead, behind, step,
                                            [&](const Motion& motion, const ShootingTrajectory& trajectory) {
                                              return readMotors(motion, slopes.dt, trajectory);
                                            });
  if (!std::isfinite(dcost) || !dmotors) return false;
  const Eigen::Index nu = slopes.u.rows(), N = slopes.u.cols();
  slopes.dcost[i] = dcost;
  slopes.du[static_cast<size_t>(i)] = dmotors->value.head(nu * N).reshaped(nu, N);
  slopes.dv[static_cast<size_t>(i)] = dmotors->value.tail(nu * N).reshaped(nu, N);
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
    for (Eigen::Index i : robot.listContinuous()) {
      const double h = kDesignStep * (robot.upper()[i] - robot.lower()[i]);
      const VectorXd dx = h * VectorXd::Unit(x.size(), i);
      const Model to = robot.make(x + dx), from = robot.make(x - dx);
      const VectorXd posture_to = makeStandingPosture(to), posture_from = makeStandingPosture(from);
      for (size_t m = 0; m < motions.size(); ++m) {
        const Motion ahead = makeDesignMotion(to, motions[m], posture_to);
        const Motion behind = makeDesignMotion(from, motions[m], posture_from);
        if (addSlopes(outcomes[m], *envelopes[m], ahead, behind, h, i, out[m])) continue;
        out.back().failure = "no gradient along " + robot.variables()[static_cast<size_t>(i)].name + ": " +
                             motions[m].name + " cannot be followed";
        return out;
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
