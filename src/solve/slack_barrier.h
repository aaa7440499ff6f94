#pragma once
// Inequalities of a shooting problem by slacks and a barrier: the primal-dual interior point of fddp.h, Eqs. (14) to (17).
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

struct ConstraintWeights;

class SlackBarrier {
 public:
  /// Sums and maxima over slacks.
  struct Measures {
    double value = 0;            ///< of Eq. (14), without gaps
    double gap = 0;              ///< sum of y r
    double largest_gap = 0;      ///< of r
    double offset = 0;           ///< Eq. (17)
    double complementarity = 0;  ///< largest y s
  };

  void resize(size_t num_nodes);
  /// A slack for every finite bound of a node, except for equations.
  void setBounds(int node, const VectorXd& lower, const VectorXd& upper);
  bool isEmpty() const { return size_ == 0; }
  int getSize() const { return size_; }  ///< number of slacks
  void setParameter(double mu) { mu_ = mu; }
  double getParameter() const { return mu_; }
  /// Of gaps in the merit.
  void setGapWeight(double weight) { weight_ = weight; }

  /// Slacks of a node at c, and their multipliers: those given, or larger.
  void start(int node, const VectorXd& c, const VectorXd& multipliers);
  /// Slacks and multipliers after a step of length alpha that led to c, Eqs. (15) and (16).
  void step(int node, const VectorXd& c, double alpha);
  /// Of a trial of length alpha that led to c.
  double calc(int node, const VectorXd& c, double alpha) const;
  /// Adds Eq. (14) to the weights and multipliers of a node, and to the measures.
  void addWeights(int node, ConstraintWeights& weights, VectorXd& multipliers, Measures& measures) const;

 private:
  struct Side {
    int row = 0;
    double sign = 1, bound = 0;    // sign (c - bound) <= 0
    double s = 1, y = 1, gap = 0;  // gap: r
    double calcExcess(const VectorXd& c) const { return sign * (c[row] - bound); }
    double calcSlack(double excess, double alpha, double mu) const;
  };
  std::vector<std::vector<Side>> nodes_;
  int size_ = 0;
  double mu_ = 1, weight_ = 1;
};

}  // namespace bielle
