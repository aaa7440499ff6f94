#pragma once
// Idle spins of a loop cluster: reduction.h.
#include <vector>

#include "dynamics/reduction.h"

namespace bielle {

inline constexpr int kMostSpinDofs = 8;  // of joints with a part in one: a free body and a slide, say

// Bodies among those carried by the joints that carry other joints, or soles.
std::vector<int> listCarriers(const Model& model, const std::vector<int>& joints);

// Those found at a closed configuration of the cluster (nq) and beside it, by Eq. (3) of reduction.h.
std::vector<IdleSpin> findIdleSpins(const Model& model, const ReducedCluster& cluster, ConstVectorRef q_cluster);

// The number of those of all clusters. \param q  nq, closed
int countIdleSpins(const Model& model, ConstVectorRef q);

// Leaves aside those that do not move the joints (of the whole model).
void holdSpins(const Model& model, const std::vector<int>& joints, ReducedCluster& cluster);

}  // namespace bielle
