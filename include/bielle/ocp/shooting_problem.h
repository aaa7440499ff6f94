#pragma once
/// \file The optimal control problem as a solver sees it (the paper's eq. 1), on manifolds.
///
///     min  sum_k l_k(x_k, u_k) + l_N(x_N)    s.t.  x_0 given,  x_{k+1} = f_k(x_k, u_k),   k = 0 .. N-1
///
/// A state x is a vector of numbers (quaternions, say) that stands for a point of a manifold; the tangent space at node
/// k has its own dimension. The solver knows no robot: it asks for steps, differences and quadratic models.
#include <string>
#include <vector>

#include "bielle/math/lane_product.h"

namespace bielle {

/// Quadratic model of one stage about (x_k, u_k), in tangent coordinates at x_k and at the node state x_{k+1}:
///     dx_{k+1} = Fx dx_k + Fu du_k + gap
///     l = cost + lx.dx + lu.du + 1/2 (dx.lxx.dx + 2 du.lux.dx + du.luu.du)
/// At the terminal node cost, lx and lxx only: its other sizes are zero.
///
/// The matrices are views of two that are kept the way the sweep works on them (lane_product.h): F^T = [Fu Fx]^T, and the
/// lower triangle of the Hessian [luu . ; lux^T lxx].
class StageModel {
 public:
  VectorXd gap;  ///< ndx_{k+1}: difference(x_{k+1}, f_k(x_k, u_k))
  double cost = 0;
  VectorXd lx;  ///< ndx_k
  VectorXd lu;  ///< nu_k

  /// All of it zero.
  void resize(int ndx, int nu, int ndx_next);
  /// Exchanges the memory of H() for another piece of at least its size, numbers and all; without any, it must not be used.
  void swapHessian(VectorXd& memory) { H_.swap(memory); }
  bool hasSizes(int ndx, int nu, int ndx_next) const;

  RowMatrixMap Fx() { return {Ft_.data() + nu_, ndx_next_, ndx_, getStride()}; }  ///< ndx_{k+1} x ndx_k
  RowMatrixMap Fu() { return {Ft_.data(), ndx_next_, nu_, getStride()}; }         ///< ndx_{k+1} x nu_k
  ConstRowMatrixMap Fx() const { return {Ft_.data() + nu_, ndx_next_, ndx_, getStride()}; }
  ConstRowMatrixMap Fu() const { return {Ft_.data(), ndx_next_, nu_, getStride()}; }

  /// ndx_k x ndx_k, symmetric: only the lower triangle is written and read
  PaddedMap lxx() { return {H_.data() + nu_ * (1 + getRows()), ndx_, ndx_, getStride()}; }
  RowMatrixMap lux() { return {H_.data() + nu_, nu_, ndx_, getStride()}; }  ///< nu_k x ndx_k
  PaddedMap luu() { return {H_.data(), nu_, nu_, getStride()}; }            ///< nu_k x nu_k, likewise
  ConstPaddedMap lxx() const { return {H_.data() + nu_ * (1 + getRows()), ndx_, ndx_, getStride()}; }
  ConstRowMatrixMap lux() const { return {H_.data() + nu_, nu_, ndx_, getStride()}; }
  ConstPaddedMap luu() const { return {H_.data(), nu_, nu_, getStride()}; }

  /// (nu_k + ndx_k) x ndx_{k+1} and (nu_k + ndx_k) square; what is written to the padding must be finite
  PaddedMap Ft() { return {Ft_.data(), nu_ + ndx_, ndx_next_, getStride()}; }
  PaddedMap H() { return {H_.data(), nu_ + ndx_, nu_ + ndx_, getStride()}; }
  ConstPaddedMap Ft() const { return {Ft_.data(), nu_ + ndx_, ndx_next_, getStride()}; }
  ConstPaddedMap H() const { return {H_.data(), nu_ + ndx_, nu_ + ndx_, getStride()}; }

 private:
  Eigen::Index getRows() const { return roundUpToLane(nu_ + ndx_); }
  Eigen::OuterStride<> getStride() const { return Eigen::OuterStride<>(getRows()); }

  Eigen::Index ndx_ = 0, nu_ = 0, ndx_next_ = 0;
  VectorXd Ft_, H_;
};

/// Result of a step or of a cost evaluation. A numerical failure is a value, never an exception or a NaN handed on.
enum class StepStatus { Ok, Failed };

/// One step of several.
struct StepTask {
  int stage = 0;
  bool continues = false;  ///< as continueStep()
  const VectorXd *x = nullptr, *u = nullptr;
  VectorXd* x_next = nullptr;
  const VectorXd* origin = nullptr;    ///< where `deviation` is wanted: the state it is about
  VectorXd* deviation = nullptr;       ///< out: x_next as difference() from it, at the next node
  double cost = 0;                     ///< out
  StepStatus status = StepStatus::Ok;  ///< out
};

/// One integrate() of several.
struct IntegrateTask {
  int node = 0;
  const VectorXd *x = nullptr, *dx = nullptr;
  VectorXd* x_out = nullptr;  ///< out
};

class ShootingProblem {
 public:
  virtual ~ShootingProblem() = default;

  virtual int numStages() const = 0;             ///< N; there are N + 1 nodes
  virtual int stateSize() const = 0;             ///< numbers in a state, the same at every node
  virtual int tangentSize(int node) const = 0;   ///< node in [0, N]
  virtual int controlSize(int stage) const = 0;  ///< stage in [0, N)
  virtual const VectorXd& initialState() const = 0;

  /// x_out = x (+) dx. x_out may alias x.
  virtual void integrate(int node, ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) const = 0;
  /// integrate() at several different nodes by one thread, for problems that do so at once for less. What comes out must not
  /// depend on which nodes come together.
  virtual void integrateNodes(const std::vector<IntegrateTask>& tasks) const;
  /// dx with x0 (+) dx = x1.
  virtual void difference(int node, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const = 0;

  /// x_next = f_k(x, u) and the running cost l_k(x, u).
  /// Calls for different stages may run at the same time; those of one stage may not.
  virtual StepStatus step(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) = 0;
  /// step() for an x that step() or continueStep() of the stage before returned just now, to the same thread: a problem may
  /// take over what it computed there.
  virtual StepStatus continueStep(int stage, ConstVectorRef x, ConstVectorRef u, VectorRef x_next, double& cost) {
    return step(stage, x, u, x_next, cost);
  }
  /// step(), or continueStep(), of several different stages by one thread, for problems that do them at once for less. What
  /// comes out must not depend on which stages come together, unless they come alone.
  virtual void stepStages(std::vector<StepTask>& tasks);
  virtual StepStatus calcTerminalCost(ConstVectorRef x, double& cost) = 0;

  /// Quadratic model of stage k about (x, u) with the gap to the node state x_next_node. Same threading rule as step(). `out`
  /// has its sizes, if it comes from a solver, and holds anything.
  virtual StepStatus linearize(int stage, ConstVectorRef x, ConstVectorRef u, ConstVectorRef x_next_node,
                               StageModel& out) = 0;
  /// linearize() of the stages [begin, end) about a trajectory (indexed by node, like the models and statuses), for problems
  /// that do several at once for less. What comes out must not depend on which stages come together, unless some of them were
  /// stepped alone.
  virtual void linearizeStages(int begin, int end, const std::vector<VectorXd>& xs, const std::vector<VectorXd>& us,
                               std::vector<StageModel>& models, std::vector<StepStatus>& statuses);
  /// How many stages stepStages() and linearizeStages() are best given.
  virtual int getBatchSize() const { return 1; }
  virtual StepStatus linearizeTerminal(ConstVectorRef x, StageModel& out) = 0;

  /// Bounds of the controls of a stage (nu each), infinite where there are none.
  virtual void getControlBounds(int stage, VectorRef lower, VectorRef upper) const;

  /// Why the last call at a node failed, for messages; empty when it did not, or nothing is known.
  virtual std::string getFailure(int node) const;
};

}  // namespace bielle
