#include "collocation.h"

#include <algorithm>

#include "ocp/full/full_state_cost.h"
#include "ocp/full/full_step.h"

namespace bielle {
namespace {

double calcWeight(const Model& model) {
  const double weight = model.mass() * model.gravity().norm();
  return weight > 0 ? weight : 1;
}

}  // namespace

Collocation::Collocation(const RobotProblem& problem, ShootingTrajectory guess)
    : NonlinearProgram(problem, std::move(guess)),
      model_(problem.model()),
      weight_(calcWeight(model_)),
      step_(model_),
      ws_(model_) {
  selectClosures();
  listNodes();
  setStart();
  makeEvaluations();
  listStructure();
  listEntries();
}

void Collocation::makeEvaluations() {
  int blocks = 0, rows = 0, forces = 0;
  for (size_t k = 0; k < nodes_.size(); ++k) {
    const NodeCosts& costs = nodes_[k].costs;
    const StageSpec& spec = problem_.spec(static_cast<int>(k));
    auto at = std::make_unique<RobotEvaluation>();
    at->residuals.setZero(costs.rows());
    at->constraints.setZero(costs.constraintRows());
    at->dt = spec.kind == StageKind::Dynamics ? spec.dt : 0;
    evaluations_.push_back(std::move(at));
    blocks = std::max(blocks, costs.numBlocks());
    rows = std::max(rows, costs.rows());
    forces = std::max(forces, spec.constraints.rows);
  }
  counted_.reserve(blocks, rows);
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v}) m->setZero(rows, model_.nv());
  for (MatrixXd* m : {&jacobians_.u, &jacobians_.speeds}) m->setZero(rows, model_.nu());
  jacobians_.lambda.setZero(rows, forces);
  jacobians_.s.setZero(rows);
  difference_.setZero(model_.nv());
}

VectorXd Collocation::calcMidpoint(int k) const {
  const auto q0 = guess_.xs[k].head(model_.nq()), q1 = guess_.xs[k + 1].head(model_.nq());
  return model_.integrate(q0, model_.difference(q0, q1) / 2);
}

NodeView Collocation::makeView(int k) {
  const RobotEvaluation& at = getEvaluation(k);
  return {model_, ws_, problem_.spec(k).constraints, at.u, at.lambda, 1, &at.speeds};
}

CollocationStep::Input Collocation::makeInput(int k) const {
  return {problem_.spec(k),  trajectory_.xs[k], trajectory_.xs[k + 1],
          trajectory_.us[k], nodes_[k].lambda,  nodes_[k].zeta};
}

// The state, controls, forces and multipliers of a node from z_.
void Collocation::read(int k) {
  Node& node = nodes_[k];
  const int nq = model_.nq(), nv = model_.nv();
  if (k > 0) {
    model_.integrate(guess_.xs[k].head(nq), z_.segment(node.d, nv), trajectory_.xs[k].head(nq));
    trajectory_.xs[k].segment(nq, nv) = z_.segment(node.d + nv, nv);
  }
  if (isLast(k)) return;
  trajectory_.us[k].head(places_[k].nu) = z_.segment(places_[k].u, places_[k].nu);
  const auto get = [&](int first, int count, VectorXd& out) {
    out.setZero(count);
    for (int i = 0; i < count; ++i)
      if (node.z[first + i] >= 0) out[i] = node.scale[first + i] * z_[node.z[first + i]];
  };
  get(node.at.lambda, node.at.forces, node.lambda);
  get(node.at.zeta, node.at.loops, node.zeta);
}

bool Collocation::update() {
  const int count = static_cast<int>(nodes_.size());
  for (int k = 0; k < count; ++k) read(k);
  for (int k = 0; k < count; ++k) {
    updateCosts(k);
    if (!getEvaluation(k).failure.empty())
      return fail("node " + std::to_string(k) + " cannot be evaluated: " + getEvaluation(k).failure);
    if (isLast(k)) continue;
    updateStep(k);
    if (!nodes_[k].values.allFinite()) return fail("the step from node " + std::to_string(k) + " is not finite");
  }
  return true;
}

void Collocation::updateCosts(int k) {
  const Node& node = nodes_[k];
  const StateCost& state = problem_.spec(k).state;
  RobotEvaluation& at = getEvaluation(k);
  const int nq = model_.nq(), nv = model_.nv();
  at.x = trajectory_.xs[k];
  if (!isLast(k)) {
    at.u = trajectory_.us[k];
    at.lambda = node.lambda;
    at.speeds.resize(model_.nu());
    for (int m = 0; m < model_.nu(); ++m) {
      const int i = nq + model_.motors()[m].dof;
      at.speeds[m] = (trajectory_.xs[k][i] + trajectory_.xs[k + 1][i]) / 2;
    }
  }
  updateNode(model_, at.x, ws_);
  at.state_cost =
      state.weight != 0 ? calcStateCost(model_, state, at.x.head(nq), at.x.segment(nq, nv), difference_) : 0;
  node.costs.calc(makeView(k), at);
  at.failure = node.costs.describeNotFinite(at);
}

void Collocation::updateStep(int k) {
  Node& node = nodes_[k];
  step_.update(makeInput(k), step_values_);
  node.values.resize(node.row_scale.size());
  for (size_t i = 0; i < node.rows.size(); ++i) node.values[i] = node.row_scale[i] * step_values_[node.rows[i]];
}

bool Collocation::differentiate() {
  updateCharts();
  for (int k = 0; k < static_cast<int>(nodes_.size()); ++k) {
    Node& node = nodes_[k];
    differentiateCosts(k);
    bool finite = node.gradient.allFinite() && node.path_jacobian.allFinite() && node.hessian.allFinite();
    if (!isLast(k)) {
      linearizeStep(k);
      Eigen::Index entry = 0;
      for (const auto& [i, j] : node.step_entries)
        node.step_jacobian[entry++] = node.row_scale[i] * step_jacobian_(node.rows[i], j) * node.scale[j];
      finite = finite && node.step_jacobian.allFinite();
    }
    if (!finite) return fail("node " + std::to_string(k) + " has no derivatives");
  }
  return true;
}

// Derivatives of the counted rows by the scaled columns of the step.
void Collocation::calcResiduals(int k, MatrixXd& R) {
  const Node& node = nodes_[k];
  const StepLayout& at = node.at;
  const int nv = model_.nv(), nu = isLast(k) ? 0 : model_.nu();
  node.costs.selectRows(getEvaluation(k), &places_[k].wanted, counted_);
  const int rows = counted_.rows;
  for (MatrixXd* m : {&jacobians_.q, &jacobians_.v, &jacobians_.lambda, &jacobians_.u, &jacobians_.speeds})
    m->topRows(rows).setZero();
  node.costs.differentiate(makeView(k), counted_, jacobians_);
  R.setZero(rows, at.columns);
  R.middleCols(at.q0, nv) = multiply(jacobians_.q.topRows(rows), charts_[k]);
  R.middleCols(at.v0, nv) = jacobians_.v.topRows(rows);
  R.middleCols(at.u, nu) = jacobians_.u.topLeftCorner(rows, nu);
  R.middleCols(at.lambda, at.forces) = jacobians_.lambda.topLeftCorner(rows, at.forces);
  for (int m = 0; node.costs.needsSpeeds() && m < nu; ++m)
    for (const int first : {at.v0, at.v1})
      R.col(first + model_.motors()[m].dof) += 0.5 * jacobians_.speeds.col(m).head(rows);
  R *= node.scale.asDiagonal();
}

void Collocation::differentiateCosts(int k) {
  Node& node = nodes_[k];
  updateNode(model_, trajectory_.xs[k], ws_);
  MatrixXd R;
  calcResiduals(k, R);
  std::vector<int> counted(places_[k].wanted.size());  // the row of each constraint
  for (int i = 0; i < counted_.rows; ++i)
    if (counted_.constraints[i] >= 0) counted[counted_.constraints[i]] = i;
  Eigen::Index entry = 0;
  for (size_t i = 0; i < node.path_columns.size(); ++i) {
    const int row = counted[places_[k].kept[i]];
    for (const int j : node.path_columns[i]) node.path_jacobian[entry++] = R(row, j) / counted_.unit[row];
  }
  const Eigen::Index size = static_cast<Eigen::Index>(node.cost_columns.size());
  MatrixXd of_costs(R.rows(), size);
  for (Eigen::Index j = 0; j < size; ++j) of_costs.col(j) = R.col(node.cost_columns[j]);
  node.gradient = of_costs.transpose() * counted_.gradient.head(R.rows());
  MatrixXd H = of_costs.transpose() * MatrixXd(counted_.hessian.head(R.rows()).asDiagonal() * of_costs);
  addNodeCosts(k, node.gradient, H);
  entry = 0;
  for (const auto& [i, j] : node.cost_entries) node.hessian[entry++] = H(i, j);
}

// Costs of the state and of the controls, whose columns are the first ones.
void Collocation::addNodeCosts(int k, VectorXd& gradient, MatrixXd& hessian) {
  const Node& node = nodes_[k];
  const RobotEvaluation& at = getEvaluation(k);
  const int nq = model_.nq(), nv = model_.nv(), nu = places_[k].nu, state = k > 0 ? 2 * nv : 0;
  if (k > 0) {
    VectorXd lx = VectorXd::Zero(2 * nv);
    MatrixXd lxx = MatrixXd::Zero(2 * nv, 2 * nv);
    addStateCost(model_, problem_.spec(k).state, node.costs.getScale(at), at.x.head(nq), at.x.segment(nq, nv),
                 difference_, lx, lxx);
    const MatrixXd of_places = lxx.topLeftCorner(nv, nv);
    lxx.topLeftCorner(nv, nv) = multiply(multiply(of_places, charts_[k]).transpose(), charts_[k]);
    gradient.head(nv) += multiply(lx.head(nv).transpose(), charts_[k]).transpose();
    gradient.segment(nv, nv) += lx.tail(nv);
    hessian.topLeftCorner(state, state) += lxx;
  }
  if (nu == 0) return;
  StageModel controls;
  controls.resize(0, nu, 0);
  node.costs.addControlCost(at, controls);
  gradient.segment(state, nu) += controls.lu;
  hessian.block(state, state, nu, nu) += controls.luu();
}

void Collocation::updateCharts() {
  charts_.resize(nodes_.size());
  for (size_t k = 1; k < nodes_.size(); ++k)
    charts_[k] = makeIntegrateBlocks(model_, z_.segment(nodes_[k].d, model_.nv()));
}

void Collocation::linearizeStep(int k) {
  const StepLayout& at = nodes_[k].at;
  const int nv = model_.nv();
  const CollocationStep::Input input = makeInput(k);
  step_.update(input, step_values_);
  step_.differentiate(input, step_jacobian_);
  const auto chain = [&](int first, const JointBlocks& chart) {
    step_jacobian_.middleCols(first, nv) = multiply(step_jacobian_.middleCols(first, nv), chart);
  };
  chain(at.q0, charts_[k]);
  chain(at.q1, charts_[k + 1]);
}

void Collocation::getRows(VectorRef out) const {
  getPathRows(out);
  for (const Node& node : nodes_) out.segment(node.first, node.values.size()) = node.values;
}

void Collocation::getGradient(VectorRef out) const {
  out.setZero();
  for (const Node& node : nodes_)
    for (size_t i = 0; i < node.cost_columns.size(); ++i) out[node.z[node.cost_columns[i]]] += node.gradient[i];
}

void Collocation::getJacobian(VectorRef values) const {
  Eigen::Index at = 0;
  for (const Node& node : nodes_)
    for (const VectorXd* entries : {&node.path_jacobian, &node.step_jacobian}) {
      values.segment(at, entries->size()) = *entries;
      at += entries->size();
    }
}

void Collocation::getHessian(VectorRef values) const {
  Eigen::Index at = 0;
  for (const Node& node : nodes_) {
    values.segment(at, node.hessian.size()) = node.hessian;
    at += node.hessian.size();
  }
}

double Collocation::calcGap() const {
  double worst = 0;
  for (const Node& node : nodes_)
    if (node.values.size() > 0) worst = std::max(worst, node.values.cwiseAbs().maxCoeff());
  return worst;
}

}  // namespace bielle
