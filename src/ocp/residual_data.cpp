#include "ocp/residual_data.h"

namespace bielle {

ResidualData describeResidual(const Residual& residual) {
  const auto* described = dynamic_cast<const DescribedResidual*>(&residual);
  return described ? described->describe() : ResidualData();
}

void addPlacement(const std::string& suffix, const SE3& X, ResidualData& data) {
  data.values.emplace_back("p" + suffix, VectorXd(X.p));
  data.values.emplace_back("R" + suffix, MatrixXd(X.R));
}

}  // namespace bielle
