#pragma once
// What `bielle solve` prints of a motion.
#include <string>
#include <vector>

#include "bielle/motion/motion.h"
#include "bielle/motion/serial_model.h"
#include "bielle/results/result.h"

namespace bielle::cli {

// Everything that the serial model omits.
void printSerialModel(const SerialModel& serial);

// How long it will take; with free durations, at most. (A campaign reads it: tasks/campaign_command.cpp.)
void printPlan(const Motion& motion);

// \param paths  of the files that have it
void printResult(const Model& model, const MotionResult& result, const std::vector<std::string>& paths);

// Printed last, to be noticed: the solver may converge and the check pass although goals are missed, or linkages end just
// before their dead points.
void warnOfGoalsAndDeadPoints(const MotionResult& result);

}  // namespace bielle::cli
