#pragma once
/// \file Mass matrix and derivatives of inverse dynamics in reduced coordinates, without forming those of full size.
///
/// The factors of rnea.h are linear in a change of the dofs, so that a reduced joint needs only a few columns. A
/// reduced joint further out sees a reduced coordinate as J~, dV~, dA~, dW~ of cluster_motion.h, Eq. (3), at the dof
/// that carries the path; one further in sees it, with sums over all its dofs j, as
///     (YJ)~ = sum YJ_j N_j,   (BtJ)~ = sum BtJ_j N_j,
///     G~_y = sum Gq_j N_j + Gv_j Z_j + YJ_j d_y,j,           G~_v = sum Gv_j N_j + YJ_j d_v,j                      (1)
/// Then, for a coordinate alpha and a coordinate beta further in on its path, by Eqs. (7) to (10) of rnea.h,
///     A_y(alpha, beta) = (YJ)~_alpha . dA~_beta + (BtJ)~_alpha . dV~_beta,    A_y(beta, alpha) = J~_beta . G~_y,alpha
///     A_v(alpha, beta) = (YJ)~_alpha . dW~_beta + (BtJ)~_alpha . J~_beta,     A_v(beta, alpha) = J~_beta . G~_v,alpha
///     M(alpha, beta) = J~_beta . (YJ)~_alpha                                                                       (2)
/// Within a reduced joint the same holds dof by dof, with J~, .. the path sums at dof j and G'~, (YJ)'~ the sums (1)
/// over the dofs after it, plus the rotors D and the stiffness k and
/// resistance r of joint forces, less the geometric stiffness K = d(J^T lambda)/dq of its loop forces:
///     A_y = sum_j N_j (YJ_j . dA~ + BtJ_j . dV~ + J_j . G'~_y + D_j d_y,j - (K N)_j + k_j N_j + r_j Z_j)
///     A_v = sum_j N_j (YJ_j . dW~ + BtJ_j . J~ + J_j . G'~_v + D_j d_v,j + r_j N_j)
///     M = sum_j N_j (YJ_j . J~ + J_j . (YJ)'~ + D_j N_j)                                                           (3)
/// The loop forces have no other effect: they are internal to the cluster and cancel in every sum that leaves it.
/// Springs between points add Eq. (4) of point_spring.h, with the columns J~, dV~ of their bodies.
#include "dynamics/cluster_motion.h"

namespace bielle {

/// Contribution of a cluster: its motion and K N (n x size).
template <typename T>
struct ClusterLiftOf {
  const ClusterMotionOf<T>* motion = nullptr;
  const MatrixX<T>* KN = nullptr;
};

using ClusterLift = ClusterLiftOf<double>;

template <typename T>
class ReducedTreeOf {
 public:
  /// \param tips  bodies for which getTip() returns columns
  ReducedTreeOf(const Model& model, const Reduction& reduction, const std::vector<int>& tips);

  /// M (size x size), and J of the tips; needs updateCompositeInertias and the twists of the clusters.
  void updateMassMatrix(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts,
                        typename ArgumentsOf<T>::Matrix M);
  /// J and dV of the tips; needs the velocities of the workspace and the lifts up to them.
  void updateTipVelocities(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts);
  /// A_y and A_v (size x size), and all columns of the tips; needs updateInverseDynamicsFactors and lifts up to the
  /// accelerations.
  void updateDerivatives(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts,
                         typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v);

  /// Motion of a body: column o belongs to the reduced coordinate outer[o].
  struct Columns {
    std::vector<int> outer;
    Matrix6X<T> J, dV, dA, dW;  ///< 6 x outer
  };
  const Columns& getTip(int index) const { return tips_[index].columns; }

 private:
  struct Link {
    std::vector<int> dofs;
    Columns columns;
    Matrix6X<T> YJ, BtJ, Gy, Gv;  // 6 x size, Eq. (1)
  };
  enum class Depth { Twists, Velocities, All };
  void updateColumns(const WorkspaceOf<T>& ws, const std::vector<ClusterLiftOf<T>>& lifts, const ReducedJoint& place,
                     Depth depth, Columns& out) const;
  void addMassWithin(const WorkspaceOf<T>& ws, const ClusterLiftOf<T>* lift, const ReducedJoint& place, Link& link,
                     typename ArgumentsOf<T>::Matrix M);
  void addFreeWithin(const WorkspaceOf<T>& ws, const ReducedJoint& place, Link& link,
                     typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v) const;
  void addClusterWithin(const WorkspaceOf<T>& ws, const ClusterLiftOf<T>& lift, const ReducedJoint& place, Link& link,
                        typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v);
  // A matrix with a column for each group of the largest cluster.
  void clearAfter(size_t groups);

  struct Tip {
    ReducedJoint place;
    Columns columns;
  };
  // Of a point spring. A coordinate moves one of its bodies or both: columns of its ends, -1 if it does not.
  struct SpringCoordinate {
    int index = 0;
    int column1 = -1, column2 = -1;
  };
  struct SpringEnds {
    Tip tip1, tip2;
    std::vector<SpringCoordinate> coordinates;
  };
  Tip makeColumns(int body) const;
  SpringEnds makeSpringEnds(const PointSpring& spring) const;
  void addPointSpring(const WorkspaceOf<T>& ws, const PointSpring& spring, const SpringEnds& ends,
                      typename ArgumentsOf<T>::Matrix A_y, typename ArgumentsOf<T>::Matrix A_v) const;
  Model model_;
  const Reduction& reduction_;
  std::vector<Link> links_;
  std::vector<Tip> tips_;
  std::vector<SpringEnds> springs_;
  Matrix6X<T> after_y_, after_v_;  // sums (1) over the dofs after a group
};

using ReducedTree = ReducedTreeOf<double>;

}  // namespace bielle
