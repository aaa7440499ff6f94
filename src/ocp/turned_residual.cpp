#include "ocp/residual_data.h"

namespace bielle {
namespace {

class TurnedResidual : public DescribedResidual {
 public:
  TurnedResidual(std::shared_ptr<const Residual> vectors, const Matrix3d& R)
      : vectors_(std::move(vectors)), R_AW_(R.transpose()) {}
  int size() const override { return vectors_->size(); }
  bool needsForces() const override { return vectors_->needsForces(); }
  bool needsControls() const override { return vectors_->needsControls(); }
  bool needsSpeeds() const override { return vectors_->needsSpeeds(); }
  bool needsMotion() const override { return vectors_->needsMotion(); }
  void calc(const NodeView& node, VectorRef r) const override {
    vectors_->calc(node, r);
    for (int i = 0; i < size(); i += 3) r.segment<3>(i) = (R_AW_ * r.segment<3>(i)).eval();
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    vectors_->calcJacobian(node, rows);
    for (MatrixRef* part : {&rows.q, &rows.v, &rows.lambda, &rows.u, &rows.speeds})
      for (int i = 0; i < size(); i += 3)
        for (Eigen::Index k = 0; k < part->cols(); ++k)
          part->col(k).segment<3>(i) = (R_AW_ * part->col(k).segment<3>(i)).eval();
    for (int i = 0; i < size(); i += 3) rows.s.segment<3>(i) = (R_AW_ * rows.s.segment<3>(i)).eval();
  }
  ResidualData describe() const override {
    ResidualData data = describeResidual(*vectors_);
    if (!data.kind.empty()) data.values.emplace_back("R_WA", MatrixXd(R_AW_.transpose()));
    return data;
  }

 private:
  std::shared_ptr<const Residual> vectors_;
  Matrix3d R_AW_;
};

}  // namespace

std::shared_ptr<const Residual> makeTurned(std::shared_ptr<const Residual> vectors, const Matrix3d& R_WA) {
  if (R_WA.isIdentity(0)) return vectors;
  return std::make_shared<TurnedResidual>(std::move(vectors), R_WA);
}

}  // namespace bielle
