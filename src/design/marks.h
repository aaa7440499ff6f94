#pragma once
// What has to stand beside the value of a design: variables at their bounds and constraints that are violated.
#include <optional>
#include <string>
#include <vector>

#include "design/evaluation.h"

namespace bielle {

// "lower" or "upper" where a value is nearer to a bound than a thousandth of the way between them, so that the bound may be what
// decided; else empty, as for choices.
std::string findBound(double lower, double upper, double value);
std::string findBound(const DesignVariable& variable, double value);

// Whether a design changes with variable i: parameters of parts that it does not have change nothing.
bool changesDesign(const Parametrization& robot, const VectorXd& x, size_t i);

// "heat 1.31 > 1" of a violated constraint, else empty.
std::string describeViolation(const DesignConstraint& constraint, double value);

// "gear at its upper bound", "heat 1.31 > 1". \param constraints  Evaluation::constraints
std::vector<std::string> listMarks(const DesignEvaluator& evaluator, const VectorXd& x,
                                   const std::vector<double>& constraints);

// In one line to be appended to a value: "; margin 0.31; gear at its upper bound"; empty if there is nothing to say.
std::string formatMarks(const std::optional<double>& margin, const std::vector<std::string>& marks);

}  // namespace bielle
