#pragma once
// What searches and the search for the front of several objectives share, and the latter: runDesign() of a specification with
// `pareto`.
#include "design/run.h"

namespace bielle {

// The first line of a log. \param search  which one of the specification
std::string makeLogHeader(const DesignEvaluator& evaluator, const DesignSpec& spec, const std::string& search);

// The continuous variables of a robot whose choices are those of x.
class Continuous {
 public:
  Continuous(const Parametrization& robot, const VectorXd& x);
  VectorXd start() const { return pick(x_); }
  VectorXd pick(const VectorXd& of_all) const { return of_all(indices_); }
  SlopedValue pick(const LoggedEvaluation& evaluation) const;
  VectorXd expand(const VectorXd& of_search) const;

 private:
  VectorXd x_;
  std::vector<Eigen::Index> indices_;
};

// Counts the evaluations of all searches, finds the best and evaluates it.
void addUpSearches(const DesignEvaluator& evaluator, DesignRun& run);

// As runDesign().
DesignRun runFront(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options);

}  // namespace bielle
