#pragma once
// The reduced formulation: robot_problem.h Eq. (3) and its derivatives. Written for one block of loops with bases N, J, J^+
// and metric W (reduction.h) at q, and N', J', J'^+ at q+; a free joint is the case N = N' = W = I without rows.
//
// A tangent vector (dy, dy_v) at the state means
//     dq = N dy,   dv = N dy_v + Z dy,   Z = -J^+ d(J v)/dq N                                                         (a)
// since J v = 0 is kept. Dynamics: with a = N y' + a_d, a_d = -J^+ gamma, and hats for projections by N^T from both sides,
//     M^ y' - (J_c N)^T lambda_c = N^T (tau - b - M a_d),    (J_c N) y' = -gamma_c - J_c a_d                          (b)
// where c are the contacts. The loop forces, which N^T hides, balance what is left: J^T lambda_l = M a + b - tau - J_c^T lambda_c.
// Derivatives at fixed lambda_l, lambda_c, with C the derivatives of the closure accelerations:
//     da = N dy' + d_y dy + d_v dy_v,   d_y = -J^+ (C_q N + C_v Z),   d_v = -J^+ C_v N                                (c)
// and those of inverse dynamics in these coordinates (reduced_derivatives.h); likewise for the contact rows.          (d)
// Step: w = v + h a; e is the displacement before closing, A = h J' J_d W^{-1} J^T, H = d(J^T zeta)/dq,
// S = N'^T d(J'^T mu)/dq N':
//     e = (J_q - h J_d W^{-1} H) dq + h J_d dw                                                                        (e)
//     dq+ = e - h J_d W^{-1} J^T A^{-1} J' e,     dw' = dw - W^{-1} H dq - W^{-1} J^T A^{-1} J' e                     (f)
//     dy+ = (W N')^T dq+,   dy_v+ = (W N')^T dw' - S dy+,   mu = J'^{+T} W w'                                         (g)
// S is there because the projection of w' turns with q+. With a gap, the result is read about the node state's own basis.
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "bielle/dynamics/reduced_derivatives.h"
#include "node_model.h"

namespace bielle {

// What a block needs within a call, n = nv, m rows of the closures, r reduced coordinates.
struct BlockWork {
  explicit BlockWork(const LoopBlock& l) : scratch(l) {
    const int n = l.model.nv(), m = l.closures.rows, r = l.size;
    q.setZero(l.model.nq());
    for (VectorXd* x : {&v, &a, &d, &w, &gradient_q, &gradient_v}) x->setZero(n);
    for (VectorXd* x : {&gamma, &independent, &zeta}) x->setZero(l.rank);
    rows.setZero(m);
    for (MatrixXd* x : {&Z, &dy, &dv}) x->setZero(n, r);
    for (MatrixXd* x : {&Cq, &Cv, &K}) x->setZero(m, n);
    for (MatrixXd* x : {&Cq_r, &Cv_r, &K_r}) x->setZero(l.rank, n);
    for (MatrixXd* x : {&Jd, &H}) x->setZero(n, n);
    for (MatrixXd* x : {&HN, &WHN, &HnNn, &EN, &L, &T, &LJ, &beta, &wy, &wv}) x->setZero(n, r);
    X.setZero(l.rank, r);
    Y.setZero(l.rank, 2 * r);
    G.setZero(l.rank, n);
    At.setZero(l.rank, l.rank);
    pivots.resize(l.rank);
    for (MatrixXd* x : {&q_y, &q_v, &q_a, &v_y, &v_v, &v_a, &S, &mixed, &Pq, &Pv, &Pz}) x->setZero(r, r);
    target.setZero(r);
    mixed_pivots.resize(r);
  }
  BlockPoint scratch;  // for integrate() and open gaps
  VectorXd q, v, a, d, w, gradient_q, gradient_v;
  VectorXd gamma, independent, zeta, rows;
  MatrixXd Z, dy, dv;                                  // n x r, Eqs. (a), (c)
  MatrixXd Cq, Cv, K, Cq_r, Cv_r, K_r;                 // closure derivatives, all rows and the independent ones
  MatrixXd Jd, H;                                      // n x n, Eqs. (e), (f); of J_d the blocks of curved joints
  MatrixXd HN, WHN, HnNn, EN, L, T, LJ, beta, wy, wv;  // n x r
  MatrixXd X, Y, G, At;                                // rank x r, 2 r, n, rank
  std::vector<int> pivots;                             // of At
  MatrixXd q_y, q_v, q_a, v_y, v_v, v_a, S;            // r x r: dq+ and dv+ by dy, dy_v, dy'; S of Eq. (g)
  MatrixXd mixed, Pq, Pv, Pz;                          // r x r: change of basis, of integrate() and at open gaps
  VectorXd target;                                     // r
  std::vector<int> mixed_pivots;
};

// What a node needs within a call of RobotProblem. All nodes that one thread works on share it: it stays in the cache.
struct ReducedWork {
  ReducedWork(const Model& model, const Reduction& reduction);
  std::vector<BlockWork> blocks;
  ReducedDerivatives derivatives;
  std::vector<BlockLift> lifts;
  MatrixXd left;                       // nv x size
  MatrixXd dydd;                       // size x (2 size + nu), derivatives of y' with respect to (dy, dy_v, u)
  MatrixXd Rx, Ru, scaled, Ru_scaled;  // residuals, with room for those of any node
};

// One for each thread that asks.
class ReducedWorkPool {
 public:
  ReducedWorkPool(const Model& model, const Reduction& reduction) : model_(model), reduction_(reduction) {}
  ReducedWork& get();

 private:
  const Model& model_;
  const Reduction& reduction_;
  std::mutex mutex_;
  std::map<std::thread::id, std::unique_ptr<ReducedWork>> works_;
};

// A block of loops at one node: what lasts from call to call.
struct ReducedBlock {
  explicit ReducedBlock(const LoopBlock& l) : loop(l), at(l), next(l), chart(at.basis()) {
    v_next.setZero(l.model.nv());
    mu.setZero(l.rank);
  }
  const LoopBlock& loop;
  BlockPoint at, next;  // at the state; at q+
  BlockBasis chart;     // at the last linearized state
  VectorXd v_next, mu;
  BlockWork* work = nullptr;  // within a call
};

// A joint outside all loops at one node: what dq+ makes of dy and of dv+, dq+ and dv+ of dy'.
struct FreeJoint {
  int joint = 0, offset = 0;
  JointMatrix q_y, q_v, q_a, v_a;  // nv x nv of the joint
};

class ReducedNode : public NodeModel {
 public:
  using Block = ReducedBlock;

  ReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
              std::shared_ptr<ReducedWorkPool> pool);

  int tangentSize() const override { return 2 * reduction_.size; }
  void integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) override;
  void difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) override;
  bool updateState(ConstVectorRef x) override;
  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;
  void linearizeState() override;
  void addStateCost(const StateCost& cost, double scale, StageModel& out) override;
  void addResiduals(const ResidualStack& stack, bool running, StageModel& out) override;

 private:
  // Kinematics at x; the blocks are those that `previous` has closed there, if given.
  bool updateState(ConstVectorRef x, const ReducedNode* previous);

  static const MatrixXd& BlockBasisN(const Block& b) { return b.at.basis().N; }
  static const MatrixXd& BlockZ(const Block& b) { return b.work->Z; }
  static const MatrixXd& BlockDy(const Block& b) { return b.work->dy; }
  static const MatrixXd& BlockDv(const Block& b) { return b.work->dv; }
  using Accessor = const MatrixXd& (*)(const Block&);

  // out += A X, with X the block matrix that `accessor` names; free dofs are the identity for N and zero for the
  // others.
  void addColumns(const MatrixXd& A, Accessor accessor, MatrixRef out) const;
  // out = N^T A
  void projectRows(const MatrixXd& A, MatrixRef out) const;
  void projectVector(const VectorXd& x, VectorXd& out) const;
  // x += N y
  void addFromReduced(const VectorXd& y, VectorXd& x) const;
  bool fail(const Block& b, const BlockPoint& point) {
    failure_ = point.describeFailure(b.loop);
    return false;
  }
  void calcJointCost(const StateCost& state, double w, const Joint& joint, JointVector& gradient,
                     JointMatrix& hessian) const;
  void updateContacts();
  bool closeStep(ConstVectorRef x);
  static void calcVelocityLift(Block& b, BlockPoint& point, MatrixXd& Z);
  bool moveToNodeState(Block& b, StageModel& out);
  void updateBlockDerivatives(Block& b);
  void updateForces();
  static void updateForceDerivative(Block& b, const BlockPoint& point, const VectorXd& force);
  void linearizeDynamics();
  bool linearizeBlock(Block& b, ConstVectorRef x_next_node, StageModel& out);
  void linearizeFreeJoint(FreeJoint& free, const StageModel& out) const;
  void assembleStep(StageModel& out) const;
  void addMotorColumns(MatrixRef out) const;
  void differenceAbout(Block& b, const BlockBasis& basis, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const;
  void differenceFree(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const;
  bool updateChart(ConstVectorRef x);
  void storeChart();

  // The memory of this thread; every function called from outside takes it first.
  void takeWork();

  const Reduction& reduction_;
  std::shared_ptr<ReducedWorkPool> pool_;
  ReducedWork* work_ = nullptr;
  std::vector<ReducedBlock> blocks_;
  std::vector<FreeJoint> free_joints_;
  int num_loops_ = 0, loop_rows_ = 0, contact_rows_ = 0;
  VectorXd tau_, a_, a_d_, w_, force_, ydd_, f_, gamma_, lambda_c_;
  MatrixXd Jc_, JcN_, Cc_q_, Cc_v_;  // contact rows
  MatrixXd M_;
  MatrixXd dlambda_;  // derivatives of lambda_c with respect to (dy, dy_v, u)
  SaddlePoint saddle_point_;
  std::vector<Vector6d> f_ext_;
  VectorXd chart_x_;
};

}  // namespace bielle
