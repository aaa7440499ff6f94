#include "bielle/design/cost_gradient.h"

#include <cmath>

#include "bielle/model/error.h"
#include "design/motion_envelope.h"
#include "motion/neighbour_plans.h"

namespace bielle {

VectorXd calcCostGradient(const Parametrization& robot, const VectorXd& x, const Solution& optimum,
                          const std::function<Motion(const Model&, const StandingRobot&)>& make) {
  const MotionEnvelope envelope(optimum);
  VectorXd gradient = VectorXd::Zero(x.size());
  NeighbourPlans plans;
  const auto plan = [&](const Model& model) { return make(model, plans.stand(model)); };
  for (Eigen::Index i : robot.listContinuous()) {
    const double step = kDesignStep * (robot.upper()[i] - robot.lower()[i]);
    const VectorXd dx = step * VectorXd::Unit(x.size(), i);
    const Model ahead = robot.make(x + dx), behind = robot.make(x - dx);
    gradient[i] = envelope.calcDerivative(plan(ahead), plan(behind), step);
    if (!std::isfinite(gradient[i]))
      throw InputError(robot.startModel().name(), "variable '" + robot.variables()[static_cast<size_t>(i)].name + "'",
                       "no gradient: the motion cannot be transferred to neighbouring robots",
                       "move x away from the limit at which the mechanism no longer closes");
  }
  return gradient;
}

}  // namespace bielle
