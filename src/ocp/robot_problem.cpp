#include "bielle/ocp/robot_problem.h"

#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/error.h"

namespace bielle {
namespace {

// Joints whose configuration is not a vector: their blocks of the manifold Jacobians differ from the identity.
bool isCurved(const Joint& joint) {
  return joint.kind == JointKind::Spherical || joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer;
}

void checkSpec(const Model& model, const StageSpec& spec, size_t index) {
  const std::string element = "stage " + std::to_string(index);
  const auto require = [&](bool ok, const std::string& what, const std::string& remedy) {
    if (!ok) throw ModelError(model.name(), element, what, remedy);
  };
  require(spec.dt > 0 && std::isfinite(spec.dt), "its time step is not positive", "give seconds, e.g. 0.015");
  if (spec.state.weight != 0)
    require(spec.state.q_ref.size() == model.nq() && spec.state.v_ref.size() == model.nv() &&
                spec.state.weights.size() == 2 * model.nv(),
            "the state cost has wrong sizes", "q_ref: nq, v_ref: nv, weights: 2 nv");
  if (spec.control.weight != 0)
    require(spec.control.reference.size() == model.nu() && spec.control.weights.size() == model.nu(),
            "the control cost has wrong sizes", "reference and weights: nu");
  for (const Cost& cost : spec.costs)
    require(
        cost.residual && cost.activation.weights.size() == cost.residual->size(),
        "cost '" + cost.name + "' has " + std::to_string(cost.activation.weights.size()) + " weights for another size",
        "give one weight per row of the residual");
}

}  // namespace

// Memory of one node: the last evaluated point and everything computed there.
struct RobotProblem::Node {
  Node(const Model& model, const StageSpec& spec) : ws(model) {
    int rows = 0;
    for (const Cost& cost : spec.costs) rows += cost.residual->size();
    r.setZero(rows);
    gradient.setZero(rows);
    hessian.setZero(rows);
    Rq.setZero(rows, model.nv());
    Rv.setZero(rows, model.nv());
    Rlambda.setZero(rows, spec.constraints.rows);
    Rx.setZero(rows, 2 * model.nv());
    Ru.setZero(rows, model.nu());
    scaled_x.setZero(rows, 2 * model.nv());
    scaled_u.setZero(rows, model.nu());
    tau.setZero(model.nv());
    difference.setZero(model.nv());
    x_next.setZero(model.nq() + model.nv());
  }
  Workspace ws;
  ConstrainedWorkspace cws;
  VectorXd x, u, x_next, tau;
  bool valid = false;
  VectorXd r, gradient, hessian;        // stacked residuals
  MatrixXd Rq, Rv, Rlambda;             // their partial derivatives
  MatrixXd Rx, Ru, scaled_x, scaled_u;  // total derivatives; the same times the Hessian
  VectorXd difference;
};

RobotProblem::RobotProblem(const Model& model, const VectorXd& q0, const VectorXd& v0, std::vector<StageSpec> stages)
    : model_(model), specs_(std::move(stages)) {
  if (specs_.empty())
    throw ModelError(model.name(), "shooting problem", "it has no stage", "give at least the terminal one");
  if (q0.size() != model.nq() || v0.size() != model.nv())
    throw ModelError(model.name(), "shooting problem", "the initial state has a wrong size", "q0: nq, v0: nv");
  for (size_t k = 0; k < specs_.size(); ++k) checkSpec(model, specs_[k], k);
  nodes_.reserve(specs_.size());
  for (const StageSpec& spec : specs_) nodes_.emplace_back(model, spec);
  x0_.resize(stateSize());
  x0_ << q0, v0;
}

RobotProblem::~RobotProblem() = default;

void RobotProblem::integrate(int, ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) const {
  model_.integrate(x.head(model_.nq()), dx.head(model_.nv()), x_out.head(model_.nq()));
  x_out.tail(model_.nv()) = x.tail(model_.nv()) + dx.tail(model_.nv());
}

void RobotProblem::difference(int, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const {
  model_.difference(x0.head(model_.nq()), x1.head(model_.nq()), dx.head(model_.nv()));
  dx.tail(model_.nv()) = x1.tail(model_.nv()) - x0.tail(model_.nv());
}

// Dynamics and next state at (x, u), unless they are already there.
StepStatus RobotProblem::evaluate(int stage, ConstVectorRef x, ConstVectorRef u) {
  Node& node = nodes_[stage];
  const StageSpec& spec = specs_[stage];
  if (node.valid && node.x == x && node.u == u) return StepStatus::Ok;
  node.valid = false;
  node.x = x;
  node.u = u;
  if (!x.allFinite() || !u.allFinite()) return StepStatus::Failed;
  const int nq = model_.nq(), nv = model_.nv();
  calcMotorForces(model_, u, node.tau);
  if (updateConstrainedDynamics(model_, node.ws, node.cws, spec.constraints, x.head(nq), x.tail(nv), node.tau) !=
      DynamicsStatus::Ok)
    return StepStatus::Failed;
  node.x_next.tail(nv) = x.tail(nv) + spec.dt * node.cws.a;  // Eq. (1)
  node.tau = spec.dt * node.x_next.tail(nv);
  model_.integrate(x.head(nq), node.tau, node.x_next.head(nq));
  if (!node.x_next.allFinite()) return StepStatus::Failed;
  node.valid = true;
  return StepStatus::Ok;
}

StepStatus RobotProblem::step(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) {
  if (evaluate(stage, x, u) != StepStatus::Ok) return StepStatus::Failed;
  x_next = nodes_[stage].x_next;
  cost = specs_[stage].dt * sumCosts(stage);
  return std::isfinite(cost) ? StepStatus::Ok : StepStatus::Failed;
}

StepStatus RobotProblem::calcTerminalCost(ConstVectorRef x, double& cost) {
  Node& node = nodes_.back();
  if (!x.allFinite()) return StepStatus::Failed;
  if (!node.valid || node.x != x) {
    node.x = x;
    updatePositions(model_, node.ws, x.head(model_.nq()));
    updateVelocities(model_, node.ws, x.tail(model_.nv()));
    updateMassMatrix(model_, node.ws);
    node.valid = true;
  }
  cost = sumCosts(numStages());
  return std::isfinite(cost) ? StepStatus::Ok : StepStatus::Failed;
}

double RobotProblem::sumCosts(int index, std::vector<CostValue>* values) {
  Node& node = nodes_[index];
  const StageSpec& spec = specs_[index];
  double sum = 0;
  const auto add = [&](const std::string& name, double value) {
    sum += value;
    if (values) values->push_back({name, value});
  };
  const int nq = model_.nq(), nv = model_.nv();
  if (spec.state.weight != 0) {
    model_.difference(spec.state.q_ref, node.x.head(nq), node.difference);
    double value = node.difference.cwiseAbs2().dot(spec.state.weights.head(nv));
    value += (node.x.tail(nv) - spec.state.v_ref).cwiseAbs2().dot(spec.state.weights.tail(nv));
    add("state", 0.5 * spec.state.weight * value);
  }
  if (spec.control.weight != 0 && node.u.size())
    add("control", 0.5 * spec.control.weight * (node.u - spec.control.reference).cwiseAbs2().dot(spec.control.weights));
  const NodeView view{model_, node.ws, spec.constraints, node.u, node.cws.lambda};
  int row = 0;
  for (const Cost& cost : spec.costs) {
    auto r = node.r.segment(row, cost.residual->size());
    cost.residual->calc(view, r);
    add(cost.name, cost.weight * cost.activation.calc(r));
    row += cost.residual->size();
  }
  return sum;
}

StepStatus RobotProblem::linearize(int stage, ConstVectorRef x, ConstVectorRef u, ConstVectorRef x_next_node,
                                   StageModel& out) {
  const StageSpec& spec = specs_[stage];
  Node& node = nodes_[stage];
  const int nv = model_.nv(), nq = model_.nq();
  if (evaluate(stage, x, u) != StepStatus::Ok) return StepStatus::Failed;
  if (updateConstrainedDerivatives(model_, node.ws, node.cws, spec.constraints) != DynamicsStatus::Ok)
    return StepStatus::Failed;
  if (out.Fx.rows() != 2 * nv || out.Fu.cols() != model_.nu()) out.resize(2 * nv, model_.nu(), 2 * nv);

  // Eq. (2), for joints whose configuration is a vector: J_q and J_d are the identity.
  const double h = spec.dt;
  auto Fv_q = out.Fx.bottomLeftCorner(nv, nv), Fv_v = out.Fx.bottomRightCorner(nv, nv);
  Fv_q = h * node.cws.da_dq;
  Fv_v = h * node.cws.da_dv;
  Fv_v.diagonal().array() += 1;
  out.Fu.bottomRows(nv) = h * node.cws.da_du;
  out.Fx.topRows(nv) = h * out.Fx.bottomRows(nv);
  out.Fx.topLeftCorner(nv, nv).diagonal().array() += 1;
  out.Fu.topRows(nv) = h * out.Fu.bottomRows(nv);
  difference(stage + 1, x_next_node, node.x_next, out.gap);
  // Curved joints, and the Jacobian of the difference to the node state where a gap is open.
  Matrix6d Jq, Jd, Jdiff;
  for (const Joint& joint : model_.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    auto q = Jq.topLeftCorner(n, n), d = Jd.topLeftCorner(n, n), diff = Jdiff.topLeftCorner(n, n);
    const Vector6d step_full = [&] {
      Vector6d s = Vector6d::Zero();
      s.head(n) = h * node.x_next.segment(nq + i, n);
      return s;
    }();
    calcJointIntegrateJacobians(joint, step_full.head(n), q, d);
    calcJointDifferenceJacobian(joint, out.gap.segment(i, n), diff);
    const Matrix6d product = [&] {
      Matrix6d p = Matrix6d::Zero();
      p.topLeftCorner(n, n) = h * diff * d;
      return p;
    }();
    out.Fx.middleRows(i, n).noalias() = product.topLeftCorner(n, n) * out.Fx.middleRows(nv + i, n);
    out.Fx.block(i, i, n, n) += diff * q;
    out.Fu.middleRows(i, n).noalias() = product.topLeftCorner(n, n) * out.Fu.middleRows(nv + i, n);
  }

  out.cost = h * sumCosts(stage);
  out.lx.setZero();
  out.lu.setZero();
  out.lxx.setZero();
  out.lux.setZero();
  out.luu.setZero();
  addStateCost(stage, h, out);
  if (spec.control.weight != 0) {
    const double w = h * spec.control.weight;
    out.lu += w * spec.control.weights.cwiseProduct(u - spec.control.reference);
    out.luu.diagonal() += w * spec.control.weights;
  }
  addResidualCosts(stage, h, out);
  return out.Fx.allFinite() && out.lxx.allFinite() ? StepStatus::Ok : StepStatus::Failed;
}

StepStatus RobotProblem::linearizeTerminal(ConstVectorRef x, StageModel& out) {
  double cost = 0;
  if (calcTerminalCost(x, cost) != StepStatus::Ok) return StepStatus::Failed;
  if (out.lx.size() != 2 * model_.nv()) out.resize(2 * model_.nv(), 0, 0);
  out.cost = cost;
  out.lx.setZero();
  out.lxx.setZero();
  addStateCost(numStages(), 1, out);
  addResidualCosts(numStages(), 1, out);
  return out.lxx.allFinite() ? StepStatus::Ok : StepStatus::Failed;
}

void RobotProblem::addStateCost(int index, double scale, StageModel& out) const {
  const StateCost& state = specs_[index].state;
  if (state.weight == 0) return;
  const Node& node = nodes_[index];
  const int nv = model_.nv(), nq = model_.nq();
  const double w = scale * state.weight;
  out.lx.tail(nv) += w * state.weights.tail(nv).cwiseProduct(node.x.tail(nv) - state.v_ref);
  out.lxx.diagonal().tail(nv) += w * state.weights.tail(nv);
  Vector6d d = Vector6d::Zero(), weighted = Vector6d::Zero();
  Matrix6d J, WJ;
  for (const Joint& joint : model_.joints()) {
    if (joint.nv == 0) continue;
    const int i = joint.idx_v, n = joint.nv;
    const auto weights = w * state.weights.segment(i, n);
    calcJointDifference(joint, state.q_ref.segment(joint.idx_q, joint.nq),
                        node.x.head(nq).segment(joint.idx_q, joint.nq), d.head(n));
    weighted.head(n) = weights.cwiseProduct(d.head(n));
    if (!isCurved(joint)) {
      out.lx.segment(i, n) += weighted.head(n);
      out.lxx.diagonal().segment(i, n) += weights;
      continue;
    }
    calcJointDifferenceJacobian(joint, d.head(n), J.topLeftCorner(n, n));
    out.lx.segment(i, n).noalias() += J.topLeftCorner(n, n).transpose() * weighted.head(n);
    WJ.topLeftCorner(n, n) = weights.asDiagonal() * J.topLeftCorner(n, n);
    out.lxx.block(i, i, n, n).noalias() += J.topLeftCorner(n, n).transpose().lazyProduct(WJ.topLeftCorner(n, n));
  }
}

void RobotProblem::addResidualCosts(int index, double scale, StageModel& out) {
  Node& node = nodes_[index];
  const StageSpec& spec = specs_[index];
  if (spec.costs.empty()) return;
  const int nv = model_.nv();
  const bool running = index < numStages();
  const NodeView view{model_, node.ws, spec.constraints, node.u, node.cws.lambda};
  node.Ru.setZero();
  int row = 0;
  for (const Cost& cost : spec.costs) {
    const int n = cost.residual->size();
    cost.residual->calcJacobian(
        view, {node.Rq.middleRows(row, n), node.Rv.middleRows(row, n), node.Rlambda.middleRows(row, n)});
    cost.activation.calcDerivatives(node.r.segment(row, n), node.gradient.segment(row, n),
                                    node.hessian.segment(row, n));
    node.gradient.segment(row, n) *= scale * cost.weight;
    node.hessian.segment(row, n) *= scale * cost.weight;
    auto Rx = node.Rx.middleRows(row, n);
    Rx.leftCols(nv) = node.Rq.middleRows(row, n);
    Rx.rightCols(nv) = node.Rv.middleRows(row, n);
    if (running && cost.residual->needsForces()) {
      const auto Rl = node.Rlambda.middleRows(row, n);
      Rx.leftCols(nv).noalias() += Rl * node.cws.dlambda_dq;
      Rx.rightCols(nv).noalias() += Rl * node.cws.dlambda_dv;
      node.Ru.middleRows(row, n).noalias() = Rl * node.cws.dlambda_du;
    }
    row += n;
  }
  out.lx.noalias() += node.Rx.transpose() * node.gradient;
  node.scaled_x = node.hessian.asDiagonal() * node.Rx;
  out.lxx.noalias() += node.Rx.transpose() * node.scaled_x;
  if (!running) return;
  node.scaled_u = node.hessian.asDiagonal() * node.Ru;
  out.lu.noalias() += node.Ru.transpose() * node.gradient;
  out.luu.noalias() += node.Ru.transpose() * node.scaled_u;
  out.lux.noalias() += node.Ru.transpose() * node.scaled_x;
}

void RobotProblem::getControlBounds(int, VectorRef lower, VectorRef upper) const {
  for (int m = 0; m < model_.nu(); ++m) {
    upper[m] = model_.motors()[m].effort_limit;
    lower[m] = -upper[m];
  }
}

StepStatus RobotProblem::calcDynamics(int stage, ConstVectorRef x, ConstVectorRef u, VectorXd& a, VectorXd& lambda) {
  if (evaluate(stage, x, u) != StepStatus::Ok) return StepStatus::Failed;
  a = nodes_[stage].cws.a;
  lambda = nodes_[stage].cws.lambda;
  return StepStatus::Ok;
}

std::vector<CostValue> RobotProblem::calcCosts(int node, ConstVectorRef x, ConstVectorRef u) {
  std::vector<CostValue> values;
  double cost = 0;
  const bool running = node < numStages();
  if ((running ? evaluate(node, x, u) : calcTerminalCost(x, cost)) == StepStatus::Ok) sumCosts(node, &values);
  return values;
}

}  // namespace bielle
