#pragma once
// Residuals as data, for problems that other programs read (results/problem_file.h). docs/problems.md has their equations.
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bielle/ocp/cost.h"

namespace bielle {

struct ResidualData {
  using Value = std::variant<int, double, std::string, std::vector<int>, VectorXd, MatrixXd>;
  std::string kind;  // empty: a residual of somebody's own
  std::vector<std::pair<std::string, Value>> values;
};

// A residual of the library.
class DescribedResidual : public Residual {
 public:
  virtual ResidualData describe() const = 0;
};

ResidualData describeResidual(const Residual& residual);

// {"p" + suffix, X.p}, {"R" + suffix, X.R}
void addPlacement(const std::string& suffix, const SE3& X, ResidualData& data);

}  // namespace bielle
