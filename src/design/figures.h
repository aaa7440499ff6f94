#pragma once
// The figures of a design run.
#include <string>
#include <vector>

#include "design/run.h"
#include "results/plot.h"

namespace bielle {

struct DesignFigure {
  std::string name;  // of the file, without extension
  std::vector<Plot> plots;
};

// A measure of the objective or of a constraint in words, with the motors or joints that it names.
std::string describeTerm(const ObjectiveTerm& term);
std::string describeConstraint(const DesignConstraint& constraint);

// `design`: values over evaluations. `design_front`: where several objectives are kept apart, the first over each of the
// others. `design_MOTION`: torques and speeds over time, of the start and of the best design.
std::vector<DesignFigure> makeDesignFigures(const DesignEvaluator& evaluator, const DesignRun& run);

}  // namespace bielle
