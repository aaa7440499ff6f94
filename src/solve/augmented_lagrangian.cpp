#include "solve/augmented_lagrangian.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace bielle {

namespace {

constexpr double kFall = 0.25;  // by which a violation must fall, or the penalty grows
// Of the squared violations over the cost, when violations alone are to be minimized.
constexpr double kRestorationWeight = 1e6;

double clamp(double value, double lower, double upper) { return std::min(std::max(value, lower), upper); }

}  // namespace

void AugmentedLagrangian::resize(const ShootingProblem& problem, const ConstraintOptions& options) {
  options_ = options;
  const int num_nodes = problem.numStages() + 1;
  if (static_cast<int>(nodes_.size()) != num_nodes) {
    nodes_.assign(num_nodes, {});
    kept_ = false;
  }
  rows_ = 0;
  for (int k = 0; k < num_nodes; ++k) {
    Node& node = nodes_[k];
    const int rows = problem.constraintSize(k);
    if (!kept_ || node.multipliers.size() != rows) node.multipliers.setZero(rows);
    for (VectorXd* v : {&node.lower, &node.upper, &node.weights.gradient, &node.weights.hessian}) v->setZero(rows);
    problem.getConstraintBounds(k, node.lower, node.upper);
    if (!(node.lower.array() <= node.upper.array()).all())
      throw std::invalid_argument("Fddp: a lower bound of the constraints of node " + std::to_string(k) +
                                  " exceeds the upper");
    rows_ += rows;
  }
  if (!kept_) penalty_ = options.initial_penalty;
  last_violation_ = std::numeric_limits<double>::infinity();
  value_ = gain_ = violation_ = complementarity_ = 0;
  num_raises_ = 0;
  kept_ = restoring_ = false;
}

double AugmentedLagrangian::Node::calcDistance(double c, Eigen::Index row, double penalty) const {
  const double z = c + multipliers[row] / penalty;
  return z - clamp(z, lower[row], upper[row]);
}

double AugmentedLagrangian::calc(int node, const VectorXd& c) const {
  const Node& own = nodes_[node];
  double sum = 0;
  for (Eigen::Index i = 0; i < own.lower.size(); ++i) {
    const double d = own.calcDistance(c[i], i, penalty_), y = own.multipliers[i];
    sum += 0.5 * penalty_ * d * d - 0.5 * y * y / penalty_;
  }
  return sum;
}

void AugmentedLagrangian::update(const EvaluationList& iterate) {
  value_ = gain_ = violation_ = complementarity_ = squares_ = 0;
  worst_node_ = worst_row_ = 0;
  for (size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    const VectorXd& c = iterate[k]->constraints;
    for (Eigen::Index i = 0; i < node.lower.size(); ++i) {
      const double d = node.calcDistance(c[i], i, penalty_);
      node.weights.gradient[i] = penalty_ * d;
      node.weights.hessian[i] = d != 0 || node.lower[i] == node.upper[i] ? penalty_ : 0;
      gain_ += std::pow(penalty_ * d - node.multipliers[i], 2) / (2 * penalty_);
      const double y = node.multipliers[i], bound = y > 0 ? node.upper[i] : node.lower[i];
      if (y != 0) complementarity_ = std::max(complementarity_, std::abs(y * (bound - c[i])));
      const double violation = std::abs(c[i] - clamp(c[i], node.lower[i], node.upper[i]));
      squares_ += violation * violation;
      if (violation <= violation_) continue;
      violation_ = violation;
      worst_node_ = static_cast<int>(k);
      worst_row_ = static_cast<int>(i);
    }
    if (node.lower.size() > 0) value_ += calc(static_cast<int>(k), c);
  }
}

bool AugmentedLagrangian::raise(const EvaluationList& iterate, double cost) {
  const bool falls = violation_ <= std::max(kFall * last_violation_, options_.tolerance);
  if (restoring_ && !falls) return false;
  last_violation_ = violation_;
  ++num_raises_;
  if (!falls && penalty_ >= options_.max_penalty) {
    startRestoration(cost);
  } else {
    restoring_ = false;
    settle();
    if (!falls) penalty_ = std::min(options_.max_penalty, options_.penalty_increase * penalty_);
  }
  update(iterate);
  return true;
}

void AugmentedLagrangian::startRestoration(double cost) {
  restoring_ = true;
  penalty_ = std::clamp(kRestorationWeight * std::abs(cost) / squares_, options_.initial_penalty, options_.max_penalty);
  for (Node& node : nodes_) node.multipliers.setZero();
}

void AugmentedLagrangian::settle() {
  for (Node& node : nodes_) node.multipliers = node.weights.gradient;
}

double AugmentedLagrangian::getLargestMultiplier() const {
  double largest = 0;
  for (const Node& node : nodes_)
    if (node.multipliers.size() > 0) largest = std::max(largest, node.multipliers.lpNorm<Eigen::Infinity>());
  return largest;
}

Multipliers AugmentedLagrangian::getMultipliers() const {
  Multipliers out;
  for (const Node& node : nodes_) out.values.push_back(node.multipliers);
  out.penalty = penalty_;
  return out;
}

void AugmentedLagrangian::setMultipliers(const Multipliers& multipliers) {
  if (!(multipliers.penalty > 0)) throw std::invalid_argument("Fddp: the penalty of multipliers must be positive");
  nodes_.resize(multipliers.values.size());
  for (size_t k = 0; k < nodes_.size(); ++k) nodes_[k].multipliers = multipliers.values[k];
  penalty_ = multipliers.penalty;
  kept_ = true;
}

void AugmentedLagrangian::advance() {
  const size_t num_nodes = nodes_.size();
  if (num_nodes < 3) return;
  for (size_t k = 0; k + 2 < num_nodes; ++k) nodes_[k].multipliers.swap(nodes_[k + 1].multipliers);
  nodes_[num_nodes - 2].multipliers = nodes_[num_nodes - 3].multipliers;
  kept_ = true;
}

std::string AugmentedLagrangian::describeWorst(const ShootingProblem& problem) const {
  std::ostringstream out;
  out << problem.getConstraintName(worst_node_, worst_row_) << " at node " << worst_node_ << " is violated by "
      << std::setprecision(3) << violation_;
  return out.str();
}

}  // namespace bielle
