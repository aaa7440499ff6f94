#pragma once
// The designs that the page of a run shows: the start, then those of the front, or the best one of every search. Each has a robot, and
// each of its motions is a result as `bielle solve` writes it, by the steps of the search.
#include <functional>
#include <string>
#include <vector>

#include "design/run.h"

namespace bielle {

struct ShownDesign {
  std::string name;       // "start", "01", "02", ...
  std::string directory;  // of its robot, from that of the run
  VectorXd x;
  Evaluation evaluation;  // made again
  std::vector<std::string>
      results;  // directory of each motion, from that of the run; empty where it was kept or failed
};

// Of a front, or of a ranking.
std::string getNumberName(size_t i);

// The robot of a design. Where its lengths do not allow the angles that a reference of the start gives, this gives those that it is
// assembled with, and the place of its base, which would pull at them.
Model makeWritten(const Parametrization& robot, const VectorXd& x);

// Several designs at a time, `jobs`. \param progress  as of DesignRunOptions
// \throws InputError when a file cannot be written
std::vector<ShownDesign> writeShownDesigns(const std::string& directory, const DesignEvaluator& evaluator,
                                           const DesignRun& run, int jobs,
                                           const std::function<void(const std::string& line)>& progress);

}  // namespace bielle
