#include "bielle/dynamics/reduced_derivatives.h"

#include "bielle/dynamics/rnea.h"

namespace bielle {

ReducedDerivatives::ReducedDerivatives(const Model& model, const Reduction& reduction)
    : model_(model), reduction_(reduction) {
  for (const ReducedUnit& place : reduction.units) {
    Unit unit;
    if (place.block >= 0) {
      unit.dofs = reduction.blocks[place.block].dofs;
    } else {
      const Joint& joint = model.joints()[place.joint];
      for (int k = 0; k < joint.nv; ++k) unit.dofs.push_back(joint.idx_v + k);
    }
    const int outer = static_cast<int>(place.outer.size()), n = static_cast<int>(unit.dofs.size());
    for (Matrix6Xd* m : {&unit.J, &unit.dV, &unit.dA, &unit.dW}) m->setZero(6, outer);
    for (Matrix6Xd* m : {&unit.YJ, &unit.BtJ, &unit.Gy, &unit.Gv}) m->setZero(6, place.size);
    for (MatrixXd* m : {&unit.Dq, &unit.Dv}) m->setZero(n, n);
    for (MatrixXd* m : {&unit.DqN, &unit.DvN}) m->setZero(n, place.size);
    units_.push_back(std::move(unit));
  }
}

// Eq. (1): the columns of the parent's outer coordinates, then those of the parent itself along the path.
void ReducedDerivatives::updateOuter(const Workspace& ws, const std::vector<BlockLift>& lifts, int index) {
  const ReducedUnit& place = reduction_.units[index];
  if (place.parent < 0) return;
  const ReducedUnit& up = reduction_.units[place.parent];
  const Unit& parent = units_[place.parent];
  Unit& unit = units_[index];
  const int inherited = static_cast<int>(up.outer.size());
  unit.J.leftCols(inherited) = parent.J;
  unit.dV.leftCols(inherited) = parent.dV;
  unit.dA.leftCols(inherited) = parent.dA;
  unit.dW.leftCols(inherited) = parent.dW;
  if (up.block < 0) {
    const int k = parent.dofs.front(), n = up.size;
    unit.J.rightCols(n) = ws.J.middleCols(k, n);
    unit.dV.rightCols(n) = ws.dV.middleCols(k, n);
    unit.dA.rightCols(n) = ws.dA.middleCols(k, n);
    unit.dW.rightCols(n) = ws.dJ.middleCols(k, n) + ws.dV.middleCols(k, n);
    return;
  }
  const BlockLift& lift = lifts[up.block];
  for (int c = 0; c < up.size; ++c) {
    Vector6d J = Vector6d::Zero(), dV = J, dA = J, dW = J;
    for (int p : place.path) {
      const int k = parent.dofs[p];
      const double N = (*lift.N)(p, c), Z = (*lift.Z)(p, c);
      const Vector6d turn = ws.dJ.col(k) + ws.dV.col(k);
      J += N * ws.J.col(k);
      dV += N * ws.dV.col(k) + Z * ws.J.col(k);
      dA += N * ws.dA.col(k) + Z * turn + (*lift.dy)(p, c) * ws.J.col(k);
      dW += N * turn + (*lift.dv)(p, c) * ws.J.col(k);
    }
    unit.J.col(inherited + c) = J;
    unit.dV.col(inherited + c) = dV;
    unit.dA.col(inherited + c) = dA;
    unit.dW.col(inherited + c) = dW;
  }
}

// Eq. (2)
void ReducedDerivatives::updateInner(const Workspace& ws, const BlockLift* lift, Unit& unit) const {
  if (!lift) {
    const int k = unit.dofs.front(), n = static_cast<int>(unit.dofs.size());
    unit.YJ = ws.YJ.middleCols(k, n);
    unit.BtJ = ws.BtJ.middleCols(k, n);
    unit.Gy = ws.Gq.middleCols(k, n);
    unit.Gv = ws.Gv.middleCols(k, n);
    return;
  }
  for (Eigen::Index c = 0; c < unit.YJ.cols(); ++c) {
    Vector6d YJ = Vector6d::Zero(), BtJ = YJ, Gy = YJ, Gv = YJ;
    for (size_t p = 0; p < unit.dofs.size(); ++p) {
      const int j = unit.dofs[p];
      const double N = (*lift->N)(p, c);
      YJ += N * ws.YJ.col(j);
      BtJ += N * ws.BtJ.col(j);
      Gy += N * ws.Gq.col(j) + (*lift->Z)(p, c) * ws.Gv.col(j) + (*lift->dy)(p, c) * ws.YJ.col(j);
      Gv += N * ws.Gv.col(j) + (*lift->dv)(p, c) * ws.YJ.col(j);
    }
    unit.YJ.col(c) = YJ;
    unit.BtJ.col(c) = BtJ;
    unit.Gy.col(c) = Gy;
    unit.Gv.col(c) = Gv;
  }
}

// Eq. (4)
void ReducedDerivatives::addWithin(const Workspace& ws, const BlockLift* lift, const ReducedUnit& place, Unit& unit,
                                   MatrixRef A_y, MatrixRef A_v) const {
  const int n = static_cast<int>(unit.dofs.size()), size = place.size;
  auto within_y = A_y.block(place.offset, place.offset, size, size);
  auto within_v = A_v.block(place.offset, place.offset, size, size);
  if (!lift) {
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j) {
        const DerivativeEntry entry = calcDerivativeEntry(model_, ws, unit.dofs[j], unit.dofs[k]);
        within_y(j, k) = entry.q;
        within_v(j, k) = entry.v;
      }
    return;
  }
  unit.DqN.setZero();
  unit.DvN.setZero();
  const MatrixXd &N = *lift->N, &Z = *lift->Z, &dy = *lift->dy, &dv = *lift->dv, &H = *lift->H;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j) {
      const int dj = unit.dofs[j], dk = unit.dofs[k];
      double q = -H(j, k), v = 0, m = 0;
      const int bj = model_.dofs()[dj].joint, bk = model_.dofs()[dk].joint;
      if (model_.isAncestorOrSelf(bj, bk) || model_.isAncestorOrSelf(bk, bj)) {
        const DerivativeEntry entry = calcDerivativeEntry(model_, ws, dj, dk);
        q += entry.q;
        v = entry.v;
        m = ws.M(dj, dk);
      }
      for (int c = 0; c < size; ++c) {
        unit.DqN(j, c) += q * N(k, c) + v * Z(k, c) + m * dy(k, c);
        unit.DvN(j, c) += v * N(k, c) + m * dv(k, c);
      }
    }
  within_y.noalias() = N.transpose().lazyProduct(unit.DqN);
  within_v.noalias() = N.transpose().lazyProduct(unit.DvN);
}

void ReducedDerivatives::update(Workspace& ws, const std::vector<Vector6d>& f_ext, const std::vector<BlockLift>& lifts,
                                MatrixRef A_y, MatrixRef A_v) {
  updateInverseDynamicsFactors(model_, ws, f_ext);
  A_y.setZero();
  A_v.setZero();
  for (size_t u = 0; u < units_.size(); ++u) {
    const ReducedUnit& place = reduction_.units[u];
    Unit& unit = units_[u];
    const BlockLift* lift = place.block >= 0 ? &lifts[place.block] : nullptr;
    updateOuter(ws, lifts, static_cast<int>(u));
    updateInner(ws, lift, unit);
    addWithin(ws, lift, place, unit, A_y, A_v);
    for (size_t o = 0; o < place.outer.size(); ++o) {  // Eq. (3)
      const int beta = place.outer[o];
      const Vector6d J = unit.J.col(o), dV = unit.dV.col(o), dA = unit.dA.col(o), dW = unit.dW.col(o);
      for (int c = 0; c < place.size; ++c) {
        const int alpha = place.offset + c;
        A_y(alpha, beta) = unit.YJ.col(c).dot(dA) + unit.BtJ.col(c).dot(dV);
        A_v(alpha, beta) = unit.YJ.col(c).dot(dW) + unit.BtJ.col(c).dot(J);
        A_y(beta, alpha) = J.dot(unit.Gy.col(c));
        A_v(beta, alpha) = J.dot(unit.Gv.col(c));
      }
    }
  }
}

}  // namespace bielle
