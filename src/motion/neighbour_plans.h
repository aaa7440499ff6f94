#pragma once
// Plans of one motion for robots a little beside one another, whose problems are evaluated but not solved: differences need many of
// them. Their guesses stay rough, since nobody starts from them, and what the first of them has found far from mattering is not
// computed again: how far legs reach, where the path of the centre of mass stays within that by a margin. Standing postures are
// found from the first of them, and exact up to rounding.
#include <optional>
#include <vector>

#include "bielle/motion/motion.h"

namespace bielle {

class NeighbourPlans {
 public:
  NeighbourPlans() = default;
  NeighbourPlans(const NeighbourPlans&) = delete;
  NeighbourPlans& operator=(const NeighbourPlans&) = delete;

  // The next of the robots, for one plan: those made of it are the plans here, and must not outlive this. Steps are planned in
  // the same order in each.
  StandingRobot stand(const Model& model);
  StandingRobot begin(const Model& model, const VectorXd& q);

  // Whether legs reach everything of the next steps of a plan by a margin, for whom it is known.
  std::optional<bool>& getReach();

  VectorXd posture;  // standing, of the first robot; empty before

 private:
  std::vector<std::optional<bool>> reach_;
  size_t next_ = 0;
};

// \param neighbours  null, or it begins from the posture of the first of them
VectorXd makeStandingPosture(const Model& model, NeighbourPlans* neighbours);

}  // namespace bielle
