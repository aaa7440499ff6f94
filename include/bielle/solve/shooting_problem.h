#pragma once
/// \file The optimal control problem as a solver sees it (the paper's eq. 1), on manifolds.
///
///     min  sum_k l_k(x_k, u_k) + l_N(x_N)    s.t.  x_0 given,  x_{k+1} = f_k(x_k, u_k),   k = 0 .. N-1,
///                                                  lower_k <= c_k(x_k, u_k) <= upper_k,   k = 0 .. N
///
/// A state x is a vector of numbers (e.g. quaternions) that represents a point of a manifold; the tangent space at node
/// k has its own dimension. The solver knows no robot: it requests evaluations, differences and quadratic models.
///
/// A problem is immutable while it is solved. The result of evaluating a node is a value, a NodeEvaluation, which the
/// solver keeps and hands back: derivatives and tangent spaces are those of an evaluation, never of "the last call".
/// Every function takes several tasks at once, which a problem may process together; results must not depend, not even
/// in the last bit, on batching or order. Different threads may call at the same time, each with its own scratch.
/// Exceptions are for programming errors: the solver passes them on unchanged.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// A block of a larger matrix, and the transpose of one.
using MatrixMap = Eigen::Map<MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixMap = Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>>;
using RowMatrixMap = Eigen::Map<RowMatrixXd, 0, Eigen::OuterStride<>>;
using ConstRowMatrixMap = Eigen::Map<const RowMatrixXd, 0, Eigen::OuterStride<>>;

/// Quadratic model of one stage about (x_k, u_k), in tangent coordinates at x_k and at the node state x_{k+1}:
///     dx_{k+1} = Fx dx_k + Fu du_k + gap
///     l = cost + lx.dx + lu.du + 1/2 (dx.lxx.dx + 2 du.lux.dx + du.luu.du)
///     c = c_k + Cx dx_k + Cu du_k      (constraints, in the rows that were wanted)
/// The terminal node has only cost, lx, lxx and Cx: its other sizes are zero.
///
/// The matrices are views of three that are stored as the sweep needs them: F^T = [Fu Fx]^T, C^T = [Cu Cx]^T, and the lower
/// triangle of the Hessian [luu . ; lux^T lxx], all with columns aligned to the processor's vector registers.
class StageModel {
 public:
  VectorXd gap;  ///< ndx_{k+1}: difference(x_{k+1}, f_k(x_k, u_k))
  double cost = 0;
  VectorXd lx;  ///< ndx_k
  VectorXd lu;  ///< nu_k

  /// Sets the sizes, and all entries to zero.
  /// \param rows  of the constraints
  void resize(int ndx, int nu, int ndx_next, int rows = 0);
  /// Changes the number of constraints alone, without allocation if it has been as large before.
  void setRows(int rows);
  bool hasSizes(int ndx, int nu, int ndx_next) const;

  RowMatrixMap Fx() { return {Ft_.data() + nu_, ndx_next_, ndx_, stride()}; }  ///< ndx_{k+1} x ndx_k
  RowMatrixMap Fu() { return {Ft_.data(), ndx_next_, nu_, stride()}; }         ///< ndx_{k+1} x nu_k
  ConstRowMatrixMap Fx() const { return {Ft_.data() + nu_, ndx_next_, ndx_, stride()}; }
  ConstRowMatrixMap Fu() const { return {Ft_.data(), ndx_next_, nu_, stride()}; }

  /// ndx_k x ndx_k, symmetric: only the lower triangle is written and read
  MatrixMap lxx() { return {hessian_.data() + nu_ * (1 + stride_), ndx_, ndx_, stride()}; }
  RowMatrixMap lux() { return {hessian_.data() + nu_, nu_, ndx_, stride()}; }  ///< nu_k x ndx_k
  MatrixMap luu() { return {hessian_.data(), nu_, nu_, stride()}; }            ///< nu_k x nu_k, likewise
  ConstMatrixMap lxx() const { return {hessian_.data() + nu_ * (1 + stride_), ndx_, ndx_, stride()}; }
  ConstRowMatrixMap lux() const { return {hessian_.data() + nu_, nu_, ndx_, stride()}; }
  ConstMatrixMap luu() const { return {hessian_.data(), nu_, nu_, stride()}; }

  /// (nu_k + ndx_k) x ndx_{k+1}, x constraintSize and square
  MatrixMap Ft() { return {Ft_.data(), nu_ + ndx_, ndx_next_, stride()}; }
  MatrixMap Ct() { return {Ct_.data(), nu_ + ndx_, rows_, stride()}; }
  MatrixMap hessian() { return {hessian_.data(), nu_ + ndx_, nu_ + ndx_, stride()}; }
  ConstMatrixMap Ft() const { return {Ft_.data(), nu_ + ndx_, ndx_next_, stride()}; }
  ConstMatrixMap Ct() const { return {Ct_.data(), nu_ + ndx_, rows_, stride()}; }
  ConstMatrixMap hessian() const { return {hessian_.data(), nu_ + ndx_, nu_ + ndx_, stride()}; }

 private:
  Eigen::OuterStride<> stride() const { return Eigen::OuterStride<>(stride_); }

  Eigen::Index ndx_ = 0, nu_ = 0, ndx_next_ = 0, rows_ = 0;
  Eigen::Index stride_ = 0;  // nu + ndx, rounded up to full registers; the padding is finite
  VectorXd Ft_, Ct_, hessian_;
};

/// A numerical failure is a status, never an exception or a NaN passed on.
/// A node evaluated at (x, u). Problems derive their own class from it, with the data that derivatives will need. It
/// belongs to the problem that made it and can be reused for any of its nodes.
struct NodeEvaluation {
  virtual ~NodeEvaluation() = default;
  VectorXd x;            ///< stateSize
  VectorXd u;            ///< controlSize; not used at the terminal node
  VectorXd x_next;       ///< f_k(x, u), stateSize; not used at the terminal node
  double cost = 0;       ///< l_k(x, u), or l_N(x)
  VectorXd constraints;  ///< c_k(x, u), or c_N(x), constraintSize
  NumericalStatus status = NumericalStatus::Failed;
  std::string failure;  ///< why the status is not Ok, for messages; may be empty
};

struct EvaluateTask {
  int node = 0;                 ///< in [0, N]
  const VectorXd* x = nullptr;  ///< may be out->x
  const VectorXd* u = nullptr;  ///< may be out->u; not read at the terminal node
  /// The evaluation of the previous node, if x is its x_next to the last bit: reusing its data saves time and changes
  /// no bit of the result.
  const NodeEvaluation* previous = nullptr;
  NodeEvaluation* out = nullptr;  ///< from makeEvaluation() of this problem; its content is overwritten
};

struct LinearizeTask {
  int node = 0;                  ///< in [0, N]
  NodeEvaluation* at = nullptr;  ///< its status is Ok; derivatives may be kept there
  /// The evaluation of node + 1, whose x is the node state to which the gap leads; null at the terminal node.
  const NodeEvaluation* next = nullptr;
  /// Non-zero for the constraints whose derivatives are wanted (constraintSize); other columns of C^T are not read and may be left
  /// as they are. Null: none.
  const std::vector<char>* rows = nullptr;
  StageModel* out = nullptr;  ///< of the right sizes; its content is overwritten
  NumericalStatus status = NumericalStatus::Failed;
  std::string failure;  ///< why the status is not Ok, for messages; may be empty
};

/// x_out = x (+) dx about the state of an evaluation, in the tangent space that its derivatives refer to.
struct IntegrateTask {
  int node = 0;
  const NodeEvaluation* at = nullptr;
  const VectorXd* dx = nullptr;
  VectorXd* x_out = nullptr;  ///< not finite after a failure
};

/// dx with x (+) dx = x1.
struct DifferenceTask {
  int node = 0;
  const NodeEvaluation* at = nullptr;
  const VectorXd* x1 = nullptr;
  VectorXd* dx = nullptr;  ///< tangentSize(node)
};

/// Memory of one thread for calls of one problem.
struct ProblemScratch {
  virtual ~ProblemScratch() = default;
};

class ShootingProblem {
 public:
  virtual ~ShootingProblem() = default;

  /// Identifies the problem: no two have the same, and a copy has its own. Evaluations and scratch belong to one
  /// problem.
  std::uint64_t id() const { return id_.value; }

  virtual int numStages() const = 0;             ///< N; there are N + 1 nodes
  virtual int stateSize() const = 0;             ///< size of x, the same at every node
  virtual int tangentSize(int node) const = 0;   ///< node in [0, N]
  virtual int controlSize(int stage) const = 0;  ///< stage in [0, N)
  virtual const VectorXd& initialState() const = 0;
  /// Bounds of the controls of a stage (nu each), which solvers keep; infinite if there are none.
  virtual void getControlBounds(int stage, VectorRef lower, VectorRef upper) const;
  /// Whether any of them is finite.
  bool hasControlBounds() const;

  /// Rows of c_k, node in [0, N].
  virtual int constraintSize(int) const { return 0; }
  /// Bounds of c_k; equal ones make an equation, infinite ones leave a side open. They and c_k should be scaled such that a
  /// violation of 1 is a large one.
  virtual void getConstraintBounds(int node, VectorRef lower, VectorRef upper) const;
  /// Name of a row of c_k for messages, e.g. "wrench cone of foot_left".
  virtual std::string getConstraintName(int node, int row) const;

  virtual std::unique_ptr<NodeEvaluation> makeEvaluation() const;
  virtual std::unique_ptr<ProblemScratch> makeScratch() const { return nullptr; }

  /// Computes f_k and l_k, or l_N. Several tasks may have the same node, each with its own `out`; no task's `previous`
  /// is another's `out`. Evaluations that held nodes of the same sizes before are filled without allocation.
  virtual void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  /// Quadratic models about evaluations.
  virtual void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const = 0;
  virtual void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const = 0;
  /// Number of tasks per call for best speed.
  virtual int batchSize() const { return 1; }

 private:
  struct Id {
    Id();
    Id(const Id&) : Id() {}
    Id& operator=(const Id&);
    std::uint64_t value;
  };
  Id id_;
};

/// A problem that processes one task at a time.
class NodewiseProblem : public ShootingProblem {
 public:
  virtual void evaluate(EvaluateTask& task, ProblemScratch* scratch) const = 0;
  virtual void linearize(LinearizeTask& task, ProblemScratch* scratch) const = 0;
  virtual void integrate(const IntegrateTask& task, ProblemScratch* scratch) const = 0;
  virtual void difference(const DifferenceTask& task, ProblemScratch* scratch) const = 0;

  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const final;
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const final;
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch* scratch) const final;
  void difference(const DifferenceTask* tasks, int count, ProblemScratch* scratch) const final;
};

/// Node states (N + 1) and controls (N) of a shooting problem.
struct ShootingTrajectory {
  std::vector<VectorXd> xs, us;
};

/// Evaluates one node at a time, outside a solver. Owns an evaluation and its scratch. No allocation after the first node of the same sizes.
class NodeEvaluator {
 public:
  /// The problem must outlive it.
  explicit NodeEvaluator(const ShootingProblem& problem);

  /// Dynamics and cost of a node at (x, u), kept until the next call; u is not read at the terminal node.
  const NodeEvaluation& evaluate(int node, const VectorXd& x, const VectorXd& u = VectorXd());
  /// Quadratic model about the last evaluation, which must be Ok, with all constraints.
  /// \param next  evaluation of the next node; null at the terminal node
  NumericalStatus linearize(const NodeEvaluation* next, StageModel& out);
  /// x (+) dx and x1 (-) x about the state x of the last evaluation.
  VectorXd integrate(const VectorXd& dx);
  VectorXd difference(const VectorXd& x1);

  const NodeEvaluation& evaluation() const { return *at_; }

 private:
  const ShootingProblem& problem_;
  std::unique_ptr<NodeEvaluation> at_;
  std::unique_ptr<ProblemScratch> scratch_;
  std::vector<char> rows_;
  int node_ = 0;
};

}  // namespace bielle
