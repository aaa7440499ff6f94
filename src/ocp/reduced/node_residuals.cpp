// Residuals of a node by the reduced coordinates: the chain rule through N and Z, and the Gauss-Newton terms.
#include <type_traits>

#include "ocp/reduced/node_assembly.h"

namespace bielle {
namespace {

// out += (A X)^T for the dofs of a cluster.
void addClusterColumns(const ReducedCluster& cluster, ConstMatrixRef A, const MatrixXd& X, MatrixRef out) {
  for (int c = 0; c < cluster.size; ++c) {
    Eigen::Index i = 0;
    const auto addRows = [&](auto rows) {
      using Rows = Eigen::Array<double, rows, 1>;
      for (; i + rows <= A.rows(); i += rows) {
        Rows sum = Rows::Zero();
        for (size_t k = 0; k < cluster.dofs.size(); ++k)
          sum += X(k, c) * Eigen::Map<const Rows>(&A.coeffRef(i, cluster.dofs[k]));
        out.row(cluster.offset + c).segment<rows>(i) += sum.matrix().transpose();
      }
    };
    addRows(std::integral_constant<int, 8>());
    addRows(std::integral_constant<int, 4>());
    addRows(std::integral_constant<int, 2>());
    addRows(std::integral_constant<int, 1>());
  }
}

}  // namespace

void NodeAssembly::addTimesN(ConstMatrixRef A, const ReducedEvaluation& at, MatrixRef out) const {
  for (const FreeJoint& free : free_joints_)
    for (int k = 0; k < free.size; ++k) out.row(free.offset + k) += A.col(free.joint->idx_v + k).transpose();
  for (size_t i = 0; i < at.clusters.size(); ++i)
    addClusterColumns(reduction_.clusters[i], A, at.clusters[i].at.N, out);
}

void NodeAssembly::addTimesZ(ConstMatrixRef A, const LaneView& view, MatrixRef out) const {
  for (size_t i = 0; i < view.clusters.size(); ++i)
    addClusterColumns(reduction_.clusters[i], A, view.clusters[i].Z, out);
}

// With Rt = (dr/d(u, dy, dy_v))^T, one column per residual, Rt diag(hessian) Rt^T is the whole Hessian.
void NodeAssembly::setResiduals(const NodeCosts& costs, const StageSpec& spec, const ContactLayout& contacts,
                                const std::vector<char>* wanted, const ReducedEvaluation& at, const LaneView& view,
                                StageModel& out) {
  const int nr = reduction_.size, leading = at.leading, columns = leading + 2 * nr;
  no_squares_.setZero();
  costs.selectRows(at, wanted, counted_);
  const int rows = counted_.rows;
  if (rows == 0) {
    for (VectorXd* gradient : {&out.lx, &out.lu}) gradient->setZero();
    out.hessian().setZero();
    return;
  }
  // Clears the residuals of the last node, in full lanes: the memory is padded.
  for (Eigen::Index i = 0; i < counted_.motion_rows; i += kLane) {
    jacobians_.q.middleRows<kLane>(i).setZero();
    jacobians_.v.middleRows<kLane>(i).setZero();
  }
  for (Eigen::Index i = 0; i < rows; i += kLane) {
    jacobians_.lambda.middleRows<kLane>(i).middleCols(contacts.closure_rows, contacts.rows).setZero();
    if (costs.needsControls()) jacobians_.u.middleRows<kLane>(i).setZero();
    if (costs.needsSpeeds()) jacobians_.speeds.middleRows<kLane>(i).setZero();
  }
  jacobians_.s.head(rows).setZero();
  const NodeBases bases(reduction_, at);
  costs.differentiate(
      {model_, view.ws, spec.constraints, at.u, at.lambda, at.time_scale, &at.speeds, &bases, &linkages_}, counted_,
      jacobians_);
  PaddedMap Rt = shapePadded(Rt_, columns, rows), scaled = shapePadded(Rt_scaled_, columns, rows);
  updateResidualDerivatives(costs, contacts, at, view, Rt);
  if (isFree(at))
    for (const CountedRows::Block& block : counted_.blocks)
      for (int i = block.row; !block.square && i < block.row + block.size; ++i)
        no_squares_.head(columns) += counted_.gradient[i] * Rt.col(i);
  counted_.visitConstraints(out, [&](int row, double unit, auto column) { column = Rt.col(row) / unit; });
  auto gradient = gradient_.head(columns);
  gradient.setZero();
  int counting = 0;  // rows of costs so far with a non-zero weight
  for (int i = 0; i < rows; ++i) {
    if (!counted_.counts(i) || counted_.constraints[i] >= 0) continue;
    gradient += counted_.gradient[i] * Rt.col(i);
    if (counting < i) Rt.col(counting) = Rt.col(i);
    scaled.col(counting++) = counted_.hessian[i] * Rt.col(i);
  }
  clearPadding(shapePadded(Rt_, columns, counting));
  clearPadding(shapePadded(Rt_scaled_, columns, counting));
  setLowerProduct(counting, pad(scaled), pad(Rt), out.hessian());
  out.lu = gradient.head(out.lu.size());
  out.lx = gradient.tail(out.lx.size());
}

void NodeAssembly::updateResidualDerivatives(const NodeCosts& costs, const ContactLayout& contacts,
                                             const ReducedEvaluation& at, const LaneView& view, PaddedMap Rt) {
  const int nr = reduction_.size, nu = model_.nu(), leading = at.leading, motion_rows = counted_.motion_rows;
  Rt.setZero();
  const bool of_state = at.v_mid.size() == 0;  // speeds, too
  if (costs.needsSpeeds() && of_state)
    for (int m = 0; m < nu; ++m)
      jacobians_.v.col(model_.motors()[m].dof).head(motion_rows) += jacobians_.speeds.col(m).head(motion_rows);
  const auto q = jacobians_.q.topRows(motion_rows), v = jacobians_.v.topRows(motion_rows);
  addTimesN(q, at, Rt.block(leading, 0, nr, motion_rows));
  addTimesZ(v, view, Rt.block(leading, 0, nr, motion_rows));
  addTimesN(v, at, Rt.block(leading + nr, 0, nr, motion_rows));
  if (costs.needsControls()) Rt.topRows(nu) = jacobians_.u.topLeftCorner(counted_.rows, nu).transpose();
  if (isFree(at)) Rt.row(leading - 1) = jacobians_.s.head(counted_.rows).transpose();
  if (costs.needsSpeeds() && !of_state) {
    const PaddedMap by_speeds = shapePadded(dspeeds_, leading + 2 * nr, nu);
    for (int i = 0; i < motion_rows; ++i)
      for (int m = 0; m < nu; ++m)
        if (jacobians_.speeds(i, m) != 0) Rt.col(i) += jacobians_.speeds(i, m) * by_speeds.col(m);
  }
  if (leading == 0 || contacts.rows == 0) return;
  const PaddedMap by_forces = shapePadded(dlambda_, leading + 2 * nr, contacts.rows);
  for (int i = 0; i < counted_.rows; ++i) {
    if (!counted_.counts(i)) continue;
    for (int j = 0; j < contacts.rows; ++j) {
      const double factor = jacobians_.lambda(i, contacts.closure_rows + j);
      if (factor != 0) Rt.col(i) += factor * by_forces.col(j);
    }
  }
}

}  // namespace bielle
