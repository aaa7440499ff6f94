#pragma once
// What bielle/dynamics/linkage.h leaves open: memory, and functions of its equations that need it or the cluster.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "dynamics/loop_bases.h"
#include "math/decompositions.h"

namespace bielle {

inline constexpr int kMostLinkageMobility = 6;  // of transmissions and dead points

// The cluster with a metric of ones: purely geometric, as light bodies must not move far per step.
std::shared_ptr<ReducedCluster> makeUnweighted(const ReducedCluster& cluster);

// Of all clusters, with all their motors and serial joints, which may be more or fewer than their mobility; idle spins
// (reduction.h) are left aside.
std::vector<Linkage> selectLinkages(const Model& model, const Reduction& reduction);
// makeLinkage() for several linkages of one model.
Linkage makeLinkage(const Model& model, const Reduction& reduction, const std::vector<std::string>& joints);
// listLinkages() where dead points are references too: what is over them is not finite.
std::vector<Linkage> listLinkagesAnywhere(const Model& model, ConstVectorRef q_reference);

// T = N N_X^{-1} for coordinates X: the closed motions of unit speeds of these. No function allocates but the constructor.
class LinkageTangent {
 public:
  explicit LinkageTangent(const ReducedCluster& cluster);
  // From a basis N of Linkage::cluster. Returns the least singular value of N_X, the least that X move in a unit motion of
  // the linkage: 0 at a dead point of X. Where it is below `damped`, e, V diag(s / (s^2 + e^2 - s_min^2)) U^T replaces
  // N_X^{-1}; otherwise T is not finite at a dead point.
  double update(const MatrixXd& N, const std::vector<int>& dofs, double damped = 0);
  const MatrixXd& T() const { return T_; }  // n x m

 private:
  Eigen::JacobiSVD<MatrixXd> svd_;
  MatrixXd N_X_, scaled_, inverse_, T_;
};
// That least singular value alone; X may be more than m.
double calcLeastMotion(const MatrixXd& N, const std::vector<int>& dofs);

// J' times the velocity v: derivatives by the dofs (closure rows x n) of J v at fixed v. Its product with v is dJ/dt v.
// \param ws  of the cluster, with positions
void updateDrift(const ReducedCluster& cluster, Workspace& ws, ConstVectorRef v, MatrixXd& drift);

struct LinkageWorkspace {
  explicit LinkageWorkspace(const Linkage& linkage);
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostLinkageMobility, kMostLinkageMobility>;
  ClusterPoint point;
  const ClusterBasis* basis = nullptr;  // that of the point, or a given one
  VectorXd q;
  MatrixXd T, z, y, drift, O, turn, Q, Q_inverse;
  MatrixXd both, N;                // of selectMoving(): the rows N_M and O N of the whole basis, N without what is idle
  Eigen::JacobiSVD<MatrixXd> svd;  // of the former
  VectorXd derivative;
  Small N_M, inverse;
};

// The workspaces of the linkages that one thread comes across, made when they are needed first.
class LinkageWorkspaces {
 public:
  LinkageWorkspaces() = default;
  LinkageWorkspaces(const LinkageWorkspaces&) {}  // a copy makes its own
  LinkageWorkspaces& operator=(const LinkageWorkspaces&) { return *this; }
  LinkageWorkspace& get(const Linkage& linkage);

 private:
  std::vector<std::pair<std::shared_ptr<const ReducedCluster>, std::unique_ptr<LinkageWorkspace>>> all_;
};

// Eq. (2).
double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, ConstVectorRef q);
// The same at the placements of a workspace. \param bases  of that configuration, where they are known already, else null
double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, const Workspace& robot,
                        const LoopBases* bases);
// The same with its derivative by the motors (nu), which the other joints follow.
double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, ConstVectorRef q,
                        VectorRef gradient);
// Eq. (3): a row of nv, of which the entries of the linkage are written. Returns (2): 0 without a basis, infinite without a motion
// of the motors, where the entries are 0.
double calcTransmissionJacobian(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model,
                                const Workspace& robot, MatrixRef row, const LoopBases* bases);

// transmission.cpp, for dead_points.cpp
// Whether Q_0 is neither zero nor infinite.
bool hasReference(const Linkage& linkage);
// O at the positions of the workspace; no rows where the output is joints.
void updateOutput(const Linkage& linkage, const Workspace& ws, MatrixXd& O);
// A basis of closed motions less what is idle: N of linkage.h. Needs s.O; the result lives until the next call.
// \param basis  of the cluster, or of that of the robot, where nothing is left aside (n x its size)
const MatrixXd& selectMoving(const Linkage& linkage, LinkageWorkspace& s, const MatrixXd& basis);
// The drift of the closures, and that of O.
void updateDrift(const Linkage& linkage, LinkageWorkspace& s, ConstVectorRef v);

}  // namespace bielle
