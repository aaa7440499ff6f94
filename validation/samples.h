#pragma once
/// \file Random closed states of a robot, and rows that compare what two programs make of them (validate.h).
#include <random>

#include "bielle/dynamics/closure.h"
#include "validate.h"

namespace bielle::validation {

struct Sample {
  VectorXd q, v, tau, a;
  std::vector<ContactTarget> contacts;
};

/// Draws the states that validate.h describes.
class SampleSource {
 public:
  SampleSource(const Model& model, const ValidationOptions& options);

  std::string failure;  ///< why there is no closed configuration, or empty

  const VectorXd& start() const { return q_ref_; }  ///< the configuration around which states are drawn (nq)
  Sample draw();

 private:
  VectorXd random(int n, double scale);

  const Model& model_;
  const ValidationOptions& options_;
  std::mt19937 rng_;
  VectorXd q_ref_;
};

/// Adds a sample to a row: of differences and tolerances of all samples the largest are kept.
/// \param floor  least scale of a difference: values that constraints cancel to zero have rounding of that size
void addDifference(ValidationReport& report, const std::string& quantity, const MatrixXd& ours, const MatrixXd& theirs,
                   double floor, double tolerance);

}  // namespace bielle::validation
