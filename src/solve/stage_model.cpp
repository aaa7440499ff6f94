#include "bielle/solve/shooting_problem.h"
#include "math/lane_product.h"

namespace bielle {

void StageModel::resize(int ndx, int nu, int ndx_next, int rows) {
  ndx_ = ndx;
  nu_ = nu;
  ndx_next_ = ndx_next;
  stride_ = roundUpToLane(nu_ + ndx_);
  gap.setZero(ndx_next);
  cost = 0;
  lx.setZero(ndx);
  lu.setZero(nu);
  Ft_.setZero(stride_ * ndx_next_);
  hessian_.setZero(stride_ * (nu_ + ndx_));
  Ct_.setZero(stride_ * rows);
  rows_ = rows;
}

void StageModel::setRows(int rows) {
  if (Ct_.size() < stride_ * rows) Ct_.setZero(stride_ * rows);
  rows_ = rows;
}

bool StageModel::hasSizes(int ndx, int nu, int ndx_next) const {
  return ndx_ == ndx && nu_ == nu && ndx_next_ == ndx_next && gap.size() == ndx_next && lx.size() == ndx &&
         lu.size() == nu;
}

}  // namespace bielle
