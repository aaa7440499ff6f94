#include "bielle/math/types.h"

namespace bielle {

const char* getName(NumericalStatus status) {
  switch (status) {
    case NumericalStatus::Ok:
      return "ok";
    case NumericalStatus::NotFinite:
      return "not finite";
    case NumericalStatus::Singular:
      return "singular";
    case NumericalStatus::Indefinite:
      return "indefinite";
    case NumericalStatus::Contradictory:
      return "contradictory";
    case NumericalStatus::NotClosed:
      return "loops do not close";
    case NumericalStatus::NearDeadPoint:
      return "near a dead point";
    case NumericalStatus::Unbalanced:
      return "unbalanced";
    case NumericalStatus::Inaccurate:
      return "inaccurate";
    case NumericalStatus::NotConverged:
      return "not converged";
    case NumericalStatus::Failed:
      return "failed";
  }
  return "?";
}

const char* getMessage(NumericalStatus status) {
  switch (status) {
    case NumericalStatus::NotFinite:
      return "values are not finite";
    case NumericalStatus::Singular:
      return "the mass matrix is singular: a joint moves no inertia; give its links mass or the joint an armature";
    case NumericalStatus::Indefinite:
      return "a matrix is not positive definite: raise the regularization";
    case NumericalStatus::Contradictory:
      return "redundant rows of closures and contacts contradict each other: close the loops, or make their "
             "stabilisations agree";
    case NumericalStatus::NotClosed:
      return "no configuration closes the loops: check lengths and limits of the linkage, or start nearer";
    case NumericalStatus::NearDeadPoint:
      return "a linkage is at a dead point, where its motors do not determine it: keep a margin from it";
    case NumericalStatus::Unbalanced:
      return "motors and contacts cannot produce this motion: add a motor or a contact";
    case NumericalStatus::Inaccurate:
      return "errors exceed their tolerances";
    default:
      return getName(status);
  }
}

}  // namespace bielle
