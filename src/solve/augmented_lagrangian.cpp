#include "solve/augmented_lagrangian.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace bielle {

namespace {

constexpr double kFall = 0.25;  // ratio to which a violation must decrease, or the penalty is raised
constexpr double kHalf = 0.5;   // the same by a step of settle()
// Below this violation the penalty is raised at every update, and multipliers converge the faster. Farther away a large
// penalty would only shorten the steps.
constexpr double kNear = 0.03, kNearPenalty = 1e3;  // the latter over the initial penalty, at most
// Foreseen decrease over the gain of new multipliers at which they are due; and while violations alone are minimized.
constexpr double kShare = 0.1, kRestorationShare = 1e-8;
constexpr double kFirst = 2;  // share of a step up to which bounds are met first, over the least one
// Penalty times squared violations over the cost, while violations alone are minimized.
constexpr double kRestorationWeight = 1e6;
constexpr double kDominance = 100;  // the same ratio, from which on the least violations are known to a per cent

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
    for (VectorXd* v : {&node.lower, &node.upper, &node.earlier, &node.weights.gradient, &node.weights.hessian})
      v->setZero(rows);
    problem.getConstraintBounds(k, node.lower, node.upper);
    if (!(node.lower.array() <= node.upper.array()).all())
      throw std::invalid_argument("FDDP: a lower bound of the constraints of node " + std::to_string(k) +
                                  " exceeds the upper");
    rows_ += rows;
  }
  if (!kept_) far_penalty_ = options.initial_penalty;
  penalty_ = far_penalty_;
  last_violation_ = std::numeric_limits<double>::infinity();
  at_ = {};
  num_updates_ = 0;
  kept_ = restoring_ = holds_ = ahead_ = false;
}

bool AugmentedLagrangian::addWeighted(int node, std::vector<char>& rows) const {
  const ConstraintWeights& weights = nodes_[node].weights;
  bool added = false;
  for (Eigen::Index i = 0; i < weights.gradient.size(); ++i) {
    if (rows[i] || (weights.gradient[i] == 0 && weights.hessian[i] == 0)) continue;
    rows[i] = added = true;
  }
  return added;
}

double AugmentedLagrangian::calcDistance(const Node& node, Eigen::Index row, double c) const {
  const double y = node.multipliers[row], z = c + y / penalty_;
  if (isHeld(node, row)) return z - (y > 0 ? node.upper : node.lower)[row];
  return z - clamp(z, node.lower[row], node.upper[row]);
}

double AugmentedLagrangian::calcContribution(double d, double multiplier) const {
  return 0.5 * penalty_ * d * d - 0.5 * multiplier * multiplier / penalty_;
}

double AugmentedLagrangian::calc(int node, const VectorXd& c) const {
  const Node& own = nodes_[node];
  double sum = 0;
  for (Eigen::Index i = 0; i < own.lower.size(); ++i)
    sum += calcContribution(calcDistance(own, i, c[i]), own.multipliers[i]);
  return sum;
}

void AugmentedLagrangian::evaluate(const EvaluationList& iterate) {
  holds_ = false;
  measure(iterate);
}

void AugmentedLagrangian::hold(const EvaluationList& iterate) {
  holds_ = true;
  measure(iterate);
}

template <class Visit>
void AugmentedLagrangian::visitInequalities(const EvaluationList& iterate, const EvaluationList& trial,
                                            const Visit& visit) {
  for (size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    const VectorXd &c = iterate[k]->constraints, &c_trial = trial[k]->constraints;
    for (Eigen::Index i = 0; i < node.lower.size(); ++i) {
      if (node.lower[i] == node.upper[i]) continue;
      const double violation = calcDistance(node, i, c_trial[i]), z = c[i] + node.multipliers[i] / penalty_;
      const double d = z - (violation > 0 ? node.upper : node.lower)[i];
      visit(Inequality{node.weights.gradient[i], node.weights.hessian[i], d, violation, calcDistance(node, i, c[i]),
                       c_trial[i] - c[i]});
    }
  }
}

bool AugmentedLagrangian::holdViolated(const EvaluationList& iterate, const EvaluationList& trial, bool keep) {
  const auto findShare = [](const Inequality& row) { return std::max(0.0, row.d / (row.d - row.violation)); };
  double first = std::numeric_limits<double>::infinity();
  visitInequalities(iterate, trial, [&](const Inequality& row) {
    if (row.violation != 0 && row.hessian == 0) first = std::min(first, findShare(row));
  });
  bool changes = false;
  at_.excess = 0;
  visitInequalities(iterate, trial, [&](const Inequality& row) {
    const bool held = row.hessian != 0;
    if (!keep || !held) {
      const bool holds = row.violation != 0 && (!keep || findShare(row) <= kFirst * first);
      changes |= holds != held;
      row.gradient = holds ? penalty_ * row.d : 0;
      row.hessian = holds ? penalty_ : 0;
    }
    at_.excess += 0.5 * (row.gradient * row.gradient / penalty_ - penalty_ * row.before * row.before);
  });
  return changes;
}

double AugmentedLagrangian::calcKinks(const EvaluationList& iterate, const EvaluationList& trial) {
  double kinks = 0;
  visitInequalities(iterate, trial, [&](const Inequality& row) {
    const double held = row.hessian != 0 ? row.gradient / penalty_ + row.move : 0;
    kinks += 0.5 * penalty_ * (row.violation * row.violation - held * held);
  });
  return kinks;
}

void AugmentedLagrangian::measure(const EvaluationList& iterate) {
  at_ = {};
  for (size_t k = 0; k < nodes_.size(); ++k) measure(static_cast<int>(k), iterate[k]->constraints, at_);
}

// Sets the weights of a node, and adds what it measures.
void AugmentedLagrangian::measure(int k, const VectorXd& c, Measures& out) {
  Node& node = nodes_[k];
  for (Eigen::Index i = 0; i < node.lower.size(); ++i) {
    const double violation = std::abs(c[i] - clamp(c[i], node.lower[i], node.upper[i]));
    out.squares += violation * violation;
    if (violation > out.violation || (std::isnan(violation) && !std::isnan(out.violation))) {  // the first NaN is kept
      out.violation = violation;
      out.worst_node = k;
      out.worst_row = static_cast<int>(i);
    }
    const double d = calcDistance(node, i, c[i]), y = penalty_ * d, change = y - node.multipliers[i];
    node.weights.gradient[i] = y;
    node.weights.hessian[i] = d != 0 || isHeld(node, i) || node.lower[i] == node.upper[i] ? penalty_ : 0;
    out.value += calcContribution(d, node.multipliers[i]);
    out.gain += change * change / (2 * penalty_);
    if (y != 0)
      out.complementarity = std::max(out.complementarity, std::abs(y * ((y > 0 ? node.upper : node.lower)[i] - c[i])));
  }
}

bool AugmentedLagrangian::isNear() const {
  const bool grows = options_.penalty_increase > 1 && penalty_ < options_.max_penalty;
  return !isEmpty() && !isSatisfied() && !restoring_ && grows && at_.violation < kNear;
}

bool AugmentedLagrangian::dominates(double cost) const {
  return restoring_ && penalty_ * at_.squares >= kDominance * std::abs(cost);
}

bool AugmentedLagrangian::isDue(double foreseen) const {
  return foreseen <= (restoring_ ? kRestorationShare : kShare) * at_.gain;
}

bool AugmentedLagrangian::updateMultipliers(const EvaluationList& iterate, double cost) {
  const bool falls = at_.violation <= std::max(kFall * last_violation_, options_.tolerance);
  if (restoring_ && !falls) return false;
  last_violation_ = at_.violation;
  ++num_updates_;
  if (!falls && penalty_ >= options_.max_penalty) {
    startRestoration(cost);
  } else {
    restoring_ = false;
    adoptMultipliers(iterate);
    if (!falls || !options_.multipliers) {
      far_penalty_ = std::min(options_.max_penalty, options_.penalty_increase * far_penalty_);
      penalty_ = std::min(options_.max_penalty, options_.penalty_increase * penalty_);
    } else if (at_.violation < kNear) {
      const double most = std::min(options_.max_penalty, kNearPenalty * options_.initial_penalty);
      penalty_ = std::max(penalty_, std::min(most, options_.penalty_increase * penalty_));
    }
  }
  evaluate(iterate);
  return true;
}

bool AugmentedLagrangian::restore(const EvaluationList& iterate, double cost) {
  if (restoring_) return false;
  last_violation_ = at_.violation;
  startRestoration(cost);
  evaluate(iterate);
  return true;
}

void AugmentedLagrangian::renewAhead(const EvaluationList& iterate) {
  for (size_t k = 1; k < nodes_.size(); ++k) renew(iterate, static_cast<int>(k));
  ahead_ = true;
}

void AugmentedLagrangian::renewFirst(const EvaluationList& iterate) {
  renew(iterate, 0);
  ahead_ = false;
  ++num_updates_;
}

void AugmentedLagrangian::renew(const EvaluationList& iterate, int k) {
  Node& node = nodes_[k];
  Measures unused;
  holds_ = false;
  measure(k, iterate[k]->constraints, unused);
  node.earlier = node.multipliers;
  if (options_.multipliers) node.multipliers = node.weights.gradient;
  holds_ = true;
  measure(k, iterate[k]->constraints, unused);
}

void AugmentedLagrangian::takeBack() {
  for (size_t k = std::exchange(ahead_, false) ? 1 : 0; k < nodes_.size(); ++k)
    nodes_[k].multipliers.swap(nodes_[k].earlier);
}

bool AugmentedLagrangian::settle(const EvaluationList& iterate, bool full) {
  const bool falls = at_.violation <= kHalf * last_violation_;
  last_violation_ = at_.violation;
  if (penalty_ < options_.max_penalty) {
    penalty_ = std::min(options_.max_penalty, options_.penalty_increase * penalty_);
  } else if (full && !falls) {
    ++num_updates_;
    adoptMultipliers(iterate);
  }
  evaluate(iterate);
  return falls;
}

void AugmentedLagrangian::endSettling(const EvaluationList& iterate) {
  penalty_ = far_penalty_;
  last_violation_ = std::numeric_limits<double>::infinity();
  evaluate(iterate);
}

void AugmentedLagrangian::startRestoration(double cost) {
  restoring_ = true;
  penalty_ =
      std::clamp(kRestorationWeight * std::abs(cost) / at_.squares, options_.initial_penalty, options_.max_penalty);
  for (Node& node : nodes_) node.multipliers.setZero();
}

void AugmentedLagrangian::adoptMultipliers(const EvaluationList& iterate) {
  for (Node& node : nodes_) node.earlier = node.multipliers;
  if (!options_.multipliers) return;
  if (holds_) evaluate(iterate);  // Eq. (12) is of the d of Eq. (10)
  for (Node& node : nodes_) node.multipliers = node.weights.gradient;
}

double AugmentedLagrangian::largestMultiplier() const {
  double largest = 0;
  for (const Node& node : nodes_)
    if (node.multipliers.size() > 0) largest = std::max(largest, node.multipliers.lpNorm<Eigen::Infinity>());
  return largest;
}

Multipliers AugmentedLagrangian::multipliers() const {
  Multipliers out;
  for (const Node& node : nodes_) out.values.push_back(node.multipliers);
  out.penalty = far_penalty_;
  return out;
}

void AugmentedLagrangian::setMultipliers(const Multipliers& multipliers) {
  if (!(multipliers.penalty > 0)) throw std::invalid_argument("FDDP: the penalty of multipliers must be positive");
  ahead_ = false;
  nodes_.resize(multipliers.values.size());
  for (size_t k = 0; k < nodes_.size(); ++k) nodes_[k].multipliers = multipliers.values[k];
  far_penalty_ = multipliers.penalty;
  kept_ = true;
}

void AugmentedLagrangian::move(const std::vector<NodeSource>& sources) {
  const size_t num_nodes = nodes_.size();
  if (num_nodes != sources.size()) return;  // no solve so far
  if (ahead_) takeBack();
  // The first of the nodes that have the same source takes its memory, too: most are as large as that.
  moved_.resize(num_nodes);
  takers_.assign(num_nodes, -1);
  for (size_t k = num_nodes; k-- > 0;) takers_.at(sources[k].node) = static_cast<int>(k);
  const auto takes = [&](size_t k) { return takers_[sources[k].node] == static_cast<int>(k); };
  for (size_t k = 0; k < num_nodes; ++k)
    if (!takes(k)) moved_[k].multipliers = sources[k].share * nodes_[sources[k].node].multipliers;
  for (size_t k = 0; k < num_nodes; ++k) {
    if (!takes(k)) continue;
    std::swap(moved_[k], nodes_[sources[k].node]);
    moved_[k].multipliers *= sources[k].share;
  }
  nodes_.swap(moved_);
  kept_ = true;
}

std::string AugmentedLagrangian::describeWorst(const ShootingProblem& problem) const {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << problem.getConstraintName(at_.worst_node, at_.worst_row) << " at node " << at_.worst_node;
  if (std::isnan(at_.violation))
    out << " is not a number";
  else
    out << " is violated by " << std::setprecision(3) << at_.violation;
  return out.str();
}

}  // namespace bielle
