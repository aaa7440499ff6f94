#include "dynamics/linkage_ratio.h"

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

constexpr double kSingular = 1e-12;  // singular values of N_J, whose rows are at most of unit length

// a of Eq. (2) at the velocity v = T w of the cluster (n).
VectorXd calcDriftAcceleration(const Linkage& linkage, ClusterPoint& point, const MatrixXd& T, const VectorXd& v) {
  const ReducedCluster& cluster = *linkage.cluster;
  MatrixXd drift(cluster.numRows(), v.size()), gamma(cluster.rank, 1);
  updateDrift(cluster, point.workspace(), v, drift);
  point.selectIndependent(drift * v, gamma);
  point.solveGram(gamma);
  const VectorXd a = -(point.basis().J.transpose() * gamma);  // metric of ones
  return a - T * a(linkage.joint_dofs);
}

}  // namespace

VectorXd carryLinkage(const Model& model, const Linkage& linkage, const RatioSample& sample, ConstVectorRef q) {
  VectorXd whole = q;
  if (!linkage.isDirect()) scatterConfiguration(model, *linkage.cluster, sample.q, whole);
  return whole;
}

bool calcLinkageTangent(const Linkage& linkage, const ClusterPoint& point, MatrixXd& T, double* margin) {
  LinkageTangent tangent(*linkage.cluster);
  const double least = tangent.update(point.basis().N, linkage.joint_dofs);
  if (margin) *margin = least;
  if (!(least > kSingular)) return false;
  T = tangent.T();
  return true;
}

bool calcLinkageRatio(const Linkage& linkage, ClusterPoint& point, LinkageRatio& out) {
  const int m = linkage.size();
  out.R = MatrixXd::Identity(m, m);
  out.dR.assign(m, MatrixXd::Zero(m, m));
  out.condition = 1;
  if (linkage.isDirect()) return true;
  MatrixXd T;
  if (!calcLinkageTangent(linkage, point, T)) return false;
  out.R = T(linkage.motor_dofs, Eigen::all);  // Eq. (1)
  const Eigen::JacobiSVD<MatrixXd> svd(out.R);
  out.condition = svd.singularValues()[0] / svd.singularValues()[m - 1];

  const auto calcMotorAcceleration = [&](const VectorXd& w) {
    return VectorXd(calcDriftAcceleration(linkage, point, T, T * w)(linkage.motor_dofs));
  };
  std::vector<VectorXd> alone;
  for (int j = 0; j < m; ++j) alone.push_back(calcMotorAcceleration(VectorXd::Unit(m, j)));
  for (int j = 0; j < m; ++j)
    for (int k = 0; k <= j; ++k) {  // Eq. (3), symmetric in j and k
      const VectorXd mixed = calcMotorAcceleration(VectorXd::Unit(m, j) + VectorXd::Unit(m, k));
      out.dR[k].col(j) = (mixed - alone[j] - alone[k]) / 2;
      out.dR[j].col(k) = out.dR[k].col(j);
    }
  return out.R.allFinite();
}

bool calcLinkageMotion(const Linkage& linkage, ClusterPoint& point, ConstVectorRef v_J, ConstVectorRef a_J, VectorXd& v,
                       VectorXd& a) {
  MatrixXd T;
  if (!calcLinkageTangent(linkage, point, T)) return false;
  v = T * v_J;
  a = T * a_J + calcDriftAcceleration(linkage, point, T, v);
  return true;
}

double calcBalanceError(const Model& model, const Linkage& linkage, ConstVectorRef q, const MatrixXd& R) {
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const ConstraintSet loops = makeConstraintSet(model);
  const VectorXd rest = VectorXd::Zero(model.nv());
  updatePositions(model, ws, q);
  updateVelocities(model, ws, rest);
  updateBias(model, ws);
  const VectorXd gravity = ws.b;
  const auto calcAcceleration = [&](const VectorXd& tau) {
    const bool ok = updateConstrainedDynamics(model, ws, cws, loops, q, rest, gravity + tau) == NumericalStatus::Ok;
    return ok ? cws.a : VectorXd::Constant(model.nv(), std::numeric_limits<double>::infinity());
  };
  double error = 0;
  for (int i = 0; i < linkage.size(); ++i) {
    VectorXd motor = rest, joints = rest;
    motor[model.motors()[linkage.motors[i]].dof] = 1;
    double alone = calcAcceleration(motor).norm();
    for (int j = 0; j < linkage.size(); ++j) {
      VectorXd joint = rest;
      joint[model.joints()[linkage.joints[j]].idx_v] = 1;
      joints -= R(i, j) * joint;
      alone = std::max(alone, std::max(1.0, std::abs(R(i, j))) * calcAcceleration(joint).norm());
    }
    // A motor on its own joint balances itself: nothing to compare.
    if (alone > 0) error = std::max(error, calcAcceleration(motor + joints).norm() / alone);
  }
  return error;
}

}  // namespace bielle
