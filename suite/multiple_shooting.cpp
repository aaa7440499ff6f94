#include "multiple_shooting.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "model/joint.h"

namespace bielle {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A node without costs, whose one constraint is the residual.
StageSpec makeNode(StageSpec spec, const std::shared_ptr<const Residual>& residual) {
  spec.state = {};
  spec.control = {};
  spec.costs.clear();
  const VectorXd ones = VectorXd::Ones(residual->size());
  spec.path_constraints = {{"difference", residual, -kInfinite * ones, kInfinite * ones, ones}};
  return spec;
}

}  // namespace

// (q, v) (-) (q_ref, v_ref) in the coordinates of the tree.
class Charts::TreeDifference : public Residual {
 public:
  explicit TreeDifference(const Model& model) : q(VectorXd::Zero(model.nq())), v(VectorXd::Zero(model.nv())) {}
  int size() const override { return static_cast<int>(2 * v.size()); }
  void calc(const NodeView& node, VectorRef r) const override {
    r.head(v.size()) = node.model.difference(q, node.ws.q);
    r.tail(v.size()) = node.ws.v - v;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const VectorXd d = node.model.difference(q, node.ws.q);
    for (const Joint& joint : node.model.joints())
      if (joint.nv > 0)
        calcJointDifferenceJacobian(joint, d.segment(joint.idx_v, joint.nv),
                                    rows.q.block(joint.idx_v, joint.idx_v, joint.nv, joint.nv));
    rows.v.bottomRows(v.size()).setIdentity();
  }
  VectorXd q, v;  // the reference
};

Charts::Charts(const RobotProblem& problem)
    : difference_(std::make_shared<TreeDifference>(problem.model())),
      node_(problem.model(), problem.initialState().head(problem.model().nq()),
            problem.initialState().segment(problem.model().nq(), problem.model().nv()),
            {makeNode(problem.spec(problem.numStages()), difference_)}, problem.formulation()),
      evaluator_(node_) {}

NumericalStatus Charts::calc(const RowMatrixXd& P, const VectorXd& xg, const VectorXd& x, MatrixXd& T) {
  difference_->q = xg.head(difference_->q.size());
  difference_->v = xg.segment(difference_->q.size(), difference_->v.size());
  if (const NumericalStatus status = evaluator_.evaluate(0, x).status; status != NumericalStatus::Ok) return status;
  if (const NumericalStatus status = evaluator_.linearize(nullptr, model_); status != NumericalStatus::Ok)
    return status;
  T = (P * model_.Ct().transpose()).inverse();
  return T.allFinite() ? NumericalStatus::Ok : NumericalStatus::Singular;
}

MultipleShooting::MultipleShooting(const RobotProblem& problem, ShootingTrajectory guess)
    : NonlinearProgram(problem, std::move(guess)), charts_(problem) {
  listNodes();
  listEntries();
  start_.setZero(variables_.lower.size());
  for (size_t k = 0; k < guess_.us.size(); ++k) start_.segment(places_[k].u, places_[k].nu) = guess_.us[k];
  for (size_t k = 0; k < nodes_.size(); ++k) {
    evaluations_.push_back(problem.makeEvaluation());
    d_.push_back(VectorXd::Zero(problem.tangentSize(static_cast<int>(k))));
    ahead_.push_back(d_.back());
    const auto& at = static_cast<const RobotEvaluation&>(*guesses_[k]);
    if (k == 0 || at.status != NumericalStatus::Ok) continue;  // and so at the start, which evaluate() tells
    problem.mapGains(at, RowMatrixXd::Identity(nodes_[k].nd, nodes_[k].nd), nodes_[k].P);
  }
}

void MultipleShooting::listNodes() {
  int variable = 0, row = 0;
  for (size_t k = 0; k < places_.size(); ++k) {
    const int index = static_cast<int>(k);
    Place& place = places_[k];
    Node node;
    node.d = variable;
    node.nd = k > 0 ? problem_.tangentSize(index) : 0;
    place.u = node.d + node.nd;
    variable = place.u + place.nu;
    place.c = row;
    node.s = place.c + place.numRows();
    row = node.s + (k + 1 < places_.size() ? problem_.tangentSize(index + 1) : 0);
    nodes_.push_back(std::move(node));
  }
  setBounds(variable, row);
}

// In the order in which getJacobian() and getHessian() write.
void MultipleShooting::listEntries() {
  const auto addRow = [this](int row, size_t k, bool of_controls) {
    for (int j = 0; of_controls && j < places_[k].nu; ++j) jacobian_.add(row, places_[k].u + j);
    for (int j = 0; j < nodes_[k].nd; ++j) jacobian_.add(row, nodes_[k].d + j);
  };
  for (size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    const Place& place = places_[k];
    for (int i = 0; i < place.numRows(); ++i) addRow(place.c + i, k, dependsOnControls(*place.residuals[i]));
    for (int i = 0; k + 1 < nodes_.size() && i < nodes_[k + 1].nd; ++i) {
      addRow(node.s + i, k, true);
      jacobian_.add(node.s + i, nodes_[k + 1].d + i);
    }
    const int size = node.nd + place.nu;  // d_k, then u_k
    for (int j = 0; j < size; ++j)
      for (int i = j; i < size; ++i) hessian_.add(node.d + i, node.d + j);
  }
}

bool MultipleShooting::update() {
  const int count = static_cast<int>(nodes_.size());
  std::vector<IntegrateTask> sums;
  std::vector<EvaluateTask> tasks(count);
  std::vector<DifferenceTask> differences;
  for (int k = 0; k < count; ++k) {
    const Node& node = nodes_[k];
    EvaluateTask& task = tasks[k];
    task.node = k;
    task.x = &trajectory_.xs[k];
    task.out = evaluations_[k].get();
    if (k + 1 < count) {
      trajectory_.us[k] = z_.segment(places_[k].u, places_[k].nu);
      task.u = &trajectory_.us[k];
    }
    if (k == 0) continue;
    if (guesses_[k]->status != NumericalStatus::Ok)
      return fail("the guess cannot be evaluated at node " + std::to_string(k) + ": " + guesses_[k]->failure);
    d_[k] = z_.segment(node.d, node.nd);
    sums.push_back({k, guesses_[k].get(), &d_[k], &trajectory_.xs[k]});
    differences.push_back({k, guesses_[k].get(), &evaluations_[k - 1]->x_next, &ahead_[k]});
  }
  problem_.integrate(sums.data(), static_cast<int>(sums.size()), scratch_.get());
  for (int k = 1; k < count; ++k)
    if (!trajectory_.xs[k].allFinite()) return fail("the loops of node " + std::to_string(k) + " do not close");
  problem_.evaluate(tasks.data(), count, scratch_.get());
  for (int k = 0; k < count; ++k)
    if (evaluations_[k]->status != NumericalStatus::Ok)
      return fail("node " + std::to_string(k) + " cannot be evaluated: " + evaluations_[k]->failure);
  problem_.difference(differences.data(), static_cast<int>(differences.size()), scratch_.get());
  for (const VectorXd& ahead : ahead_)
    if (!ahead.allFinite()) return fail("a step leads too far from the guess");
  return true;
}

bool MultipleShooting::differentiate() {
  const int count = static_cast<int>(nodes_.size());
  std::vector<LinearizeTask> tasks(count);
  for (int k = 0; k < count; ++k) {
    Node& node = nodes_[k];
    const Place& place = places_[k];
    const int ndx = problem_.tangentSize(k), next = k + 1 < count ? problem_.tangentSize(k + 1) : 0;
    if (!node.model.hasSizes(ndx, place.nu, next)) node.model.resize(ndx, place.nu, next);
    node.model.setRows(static_cast<int>(place.wanted.size()));
    LinearizeTask& task = tasks[k];
    task.node = k;
    task.at = evaluations_[k].get();
    task.next = k + 1 < count ? guesses_[k + 1].get() : nullptr;
    task.rows = &place.wanted;
    task.out = &node.model;
  }
  problem_.linearize(tasks.data(), count, scratch_.get());
  for (int k = 0; k < count; ++k) {
    if (tasks[k].status != NumericalStatus::Ok)
      return fail("node " + std::to_string(k) + " has no derivatives: " + tasks[k].failure);
    if (k == 0) continue;
    const NumericalStatus status = charts_.calc(nodes_[k].P, guess_.xs[k], trajectory_.xs[k], nodes_[k].T);
    if (status != NumericalStatus::Ok)
      return fail("the coordinates about the guess end before node " + std::to_string(k) + ": " + getMessage(status));
  }
  return true;
}

void MultipleShooting::getRows(VectorRef out) const {
  getPathRows(out);
  for (size_t k = 0; k + 1 < nodes_.size(); ++k) out.segment(nodes_[k].s, nodes_[k + 1].nd) = ahead_[k + 1] - d_[k + 1];
}

void MultipleShooting::getGradient(VectorRef out) const {
  for (size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    if (places_[k].nu > 0) out.segment(places_[k].u, places_[k].nu) = node.model.lu;
    if (node.nd > 0) out.segment(node.d, node.nd) = node.T.transpose() * node.model.lx;
  }
}

void MultipleShooting::getJacobian(VectorRef values) const {
  Eigen::Index at = 0;
  const auto add = [&](const auto& column) {
    values.segment(at, column.size()) = column;
    at += column.size();
  };
  for (size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    const Place& place = places_[k];
    const ConstMatrixMap Ct = node.model.Ct(), Ft = node.model.Ft();
    MatrixXd by_c(node.nd, Ct.cols()), by_s(node.nd, Ft.cols());  // by d_k
    if (node.nd > 0) {
      by_c = node.T.transpose() * Ct.bottomRows(node.nd);
      by_s = node.T.transpose() * Ft.bottomRows(node.nd);
    }
    for (int i = 0; i < place.numRows(); ++i) {
      if (dependsOnControls(*place.residuals[i])) add(Ct.col(place.kept[i]).head(place.nu));
      add(by_c.col(place.kept[i]));
    }
    for (int i = 0; i < Ft.cols(); ++i) {
      add(Ft.col(i).head(place.nu));
      add(by_s.col(i));
      values[at++] = -1;
    }
  }
}

void MultipleShooting::getHessian(VectorRef values) const {
  Eigen::Index at = 0;
  for (size_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    const int nd = node.nd, nu = places_[k].nu;
    MatrixXd H(nd + nu, nd + nu);  // of d_k, then u_k
    H.bottomRightCorner(nu, nu) = node.model.luu();
    if (nd > 0) {
      const MatrixXd lxx = node.model.lxx().selfadjointView<Eigen::Lower>();
      H.topLeftCorner(nd, nd) = node.T.transpose() * lxx * node.T;
      H.bottomLeftCorner(nu, nd) = node.model.lux() * node.T;
    }
    for (int j = 0; j < nd + nu; ++j) {
      values.segment(at, nd + nu - j) = H.col(j).tail(nd + nu - j);
      at += nd + nu - j;
    }
  }
}

double MultipleShooting::calcGap() const {
  double worst = 0;
  for (size_t k = 1; k < nodes_.size(); ++k) worst = std::max(worst, (ahead_[k] - d_[k]).cwiseAbs().maxCoeff());
  return worst;
}

}  // namespace bielle
