#pragma once
/// \file Closing of clusters (reduction.h) after steps so short that Newton's matrix is nearly that of the start.
#include "dynamics/reduction.h"

namespace bielle {

/// closeCluster(), which begins with the factors of J(q_0) W^{-1} J(q_0)^T that `start` holds and makes Newton's matrix anew only
/// where these do not lower the gap by 20 times. Saves that matrix and its factors at steps of a world; results differ by rounding.
template <typename T>
typename LogicOf<T>::Mask closeNearbyCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                             const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                             const VectorX<T>& zeta_guess, ClusterStateOf<T>& out);

}  // namespace bielle
