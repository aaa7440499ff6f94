#pragma once
/// \file The goals of a plan, measured on what became of it.
#include "bielle/motion/record.h"
#include "worlds/plan.h"

namespace bielle::worlds {

/// On the trajectory of the plan.
std::vector<GoalOutcome> measurePlannedGoals(const Plan& plan);

/// On a record that begins with the plan, at the same times: its nodes are the rows of the record. Of a foothold, where the foot
/// stands half way to its next step, since feet land earlier or later than planned; under predictive control, which places feet
/// anew, within the room that it has. A goal that ends after the record is not achieved (NaN).
/// \param goals  of the controller
std::vector<GoalOutcome> measureCarriedGoals(const Plan& plan, const std::vector<Goal>& goals,
                                             const MotionRecord& record);

/// A sentence for each goal for which the two differ by more than 5 % of the plan's (of footholds, and where 0 is requested, by more
/// than the tolerance).
std::vector<std::string> listDifferences(const std::vector<GoalOutcome>& planned,
                                         const std::vector<GoalOutcome>& carried);

}  // namespace bielle::worlds
