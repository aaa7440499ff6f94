#include "motion/neighbour_plans.h"

namespace bielle {

StandingRobot NeighbourPlans::stand(const Model& model) { return begin(model, makeStandingPosture(model, this)); }

StandingRobot NeighbourPlans::begin(const Model& model, const VectorXd& q) {
  next_ = 0;
  return makeStandingRobot(model, q, this);
}

std::optional<bool>& NeighbourPlans::getReach() {
  if (next_ == reach_.size()) reach_.emplace_back();
  return reach_[next_++];
}

}  // namespace bielle
