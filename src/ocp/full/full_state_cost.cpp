#include "ocp/full/full_state_cost.h"

#include "model/joint.h"
#include "ocp/transcription.h"

namespace bielle {

double calcStateCost(const Model& model, const StateCost& cost, ConstVectorRef q, ConstVectorRef v,
                     VectorXd& difference) {
  const int nv = model.nv();
  model.difference(cost.q_ref, q, difference);
  double sum =
      difference.cwiseAbs2().dot(cost.weights.head(nv)) + (v - cost.v_ref).cwiseAbs2().dot(cost.weights.tail(nv));
  if (model.hasFreeFlyer())
    for (const int i : {0, 3}) {
      const Vector3d d = difference.segment<3>(i), e = v.segment<3>(i) - cost.v_ref.segment<3>(i);
      sum += d.dot(cost.calcCoupling(i) * d) + e.dot(cost.calcCoupling(nv + i) * e);
    }
  return 0.5 * cost.weight * sum;
}

void addStateCost(const Model& model, const StateCost& cost, double scale, ConstVectorRef q, ConstVectorRef v,
                  VectorXd& difference, VectorRef gradient, MatrixRef hessian) {
  if (cost.weight == 0) return;
  const int nv = model.nv();
  const double w = scale * cost.weight;
  model.difference(cost.q_ref, q, difference);
  gradient.tail(nv) += w * cost.weights.tail(nv).cwiseProduct(v - cost.v_ref);
  hessian.diagonal().tail(nv) += w * cost.weights.tail(nv);
  if (model.hasFreeFlyer())
    for (const int i : {0, 3}) {
      const Matrix3d C = w * cost.calcCoupling(nv + i);
      gradient.segment<3>(nv + i) += C * (v.segment<3>(i) - cost.v_ref.segment<3>(i));
      hessian.block<3, 3>(nv + i, nv + i) += C;
    }
  for (const Joint& joint : model.joints()) {
    const int i = joint.idx_v, n = joint.nv;
    if (n == 0) continue;
    const JointVector weights = w * cost.weights.segment(i, n);
    const JointVector d = difference.segment(i, n);
    JointMatrix J(n, n);
    calcJointDifferenceJacobian(joint, d, J);
    JointMatrix WJ = weights.asDiagonal() * J;
    if (i == 0 && model.hasFreeFlyer())
      for (const int k : {0, 3}) WJ.middleRows<3>(k) += w * cost.calcCoupling(k) * J.middleRows<3>(k);
    gradient.segment(i, n).noalias() += WJ.transpose() * d;
    hessian.block(i, i, n, n).noalias() += J.transpose() * WJ;
  }
}

}  // namespace bielle
