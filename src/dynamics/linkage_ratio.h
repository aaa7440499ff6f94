#pragma once
// The ratio of ratio.h at a point of the linkage's cluster.
#include "bielle/dynamics/ratio.h"
#include "dynamics/linkage_workspace.h"

namespace bielle {

/// Eqs. (1) to (3) at a point of the cluster. False at a dead point of the joints, where R is not finite.
bool calcLinkageRatio(const Linkage& linkage, ClusterPoint& point, LinkageRatio& out);

/// Velocities and accelerations of all dofs of the cluster (n) for those of its joints (m each): v = T v_J and, by Eq.
/// (2), a = T a_J + a(v_J). False at a dead point of the joints.
bool calcLinkageMotion(const Linkage& linkage, ClusterPoint& point, ConstVectorRef v_J, ConstVectorRef a_J, VectorXd& v,
                       VectorXd& a);

/// Tangent T = N N_J^{-1} (n x m) of unit joint speeds. False at a dead point of the joints.
/// \param margin  smallest singular value of N_J: the least motion of the joints in a unit motion of the cluster
bool calcLinkageTangent(const Linkage& linkage, const ClusterPoint& point, MatrixXd& T, double* margin = nullptr);

}  // namespace bielle
