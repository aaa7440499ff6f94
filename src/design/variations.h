#pragma once
/// \file Derivatives of robots made from the numbers of a parametrization, as they are or loaded.
#include <functional>

#include "bielle/design/parametrization.h"

namespace bielle {

/// calcDesignVariations() of what `make` makes of the numbers.
std::vector<ModelVariation> calcVariations(const Parametrization& robot, const VectorXd& x,
                                           const std::function<Model(const VectorXd& x)>& make);

}  // namespace bielle
