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

// A term of the objective in words.
std::string describeMeasure(Measure measure, const std::vector<std::string>& motors);
std::string describeTerm(const ObjectiveTerm& term);

// `design`: values over evaluations. `design_front`: where several objectives are kept apart, the first over each of the
// others. `design_MOTION`: torques and speeds over time, of the start and of the best design.
std::vector<DesignFigure> makeDesignFigures(const DesignEvaluator& evaluator, const DesignRun& run);

}  // namespace bielle
