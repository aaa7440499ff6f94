#include "motion/neighbour_plans.h"

namespace bielle {
namespace {

thread_local NeighbourPlans* in_use = nullptr;

}  // namespace

NeighbourPlans::Use::Use(NeighbourPlans& plans) : before_(in_use) {
  in_use = &plans;
  plans.next_ = 0;
}

NeighbourPlans::Use::~Use() { in_use = before_; }

NeighbourPlans* NeighbourPlans::get() { return in_use; }

std::optional<bool>& NeighbourPlans::getReach() {
  if (next_ == reach_.size()) reach_.emplace_back();
  return reach_[next_++];
}

}  // namespace bielle
