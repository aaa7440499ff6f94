#pragma once
// The problem that a solved motion is the optimum of, as data for other programs: docs/problems.md has the format.
#include <string>

#include "bielle/results/result.h"
#include "results/json_text.h"

namespace bielle {

struct ProblemText {
  std::string json, npz;
};

// The mechanism: bodies, joints, closures, motors, forces, contacts. \param q  nq, closed: where the metric of loops is taken
Json describeMechanism(const Model& model, ConstVectorRef q);

// \param robot_files  names of the robot's files, for the text alone: for programs that read URDF and MJCF
// \throws InputError when the result is no optimum of a problem that its summary tells, or the problem has a residual that is
// no part of the library
ProblemText formatProblem(const Model& model, const MotionSummary& summary, const MotionRecord& record,
                          const Json& robot_files);

}  // namespace bielle
