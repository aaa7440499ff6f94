#pragma once
// The search for the front of several objectives, logged and resumable: runDesign() of a specification with `pareto`.
#include "design/run.h"

namespace bielle {

// The first line of a log. \param search  which one of the specification
std::string makeLogHeader(const DesignEvaluator& evaluator, const DesignSpec& spec, const std::string& search);

// Counts the evaluations of all searches, finds the best and evaluates it.
void addUpSearches(const DesignEvaluator& evaluator, DesignRun& run);

// As runDesign().
DesignRun runFront(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options);

}  // namespace bielle
