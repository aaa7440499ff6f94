#pragma once
// The four ways to discretize a problem.
#include <ostream>
#include <vector>

#include "bielle/ocp/robot_problem.h"

namespace bielle::testing {

struct Discretization {
  Formulation formulation = Formulation::Full;
  StepRule step = StepRule::Euler;
};
inline const std::vector<Discretization> kDiscretizations = {{Formulation::Full, StepRule::Euler},
                                                             {Formulation::Reduced, StepRule::Euler},
                                                             {Formulation::Full, StepRule::Midpoint},
                                                             {Formulation::Reduced, StepRule::Midpoint}};
inline std::ostream& operator<<(std::ostream& out, const Discretization& d) {
  return out << getName(d.formulation) << ", " << getName(d.step);
}

}  // namespace bielle::testing
