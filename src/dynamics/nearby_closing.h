#pragma once
/// \file Closing of clusters (reduction.h) after steps so short that Newton's matrix is nearly that of the start.
///
/// Where no row of J is redundant, its rows stay in their order, which saves the search for pivots: N is another basis of the same
/// space than that of closeCluster(), the same at a configuration however it is reached.
#include "dynamics/reduction.h"

namespace bielle {

/// updateClusterState()
template <typename T>
typename LogicOf<T>::Mask updateNearbyCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                              typename ArgumentsOf<T>::ConstVector q, ClusterStateOf<T>& out);

/// closeCluster(), which begins with the factors of J(q_0) W^{-1} J(q_0)^T that `start` holds and makes Newton's matrix anew only
/// where these do not lower the gap by 20 times. Saves that matrix and its factors at steps of a world; results differ by rounding.
template <typename T>
typename LogicOf<T>::Mask closeNearbyCluster(const ReducedCluster& cluster, ClusterScratchOf<T>& scratch,
                                             const ClusterBasisOf<T>& start, typename ArgumentsOf<T>::ConstVector d,
                                             const VectorX<T>& zeta_guess, ClusterStateOf<T>& out);

}  // namespace bielle
