#include "worlds/rod_forces.h"

#include <algorithm>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/reduction.h"

namespace bielle::worlds {

RodForces::RodForces(const Model& model, const std::vector<RodFriction>& frictions)
    : model_(model),
      bearings_(makeRodBearings(model, frictions)),
      ws_(model),
      sizes_(VectorXd::Zero(static_cast<Eigen::Index>(bearings_.size()))),
      before_(sizes_) {
  for (const LoopCluster& cluster : model_.clusters()) {
    Loops loops;
    int row = 0;
    for (const int c : cluster.closures) {
      const Closure& closure = model_.closures()[static_cast<size_t>(c)];
      loops.closures.emplace_back(c, row);
      for (size_t b = 0; b < bearings_.size(); ++b)
        if (bearings_[b].closure == c) loops.bearings.emplace_back(static_cast<Eigen::Index>(b), row);
      row += getRows(closure.kind);
    }
    if (loops.bearings.empty()) continue;
    loops.dofs = cluster.dofs;
    loops.J = MatrixXd::Zero(row, model_.nv());
    loops.transposed.resize(static_cast<Eigen::Index>(loops.dofs.size()), row);
    loops.factors.setThreshold(kRankTolerance);
    loops_.push_back(std::move(loops));
  }
}

void RodForces::move(const Workspace& ws) {
  updatePositions(model_, ws_, ws.q);
  updateVelocities<double>(model_, ws_, ws.v);
  for (Loops& loops : loops_) {
    for (const auto& [c, row] : loops.closures) {
      const Closure& closure = model_.closures()[static_cast<size_t>(c)];
      calcClosureJacobian<double>(ws_, closure, loops.J.middleRows(row, getRows(closure.kind)));
    }
    loops.transposed = loops.J(Eigen::all, loops.dofs).transpose();
    loops.factors.compute(loops.transposed);
  }
}

double RodForces::add(VectorXd& tau) const {
  double power = 0;
  for (size_t b = 0; b < bearings_.size(); ++b)
    for (const RodBearing::Pivot& pivot : bearings_[b].pivots) {
      Vector3d w = Vector3d::Zero();
      for (const auto& [dof, sign] : pivot) w += sign * ws_.v[dof] * ws_.J.col(dof).tail<3>();
      const Vector3d torque = calcRodTorque<double>(bearings_[b].law, sizes_[static_cast<Eigen::Index>(b)], w).torque;
      for (const auto& [dof, sign] : pivot) tau[dof] += sign * ws_.J.col(dof).tail<3>().dot(torque);
      power += torque.dot(w);
    }
  return power;
}

double RodForces::update(ConstVectorRef a, const VectorXd& tau) {
  updateInverseDynamics<double>(model_, ws_, a);
  before_ = sizes_;
  for (Loops& loops : loops_) {
    loops.load = (ws_.b - tau)(loops.dofs);  // J^T lambda
    loops.lambda = loops.factors.solve(loops.load);
    for (const auto& [bearing, row] : loops.bearings) sizes_[bearing] = loops.lambda.segment<3>(row).norm();
  }
  return (sizes_ - before_).cwiseAbs().maxCoeff();
}

}  // namespace bielle::worlds
