// Where variables, rows and entries of a collocation are, and which rows are left out.
#include <Eigen/QR>
#include <algorithm>
#include <random>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "collocation.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kRank = 1e-6;  // of a pivot over the first one: as kRankTolerance of reduction.h

// Independent rows of J, in their order.
std::vector<int> selectIndependent(const MatrixXd& J) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(MatrixXd(J.transpose()));
  qr.setThreshold(kRank);
  const auto& order = qr.colsPermutation().indices();
  std::vector<int> out(order.data(), order.data() + qr.rank());
  std::sort(out.begin(), out.end());
  return out;
}

MatrixXd pickRows(const MatrixXd& all, const std::vector<int>& rows) {
  MatrixXd out(rows.size(), all.cols());
  for (size_t i = 0; i < rows.size(); ++i) out.row(i) = all.row(rows[i]);
  return out;
}

}  // namespace

MatrixXd Collocation::calcJacobian(const ConstraintSet& set, ConstVectorRef q) {
  updatePositions(model_, ws_, q);
  MatrixXd J = MatrixXd::Zero(set.rows, model_.nv());
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(ws_, set.closures[c], J.middleRows(set.offsets[c], bielle::getRows(set.closures[c].kind)));
  return J;
}

void Collocation::selectClosures() {
  const ConstraintSet set = makeConstraintSet(model_);
  loops_ = selectIndependent(calcJacobian(set, guess_.xs[0].head(model_.nq())));
  for (size_t k = 1; k < guess_.xs.size(); ++k) {
    const MatrixXd J = pickRows(calcJacobian(set, guess_.xs[k].head(model_.nq())), loops_);
    if (selectIndependent(J).size() < loops_.size())
      throw InputError(
          model_.name(), "collocation",
          "rows of its closures that are independent at the first node are not so at node " + std::to_string(k),
          "start from another guess");
  }
}

std::vector<std::string> Collocation::listDropped() const {
  const ConstraintSet set = makeConstraintSet(model_);
  std::vector<std::string> out;
  for (size_t c = 0; c < set.closures.size(); ++c)
    for (int i = 0; i < bielle::getRows(set.closures[c].kind); ++i)
      if (!std::binary_search(loops_.begin(), loops_.end(), set.offsets[c] + i))
        out.push_back("row " + std::to_string(i) + " of " + set.closures[c].name);
  return out;
}

// What the closures leave of the rows of contacts is J_c (1 - Q Q^T), Q being a basis of the rows of J.
std::vector<int> Collocation::selectContacts(int k) {
  const ConstraintSet& set = problem_.spec(k).constraints;
  const MatrixXd J = calcJacobian(set, calcMidpoint(k));
  const int loops = StepLayout(model_, set).loops, contacts = set.rows - loops;
  if (contacts == 0) return {};
  const MatrixXd closures = pickRows(J, loops_);
  MatrixXd rest = J.bottomRows(contacts);
  const double size = rest.cwiseAbs().maxCoeff();
  if (!loops_.empty()) {
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(MatrixXd(closures.transpose()));
    const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(model_.nv(), closures.rows());
    rest -= MatrixXd(rest * Q) * Q.transpose();
  }
  if (rest.cwiseAbs().maxCoeff() < kRank * size) return {};
  std::vector<int> out = selectIndependent(rest);
  for (int& row : out) row += loops;
  return out;
}

void Collocation::listNodes() {
  const int nv = model_.nv(), count = static_cast<int>(places_.size());
  int variable = 0, row = 0;
  for (int k = 0; k < count; ++k) {
    Node node(NodeCosts(problem_.spec(k), k + 1 < count));
    Place& place = places_[k];
    node.d = variable;
    place.u = node.d + (k > 0 ? 2 * nv : 0);
    variable = place.u + place.nu;
    if (k + 1 < count) {
      node.at = StepLayout(model_, problem_.spec(k).constraints);
      node.contacts = selectContacts(k);
      variable += static_cast<int>(node.contacts.size() + 2 * loops_.size());
    } else {
      node.at.v0 = nv;
      for (int* first : {&node.at.u, &node.at.lambda, &node.at.zeta, &node.at.q1, &node.at.v1, &node.at.columns})
        *first = 2 * nv;
    }
    nodes_.push_back(std::move(node));
  }
  for (int k = 0; k < count; ++k) {
    listColumns(k);
    listRows(k);
    places_[k].c = row;
    nodes_[k].first = row + places_[k].numRows();
    row = nodes_[k].first + static_cast<int>(nodes_[k].rows.size());
  }
  setBounds(variable, row);
}

void Collocation::listColumns(int k) {
  Node& node = nodes_[k];
  const StepLayout& at = node.at;
  const int nv = model_.nv();
  node.z.assign(at.columns, -1);
  node.scale.setOnes(at.columns);
  for (int i = 0; k > 0 && i < 2 * nv; ++i) node.z[at.q0 + i] = node.d + i;
  if (isLast(k)) return;
  int next = places_[k].u;
  for (int i = 0; i < places_[k].nu; ++i) node.z[at.u + i] = next++;
  node.scale.segment(at.lambda, at.forces).setConstant(weight_);
  for (const std::vector<int>* rows : {&loops_, &node.contacts})
    for (const int row : *rows) node.z[at.lambda + row] = next++;
  for (const int row : loops_) node.z[at.zeta + row] = next++;
  for (int i = 0; i < 2 * nv; ++i) node.z[at.q1 + i] = next++;
}

void Collocation::listRows(int k) {
  if (isLast(k)) return;
  Node& node = nodes_[k];
  const StepLayout& at = node.at;
  const StageSpec& spec = problem_.spec(k);
  for (int i = at.places; i < at.contacts; ++i) node.rows.push_back(i);
  for (const int row : node.contacts) node.rows.push_back(at.contacts + row - at.loops);
  for (const int first : {at.closed, at.still})
    for (const int row : loops_) node.rows.push_back(first + row);
  node.row_scale.setOnes(static_cast<Eigen::Index>(node.rows.size()));
  node.row_scale.segment(at.dynamics, model_.nv()).setConstant(1 / weight_);
  if (spec.kind == StageKind::Dynamics)
    node.row_scale.segment(at.contacts, static_cast<Eigen::Index>(node.contacts.size())).setConstant(spec.dt);
}

// Beside the guess, at random: what is not zero there, or is written there, is an entry.
void Collocation::listStructure() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> within(-0.1, 0.1);
  z_ = start_;
  for (double& entry : z_) entry += within(random);
  const int count = static_cast<int>(nodes_.size());
  for (int k = 0; k < count; ++k) read(k);
  updateCharts();
  for (int k = 0; k < count; ++k) {
    if (!isLast(k)) listStep(k);
    updateCosts(k);
    listPaths(k);
    listCosts(k);
  }
  z_.resize(0);
}

// Rows of the dynamics have the entries of the mass matrix for all four tangents, since a spring may pull elsewhere.
void Collocation::listStep(int k) {
  Node& node = nodes_[k];
  const StepLayout& at = node.at;
  linearizeStep(k);
  MatrixXd& J = step_jacobian_;
  for (int i = at.dynamics; i < at.contacts; ++i)
    for (int j = 0; j < model_.nv(); ++j)
      for (const int column : {at.q0, at.v0, at.q1}) J(i, column + j) += J(i, at.v1 + j) != 0;
  for (size_t i = 0; i < node.rows.size(); ++i)
    for (int j = 0; j < at.columns; ++j)
      if (node.z[j] >= 0 && J(node.rows[i], j) != 0) node.step_entries.emplace_back(i, j);
}

// Of the derivatives of a residual by the columns of the step, the entries that it writes: others keep what was there
// before.
Collocation::Pattern Collocation::findPattern(int k, const Residual& residual) {
  const StepLayout& at = nodes_[k].at;
  const int n = residual.size(), nv = model_.nv(), nu = model_.nu();
  const NodeView view = makeView(k);
  const auto calc = [&](double before) {
    MatrixXd all = MatrixXd::Constant(n, 2 * nv + 2 * nu + at.forces, before);  // by q, v, u, speeds, lambda
    VectorXd by_scale = VectorXd::Zero(n);
    residual.calcJacobian(view, {all.leftCols(nv), all.middleCols(nv, nv), all.rightCols(at.forces),
                                 all.middleCols(2 * nv, nu), all.middleCols(2 * nv + nu, nu), by_scale});
    return Pattern(all.array() != before);
  };
  const Pattern written = calc(0.3) || calc(-0.7);
  Pattern out = Pattern::Constant(n, at.columns, false);
  out.middleCols(at.q0, nv) = written.leftCols(nv);
  for (const auto& [first, block] : charts_[k].curved)
    for (int i = 0; i < n; ++i)
      out.row(i).segment(first, block.cols()).setConstant(written.row(i).segment(first, block.cols()).any());
  out.middleCols(at.v0, nv) = written.middleCols(nv, nv);
  if (isLast(k)) return out;
  out.middleCols(at.u, nu) = written.middleCols(2 * nv, nu);
  out.middleCols(at.lambda, at.forces) = written.rightCols(at.forces);
  for (int m = 0; m < nu; ++m)
    for (const int first : {at.v0, at.v1})
      out.col(first + model_.motors()[m].dof) = out.col(first + model_.motors()[m].dof) || written.col(2 * nv + nu + m);
  return out;
}

void Collocation::listPaths(int k) {
  Node& node = nodes_[k];
  int first = 0;
  size_t next = 0;
  for (const PathConstraint& constraint : problem_.spec(k).path_constraints) {
    const Pattern pattern = findPattern(k, *constraint.residual);
    for (; next < places_[k].kept.size() && places_[k].kept[next] < first + pattern.rows(); ++next) {
      node.path_columns.emplace_back();
      for (int j = 0; j < node.at.columns; ++j)
        if (node.z[j] >= 0 && pattern(places_[k].kept[next] - first, j)) node.path_columns.back().push_back(j);
    }
    first += constraint.residual->size();
  }
}

void Collocation::listCosts(int k) {
  Node& node = nodes_[k];
  const int columns = node.at.columns;
  Pattern pairs = Pattern::Constant(columns, columns, false);
  for (int i = 0; i < node.at.lambda; ++i) pairs(i, i) = true;  // of states and controls, and joints by themselves
  for (const int half : {node.at.q0, node.at.v0})
    for (const Joint& joint : model_.joints())
      pairs.block(half + joint.idx_v, half + joint.idx_v, joint.nv, joint.nv).setConstant(true);
  for (const Cost& cost : problem_.spec(k).costs) {
    const Pattern pattern = findPattern(k, *cost.residual);
    for (Eigen::Index row = 0; row < pattern.rows(); ++row)
      for (int j = 0; j < columns; ++j)
        if (pattern(row, j)) pairs.col(j) = pairs.col(j) || pattern.row(row).transpose();
  }
  for (int j = 0; j < columns; ++j)
    if (node.z[j] >= 0 && pairs(j, j)) node.cost_columns.push_back(j);
  const int size = static_cast<int>(node.cost_columns.size());
  for (int j = 0; j < size; ++j)
    for (int i = j; i < size; ++i)
      if (pairs(node.cost_columns[i], node.cost_columns[j])) node.cost_entries.emplace_back(i, j);
}

// In the order in which getJacobian() and getHessian() write.
void Collocation::listEntries() {
  for (size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    const int before = jacobian_.size();
    for (size_t i = 0; i < node.path_columns.size(); ++i)
      for (const int j : node.path_columns[i]) jacobian_.add(places_[k].c + static_cast<int>(i), node.z[j]);
    node.path_jacobian.resize(jacobian_.size() - before);
    for (const auto& [i, j] : node.step_entries) jacobian_.add(node.first + i, node.z[j]);
    node.step_jacobian.resize(static_cast<Eigen::Index>(node.step_entries.size()));
    for (const auto& [i, j] : node.cost_entries)
      hessian_.add(node.z[node.cost_columns[i]], node.z[node.cost_columns[j]]);
    node.hessian.resize(static_cast<Eigen::Index>(node.cost_entries.size()));
  }
}

// Forces are those of the problem's steps, given to the rows that are kept.
void Collocation::setStart() {
  start_.setZero(variables_.lower.size());
  for (int k = 0; k < static_cast<int>(nodes_.size()); ++k) {
    const Node& node = nodes_[k];
    if (k > 0) start_.segment(node.d + model_.nv(), model_.nv()) = guess_.xs[k].segment(model_.nq(), model_.nv());
    if (isLast(k)) continue;
    start_.segment(places_[k].u, places_[k].nu) = guess_.us[k].head(places_[k].nu);
    const auto& at = static_cast<const RobotEvaluation&>(*guesses_[k]);
    const int kept = static_cast<int>(loops_.size() + node.contacts.size());
    if (at.status != NumericalStatus::Ok || kept == 0) continue;
    const MatrixXd J = calcJacobian(problem_.spec(k).constraints, calcMidpoint(k));
    std::vector<int> rows = loops_;
    rows.insert(rows.end(), node.contacts.begin(), node.contacts.end());
    const VectorXd force = J.transpose() * at.lambda;
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(MatrixXd(pickRows(J, rows).transpose()));
    start_.segment(places_[k].u + places_[k].nu, kept) = VectorXd(qr.solve(force)) / weight_;
  }
}

}  // namespace bielle
