#include "worlds/rod_forces.h"

#include <algorithm>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/reduction.h"
#include "math/decompositions.h"

namespace bielle::worlds {

RodForces::RodForces(const Model& model, const std::vector<RodFriction>& frictions)
    : model_(model),
      bearings_(makeRodBearings(model, frictions)),
      own_(model),
      sizes_(VectorXd::Zero(static_cast<Eigen::Index>(bearings_.size()))) {}

double RodForces::add(const Workspace& ws, VectorXd& tau) const {
  double power = 0;
  for (size_t b = 0; b < bearings_.size(); ++b)
    for (const RodBearing::Pivot& pivot : bearings_[b].pivots) {
      Vector3d w = Vector3d::Zero();
      for (const auto& [dof, sign] : pivot) w += sign * ws.v[dof] * ws.J.col(dof).tail<3>();
      const Vector3d torque = calcRodTorque<double>(bearings_[b].law, sizes_[static_cast<Eigen::Index>(b)], w).torque;
      for (const auto& [dof, sign] : pivot) tau[dof] += sign * ws.J.col(dof).tail<3>().dot(torque);
      power += torque.dot(w);
    }
  return power;
}

double RodForces::update(const Workspace& ws, ConstVectorRef a, const VectorXd& tau) {
  const VectorXd held = calcInverseDynamics(model_, own_, ws.q, ws.v, a) - tau;  // J^T lambda
  const VectorXd before = sizes_;
  for (const LoopCluster& cluster : model_.clusters()) {
    const auto holds = [&](const RodBearing& bearing) {
      return std::find(cluster.closures.begin(), cluster.closures.end(), bearing.closure) != cluster.closures.end();
    };
    if (std::none_of(bearings_.begin(), bearings_.end(), holds)) continue;
    MatrixXd J = MatrixXd::Zero(cluster.rows, model_.nv());
    std::vector<int> offsets;
    int row = 0;
    for (const int c : cluster.closures) {
      const Closure& closure = model_.closures()[c];
      calcClosureJacobian<double>(own_, closure, J.middleRows(row, getRows(closure.kind)));
      offsets.push_back(row);
      row += getRows(closure.kind);
    }
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
    factors.setThreshold(kRankTolerance);
    const MatrixXd transposed = J(Eigen::all, cluster.dofs).transpose();  // decompositions.h: no other expressions
    factors.compute(transposed);
    const VectorXd load = held(cluster.dofs), lambda = factors.solve(load);
    for (size_t b = 0; b < bearings_.size(); ++b)
      for (size_t i = 0; i < cluster.closures.size(); ++i)
        if (cluster.closures[i] == bearings_[b].closure)
          sizes_[static_cast<Eigen::Index>(b)] = lambda.segment<3>(offsets[i]).norm();
  }
  return (sizes_ - before).cwiseAbs().maxCoeff();
}

}  // namespace bielle::worlds
