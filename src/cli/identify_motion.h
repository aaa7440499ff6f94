#pragma once
// The motion whose torques show most, as files that `bielle simulate` carries out.
#include "cli/identify_torques.h"
#include "identify/excitation.h"

namespace bielle::cli {

// DIRECTORY/motion.csv: time, positions, v.NAME and u.MOTOR of all rows, which is a log itself; start.json and torques.yaml for
// `bielle simulate`. \returns an exit status   \param q  nq, closed, where it begins   \throws InputError
int findMotion(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
               const std::vector<LoadNumber>& numbers, double duration, double window, int iterations,
               const std::string& robot, const std::string& directory);

}  // namespace bielle::cli
