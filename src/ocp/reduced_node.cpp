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
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/reduced_derivatives.h"
#include "bielle/dynamics/rnea.h"
#include "node_model.h"

namespace bielle {
namespace {

// A block of loops at one node.
struct Block {
  explicit Block(const LoopBlock& l) : loop(l), at(l), next(l), scratch(l), chart(at.basis()) {
    const int n = l.model.nv(), m = l.closures.rows, r = l.size;
    q.setZero(l.model.nq());
    for (VectorXd* v : {&this->v, &a, &d, &w, &v_next, &gradient_q, &gradient_v}) v->setZero(n);
    for (VectorXd* v : {&gamma, &mu, &independent, &zeta}) v->setZero(l.rank);
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
  const LoopBlock& loop;
  BlockPoint at, next, scratch;  // at the state; at q+; for integrate() and open gaps
  BlockBasis chart;              // at the last linearized state
  VectorXd q, v, a, d, w, v_next, gradient_q, gradient_v;
  VectorXd gamma, mu, independent, zeta, rows;
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

// out = -J^+ X; X is overwritten.
void applyPlus(const BlockPoint& point, MatrixXd& X, MatrixXd& out) {
  point.solveGram(X);
  out.setZero();
  addSmallProductTransposed(point.basis().JW, X, out, -1);
}

// A joint outside all loops at one node: what dq+ makes of dy and of dv+.
struct FreeJoint {
  int joint = 0, offset = 0;
  JointMatrix q_y, q_v;  // nv x nv of the joint
};

class ReducedNode : public NodeModel {
 public:
  ReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec)
      : NodeModel(model, spec), reduction_(reduction), derivatives_(model, reduction) {
    for (const LoopBlock& block : reduction.blocks) blocks_.emplace_back(block);
    for (size_t i = 0; i < reduction.free_joints.size(); ++i)
      free_joints_.push_back({reduction.free_joints[i], reduction.free_offsets[i], {}, {}});
    const int nv = model.nv(), nr = reduction.size, nu = model.nu();
    num_loops_ = spec.constraints.num_loops;
    loop_rows_ = 0;
    for (int c = 0; c < num_loops_; ++c) loop_rows_ += getRows(spec.constraints.closures[c].kind);
    contact_rows_ = spec.constraints.rows - loop_rows_;
    for (VectorXd* v : {&tau_, &a_, &a_d_, &w_, &force_}) v->setZero(nv);
    for (VectorXd* v : {&ydd_, &f_}) v->setZero(nr);
    for (VectorXd* v : {&gamma_, &lambda_c_}) v->setZero(contact_rows_);
    Jc_.setZero(contact_rows_, nv);
    JcN_.setZero(contact_rows_, nr);
    for (MatrixXd* m : {&Cc_q_, &Cc_v_}) m->setZero(contact_rows_, nv);
    dlambda_.setZero(contact_rows_, 2 * nr + nu);
    dydd_.setZero(nr, 2 * nr + nu);
    left_.setZero(nv, nr);
    lifts_.resize(blocks_.size());
    M_.setZero(nr, nr);
    saddle_point_.resize(nr, contact_rows_);
    f_ext_.assign(model.numBodies(), Vector6d::Zero());
    chart_x_.setConstant(model.nq() + nv, std::numeric_limits<double>::quiet_NaN());
  }

  int tangentSize() const override { return 2 * reduction_.size; }

  void integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) override {
    if (!updateChart(x)) {
      x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    const int nq = model_.nq(), nr = reduction_.size;
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      const int at = reduction_.free_offsets[i], n = joint.nv;
      JointVector d = dx.segment(at, n);
      integrateJoint(joint, x.segment(joint.idx_q, joint.nq), d, x_out.segment(joint.idx_q, joint.nq));
      x_out.segment(nq + joint.idx_v, n) = x.segment(nq + joint.idx_v, n) + dx.segment(nr + at, n);
    }
    for (Block& b : blocks_) {
      const LoopBlock& loop = b.loop;
      b.d.noalias() = b.chart.N * dx.segment(loop.offset, loop.size);
      if (!b.scratch.close(loop, b.chart, b.d, {})) {
        fail(b, b.scratch);
        x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
        return;
      }
      // The velocity at the new point whose coordinates about the old one are N^T v + dy_v.
      gatherVelocity(loop, x.tail(model_.nv()), b.v);
      b.target = dx.segment(nr + loop.offset, loop.size);
      addSmallProductTransposed(b.chart.WN, b.v, b.target);
      b.mixed.setZero();
      addSmallProductTransposed(b.chart.WN, b.scratch.basis().N, b.mixed);
      if (!factorizeSmall(b.mixed, b.mixed_pivots)) {
        failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
        x_out.setConstant(std::numeric_limits<double>::quiet_NaN());
        return;
      }
      solveFactorized(b.mixed, b.mixed_pivots, b.target);
      b.v.noalias() = b.scratch.basis().N * b.target;
      scatterConfiguration(model_, loop, b.scratch.basis().q, x_out.head(nq));
      scatterVelocity(loop, b.v, x_out.tail(model_.nv()));
    }
  }

  void difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) override {
    if (!updateChart(x0)) {
      dx.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    for (Block& b : blocks_) differenceAbout(b, b.chart, x0, x1, dx);
    differenceFree(x0, x1, dx);
  }

  bool updateState(ConstVectorRef x) override { return updateState(x, nullptr); }

  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override {
    const bool follows = previous && previous->x_next() == x;
    if (!updateState(x, follows ? static_cast<const ReducedNode*>(previous) : nullptr)) return false;
    updateBias(model_, ws_);
    a_d_.setZero();
    for (Block& b : blocks_) {
      b.a.setZero();
      updateAccelerations(b.loop.model, b.at.workspace(), b.a);
      const ConstraintSet& set = b.loop.closures;
      for (size_t c = 0; c < set.closures.size(); ++c)
        b.rows.segment(set.offsets[c], getRows(set.closures[c].kind)) =
            calcClosureAcceleration(b.at.workspace(), set.closures[c]);
      for (int i = 0; i < b.loop.rank; ++i) b.gamma[i] = b.rows[b.at.basis().rows[i]];
      b.independent = b.gamma;
      b.at.solveGram(b.independent);
      b.a.noalias() = -b.at.basis().JW.transpose() * b.independent;
      scatterVelocity(b.loop, b.a, a_d_);
    }
    // Eq. (b)
    calcMotorForces(model_, u, tau_);
    force_ = tau_ - ws_.b;
    force_.noalias() -= ws_.M * a_d_;
    projectVector(force_, f_);
    left_.setZero();
    addColumns(ws_.M, &BlockBasisN, left_);
    projectRows(left_, M_);
    if (contact_rows_ > 0) updateContacts();
    if (saddle_point_.factorize(M_, JcN_) != SaddlePointStatus::Ok) {
      failure_ = "the mass matrix is singular";
      return false;
    }
    saddle_point_.solve(f_, gamma_, ydd_, lambda_c_);
    lambda_.tail(contact_rows_) = lambda_c_;
    a_ = a_d_;
    addFromReduced(ydd_, a_);
    return closeStep(x);
  }

  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;
  void linearizeState() override {
    for (Block& b : blocks_) calcVelocityLift(b, b.at, b.Z);
    storeChart();
  }
  void addStateCost(const StateCost& cost, double scale, StageModel& out) override;
  void addResiduals(const ResidualStack& stack, bool running, StageModel& out) override;

 private:
  // Kinematics at x; the blocks are those that `previous` has closed there, if given.
  bool updateState(ConstVectorRef x, const ReducedNode* previous) {
    const int nq = model_.nq(), nv = model_.nv();
    failure_.clear();
    updatePositions(model_, ws_, x.head(nq));
    updateVelocities(model_, ws_, x.tail(nv));
    updateMassMatrix(model_, ws_);
    for (size_t i = 0; i < blocks_.size(); ++i) {
      Block& b = blocks_[i];
      if (previous) {
        b.at.assign(previous->blocks_[i].next);
      } else {
        gatherConfiguration(model_, b.loop, x.head(nq), b.q);
        if (!b.at.update(b.loop, b.q)) return fail(b, b.at);
      }
      gatherVelocity(b.loop, x.tail(nv), b.v);
      updateVelocities(b.loop.model, b.at.workspace(), b.v);
    }
    return true;
  }

  static const MatrixXd& BlockBasisN(const Block& b) { return b.at.basis().N; }
  static const MatrixXd& BlockZ(const Block& b) { return b.Z; }
  static const MatrixXd& BlockDy(const Block& b) { return b.dy; }
  static const MatrixXd& BlockDv(const Block& b) { return b.dv; }
  using Accessor = const MatrixXd& (*)(const Block&);

  // out += A X, with X the block matrix that `accessor` names; free dofs are the identity for N and zero for the
  // others.
  void addColumns(const MatrixXd& A, Accessor accessor, MatrixRef out) const {
    if (accessor == &BlockBasisN)
      for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
        const Joint& joint = model_.joints()[reduction_.free_joints[i]];
        out.middleCols(reduction_.free_offsets[i], joint.nv) += A.middleCols(joint.idx_v, joint.nv);
      }
    for (const Block& b : blocks_) {
      const MatrixXd& X = accessor(b);
      for (int c = 0; c < b.loop.size; ++c)
        for (size_t k = 0; k < b.loop.dofs.size(); ++k) out.col(b.loop.offset + c) += X(k, c) * A.col(b.loop.dofs[k]);
    }
  }

  // out = N^T A
  void projectRows(const MatrixXd& A, MatrixRef out) const {
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      out.middleRows(reduction_.free_offsets[i], joint.nv) = A.middleRows(joint.idx_v, joint.nv);
    }
    for (const Block& b : blocks_) {
      const MatrixXd& N = b.at.basis().N;
      for (Eigen::Index col = 0; col < A.cols(); ++col)
        for (int c = 0; c < b.loop.size; ++c) {
          double sum = 0;
          for (size_t k = 0; k < b.loop.dofs.size(); ++k) sum += N(k, c) * A(b.loop.dofs[k], col);
          out(b.loop.offset + c, col) = sum;
        }
    }
  }

  void projectVector(const VectorXd& x, VectorXd& out) const {
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      out.segment(reduction_.free_offsets[i], joint.nv) = x.segment(joint.idx_v, joint.nv);
    }
    for (const Block& b : blocks_)
      for (int c = 0; c < b.loop.size; ++c) {
        double sum = 0;
        for (size_t k = 0; k < b.loop.dofs.size(); ++k) sum += b.at.basis().N(k, c) * x[b.loop.dofs[k]];
        out[b.loop.offset + c] = sum;
      }
  }

  // x += N y
  void addFromReduced(const VectorXd& y, VectorXd& x) const {
    for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
      const Joint& joint = model_.joints()[reduction_.free_joints[i]];
      x.segment(joint.idx_v, joint.nv) += y.segment(reduction_.free_offsets[i], joint.nv);
    }
    for (const Block& b : blocks_)
      for (size_t k = 0; k < b.loop.dofs.size(); ++k)
        x[b.loop.dofs[k]] += b.at.basis().N.row(k).dot(y.segment(b.loop.offset, b.loop.size));
  }

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

  const Reduction& reduction_;
  std::vector<Block> blocks_;
  std::vector<FreeJoint> free_joints_;
  int num_loops_ = 0, loop_rows_ = 0, contact_rows_ = 0;
  VectorXd tau_, a_, a_d_, w_, force_, ydd_, f_, gamma_, lambda_c_;
  MatrixXd Jc_, JcN_, Cc_q_, Cc_v_;  // contact rows
  MatrixXd M_, left_;
  ReducedDerivatives derivatives_;
  std::vector<BlockLift> lifts_;
  MatrixXd dydd_, dlambda_;  // derivatives of y' and lambda_c with respect to (dy, dy_v, u)
  MatrixXd Rx_, Ru_, scaled_, Ru_scaled_;
  SaddlePoint saddle_point_;
  std::vector<Vector6d> f_ext_;
  VectorXd chart_x_;
};

void ReducedNode::updateContacts() {
  const ConstraintSet& set = spec_.constraints;
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    const int row = set.offsets[c] - loop_rows_, n = getRows(contact.kind);
    calcClosureJacobian(ws_, contact, Jc_.middleRows(row, n));
    gamma_.segment(row, n) = calcClosureAcceleration(ws_, contact) + calcClosureStabilization(ws_, contact);
  }
  gamma_.noalias() += Jc_ * a_d_;
  JcN_.setZero();
  addColumns(Jc_, &BlockBasisN, JcN_);
}

// robot_problem.h Eq. (3)
bool ReducedNode::closeStep(ConstVectorRef x) {
  const int nq = model_.nq(), nv = model_.nv();
  const double h = spec_.dt;
  w_ = x.tail(nv) + h * a_;
  for (int i : reduction_.free_joints) {
    const Joint& joint = model_.joints()[i];
    const JointVector d = h * w_.segment(joint.idx_v, joint.nv);
    integrateJoint(joint, x.segment(joint.idx_q, joint.nq), d, x_next_.segment(joint.idx_q, joint.nq));
  }
  x_next_.tail(nv) = w_;
  for (Block& b : blocks_) {
    gatherVelocity(b.loop, w_, b.d);
    b.d *= h;
    // To second order the closures open by h^2/2 gamma along h w: J J^T zeta = h^2/2 gamma, with the zeta of close().
    b.zeta = (0.5 * h * h) * b.independent;
    if (!b.next.close(b.loop, b.at.basis(), b.d, b.zeta)) return fail(b, b.next);
    b.w = b.next.step() / h;
    b.mu.noalias() = b.next.basis().J * b.w;
    b.next.solveGram(b.mu);
    b.v_next = b.w;
    b.v_next.noalias() -= b.next.basis().JW.transpose() * b.mu;
    scatterConfiguration(model_, b.loop, b.next.basis().q, x_next_.head(nq));
    scatterVelocity(b.loop, b.v_next, x_next_.tail(nv));
  }
  return true;
}

// Z of Eq. (a) at a point of the block whose velocities are there.
void ReducedNode::calcVelocityLift(Block& b, BlockPoint& point, MatrixXd& Z) {
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureVelocityDerivative(point.workspace(), set.closures[c],
                                  b.K.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  point.selectIndependent(b.K, b.K_r);
  b.X.setZero();
  addSmallProduct(b.K_r, point.basis().N, b.X);
  applyPlus(point, b.X, Z);
}

// d_y and d_v of Eq. (c).
void ReducedNode::updateBlockDerivatives(Block& b) {
  calcVelocityLift(b, b.at, b.Z);
  gatherVelocity(b.loop, a_, b.a);
  updateAccelerations(b.loop.model, b.at.workspace(), b.a);
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const int row = set.offsets[c], n = getRows(set.closures[c].kind);
    calcClosureDerivatives(b.at.workspace(), set.closures[c], b.Cq.middleRows(row, n), b.Cv.middleRows(row, n));
  }
  b.at.selectIndependent(b.Cq, b.Cq_r);
  b.at.selectIndependent(b.Cv, b.Cv_r);
  b.X.setZero();
  addSmallProduct(b.Cq_r, b.at.basis().N, b.X);
  addSmallProduct(b.Cv_r, b.Z, b.X);
  applyPlus(b.at, b.X, b.dy);
  b.X.setZero();
  addSmallProduct(b.Cv_r, b.at.basis().N, b.X);
  applyPlus(b.at, b.X, b.dv);
}

// Loop forces, and the wrenches of loops and contacts on the bodies.
void ReducedNode::updateForces() {
  force_ = ws_.b - tau_;
  force_.noalias() += ws_.M * a_;
  force_.noalias() -= Jc_.transpose() * lambda_c_;
  const ConstraintSet& set = spec_.constraints;
  for (Block& b : blocks_) {
    gatherVelocity(b.loop, force_, b.d);
    b.independent.noalias() = b.at.basis().JW * b.d;
    b.at.solveGram(b.independent);
    updateForceDerivative(b, b.at, b.independent);
  }
  for (Vector6d& f : f_ext_) f.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const Closure& contact = set.closures[c];
    f_ext_[contact.body1] += calcClosureWrench(ws_, contact, lambda_.segment(set.offsets[c], getRows(contact.kind)));
  }
}

// H = d(J^T f)/dq at a point of the block, for forces f on its independent rows.
void ReducedNode::updateForceDerivative(Block& b, const BlockPoint& point, const VectorXd& force) {
  expandIndependent(point.basis(), force, b.rows);
  b.H.setZero();
  const ConstraintSet& set = b.loop.closures;
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const Closure& closure = set.closures[c];
    const Vector6d W =
        calcClosureWrench(point.workspace(), closure, b.rows.segment(set.offsets[c], getRows(closure.kind)));
    addGeneralizedForceDerivative(b.loop.model, point.workspace(), closure, W, b.H);
  }
}

// Eqs. (c), (d) and the derivatives of y' and lambda_c.
void ReducedNode::linearizeDynamics() {
  const int nr = reduction_.size;
  updateAccelerations(model_, ws_, a_);
  for (Block& b : blocks_) updateBlockDerivatives(b);
  updateForces();
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Block& b = blocks_[i];
    lifts_[i] = {&b.at.basis().N, &b.Z, &b.dy, &b.dv, &b.H};
  }
  derivatives_.update(ws_, f_ext_, lifts_, dydd_.leftCols(nr), dydd_.middleCols(nr, nr));
  const ConstraintSet& set = spec_.constraints;
  dydd_.rightCols(model_.nu()).setZero();
  addMotorColumns(dydd_.rightCols(model_.nu()));
  dlambda_.setZero();
  for (size_t c = num_loops_; c < set.closures.size(); ++c) {
    const int row = set.offsets[c] - loop_rows_, n = getRows(set.closures[c].kind);
    calcClosureDerivatives(ws_, set.closures[c], Cc_q_.middleRows(row, n), Cc_v_.middleRows(row, n));
  }
  addColumns(Cc_q_, &BlockBasisN, dlambda_.leftCols(nr));
  addColumns(Cc_v_, &BlockZ, dlambda_.leftCols(nr));
  addColumns(Jc_, &BlockDy, dlambda_.leftCols(nr));
  addColumns(Cc_v_, &BlockBasisN, dlambda_.middleCols(nr, nr));
  addColumns(Jc_, &BlockDv, dlambda_.middleCols(nr, nr));
  saddle_point_.updateInverse();
  saddle_point_.solveDerivatives(dydd_, dlambda_);
}

// out (size x nu) += -N^T B
void ReducedNode::addMotorColumns(MatrixRef out) const {
  for (int m = 0; m < model_.nu(); ++m) {
    const int dof = model_.motors()[m].dof;
    for (const FreeJoint& free : free_joints_) {
      const Joint& joint = model_.joints()[free.joint];
      if (dof >= joint.idx_v && dof < joint.idx_v + joint.nv) out(free.offset + dof - joint.idx_v, m) -= 1;
    }
    for (const Block& b : blocks_)
      for (size_t k = 0; k < b.loop.dofs.size(); ++k)
        if (b.loop.dofs[k] == dof)
          out.col(m).segment(b.loop.offset, b.loop.size) -= b.at.basis().N.row(k).transpose();
  }
}

bool ReducedNode::linearizeStep(ConstVectorRef x_next_node, StageModel& out) {
  linearizeDynamics();
  for (Block& b : blocks_)
    if (!linearizeBlock(b, x_next_node, out)) return false;
  differenceFree(x_next_node, x_next_, out.gap);
  for (FreeJoint& free : free_joints_) linearizeFreeJoint(free, out);
  assembleStep(out);
  storeChart();
  return true;
}

// Eqs. (e) to (g) for one block, rows [offset, offset + size) of Fx, Fu and gap.
bool ReducedNode::linearizeBlock(Block& b, ConstVectorRef x_next_node, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, nu = model_.nu(), r = loop.size, o = loop.offset;
  const double h = spec_.dt;
  const BlockBasis &base = b.at.basis(), &next = b.next.basis();
  const MatrixXd &N = base.N, &Nn = next.N, &WNn = next.WN;

  b.zeta = b.next.zeta() / h;  // close() moves by h w', so its zeta is h times that of Eq. (3)
  updateForceDerivative(b, b.at, b.zeta);
  b.HN.setZero();
  addSmallProduct(b.H, N, b.HN);
  b.WHN = b.loop.metric.cwiseInverse().asDiagonal() * b.HN;
  updateForceDerivative(b, b.next, b.mu);
  b.HnNn.setZero();
  addSmallProduct(b.H, Nn, b.HnNn);

  // J_q and J_d are the identity but for the blocks of curved joints. EN: e = EN dy + h J_d dw.
  b.EN = N - h * b.WHN;
  b.G = base.JW;  // J W^{-1} J_d^T
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const JointVector d = b.next.step().segment(i, n);
    JointMatrix Jq(n, n), Jd(n, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    b.Jd.block(i, i, n, n) = Jd;
    b.EN.middleRows(i, n) = Jq.lazyProduct(N.middleRows(i, n)) - h * Jd.lazyProduct(b.WHN.middleRows(i, n));
    b.G.middleCols(i, n) = base.JW.middleCols(i, n).lazyProduct(Jd.transpose());
  }
  // Y = A^{-T} [J W^{-1} J_d^T W N', J W^{-1} W N'], with A^T = h J W^{-1} J_d^T J'^T
  b.At.setZero();
  addSmallProduct(b.G, next.J.transpose(), b.At, h);
  b.Y.setZero();
  addSmallProduct(b.G, WNn, b.Y.leftCols(r));
  addSmallProduct(base.JW, WNn, b.Y.rightCols(r));
  if (!factorizeSmall(b.At, b.pivots)) {
    failure_ = "closure '" + loop.closures.closures.front().name + "': the step turns its loops too far";
    return false;
  }
  solveFactorized(b.At, b.pivots, b.Y);
  // dy+ = L^T e, and T^T = N'^T J^T A^{-1} J'
  b.L = WNn;
  addSmallProductTransposed(next.J, b.Y.leftCols(r), b.L, -h);
  b.T.setZero();
  addSmallProductTransposed(next.J, b.Y.rightCols(r), b.T);
  // h J_d^T L and beta = N' - h J_d^T T
  b.LJ = h * b.L;
  b.beta = WNn - h * b.T;
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    const auto Jd = b.Jd.block(i, i, n, n);
    b.LJ.middleRows(i, n) = h * Jd.transpose().lazyProduct(b.L.middleRows(i, n));
    b.beta.middleRows(i, n) = WNn.middleRows(i, n) - h * Jd.transpose().lazyProduct(b.T.middleRows(i, n));
  }
  // dw = (N + h d_v) dy_v + (Z + h d_y) dy + h N dy'
  b.wy = b.Z + h * b.dy;
  b.wv = N + h * b.dv;
  MatrixXd &q_y = b.q_y, &q_v = b.q_v, &q_a = b.q_a, &v_y = b.v_y, &v_v = b.v_v, &v_a = b.v_a, &S = b.S;
  for (MatrixXd* m : {&q_y, &q_v, &q_a, &v_y, &v_v, &v_a, &S}) m->setZero();
  addSmallProductTransposed(Nn, b.HnNn, S);
  addSmallProductTransposed(b.L, b.EN, q_y);
  addSmallProductTransposed(b.LJ, b.wy, q_y);
  addSmallProductTransposed(b.LJ, b.wv, q_v);
  addSmallProductTransposed(b.LJ, N, q_a, h);
  addSmallProductTransposed(b.beta, b.wy, v_y);
  addSmallProductTransposed(Nn, b.HN, v_y, -1);
  addSmallProductTransposed(b.T, b.EN, v_y, -1);
  addSmallProductTransposed(b.beta, b.wv, v_v);
  addSmallProductTransposed(b.beta, N, v_a, h);
  addSmallProduct(S, q_y, v_y, -1);
  addSmallProduct(S, q_v, v_v, -1);
  addSmallProduct(S, q_a, v_a, -1);

  // About the node state, where a gap is open.
  gatherConfiguration(model_, loop, x_next_node.head(model_.nq()), b.q);
  gatherVelocity(loop, x_next_node.tail(model_.nv()), b.d);
  if (b.q != next.q || b.d != b.v_next) return moveToNodeState(b, out);
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  return true;
}

// The gap of a block to the node state (b.q, b.d), and its derivatives read there.
bool ReducedNode::moveToNodeState(Block& b, StageModel& out) {
  const LoopBlock& loop = b.loop;
  const int nr = reduction_.size, r = loop.size, o = loop.offset;
  if (!b.scratch.update(loop, b.q)) return fail(b, b.scratch);
  const MatrixXd &WN = b.scratch.basis().WN, &Nn = b.next.basis().N;
  updateVelocities(loop.model, b.next.workspace(), b.v_next);
  calcVelocityLift(b, b.next, b.T);
  loop.model.difference(b.q, b.next.basis().q, b.a);
  b.w = b.v_next - b.d;
  b.L = Nn;  // becomes J_diff N'
  for (const Joint& joint : loop.model.joints()) {
    if (!isCurved(joint)) continue;
    const int i = joint.idx_v, n = joint.nv;
    JointMatrix Jdiff(n, n);
    calcJointDifferenceJacobian(joint, b.a.segment(i, n), Jdiff);
    b.L.middleRows(i, n) = Jdiff.lazyProduct(Nn.middleRows(i, n));
  }
  out.gap.segment(o, r).setZero();
  out.gap.segment(nr + o, r).setZero();
  addSmallProductTransposed(WN, b.a, out.gap.segment(o, r));
  addSmallProductTransposed(WN, b.w, out.gap.segment(nr + o, r));
  for (MatrixXd* P : {&b.Pq, &b.Pv, &b.Pz}) P->setZero();
  addSmallProductTransposed(WN, b.L, b.Pq);
  addSmallProductTransposed(WN, Nn, b.Pv);
  addSmallProductTransposed(WN, b.T, b.Pz);
  const std::pair<MatrixXd*, MatrixXd*> derivatives[] = {{&b.q_y, &b.v_y}, {&b.q_v, &b.v_v}, {&b.q_a, &b.v_a}};
  for (const auto& [dq, dv] : derivatives) {
    b.S.setZero();
    addSmallProduct(b.Pv, *dv, b.S);
    addSmallProduct(b.Pz, *dq, b.S);
    dv->swap(b.S);
    b.S.setZero();
    addSmallProduct(b.Pq, *dq, b.S);
    dq->swap(b.S);
  }
  return true;
}

// The same for a joint outside all loops, where N and J^T vanish from Eqs. (e) to (g).
void ReducedNode::linearizeFreeJoint(FreeJoint& free, const StageModel& out) const {
  const Joint& joint = model_.joints()[free.joint];
  const int n = joint.nv;
  const double h = spec_.dt;
  free.q_y.setIdentity(n, n);
  free.q_v = h * JointMatrix::Identity(n, n);
  if (isCurved(joint)) {
    JointMatrix Jq(n, n), Jd(n, n), Jdiff(n, n);
    const JointVector d = h * x_next_.segment(model_.nq() + joint.idx_v, n), gap = out.gap.segment(free.offset, n);
    calcJointIntegrateJacobians(joint, d, Jq, Jd);
    calcJointDifferenceJacobian(joint, gap, Jdiff);
    free.q_y.noalias() = Jdiff * Jq;
    free.q_v.noalias() = h * Jdiff * Jd;
  }
}

// Fx and Fu, column by column, out of the derivatives of y' and what each unit makes of them.
void ReducedNode::assembleStep(StageModel& out) const {
  const int nr = reduction_.size, nu = model_.nu();
  const double h = spec_.dt;
  for (int c = 0; c < 2 * nr + nu; ++c) {
    const double* ydd = &dydd_(0, c);
    double* column = c < 2 * nr ? &out.Fx(0, c) : &out.Fu(0, c - 2 * nr);
    for (const FreeJoint& free : free_joints_) {
      const int n = static_cast<int>(free.q_v.rows()), o = free.offset;
      for (int i = 0; i < n; ++i) column[nr + o + i] = h * ydd[o + i];
      if (n == 1) {
        column[o] = h * free.q_v(0, 0) * ydd[o];
        continue;
      }
      for (int i = 0; i < n; ++i) column[o + i] = 0;
      for (int k = 0; k < n; ++k)
        for (int i = 0; i < n; ++i) column[o + i] += free.q_v(i, k) * (h * ydd[o + k]);
    }
    for (const Block& b : blocks_) {
      const int o = b.loop.offset, r = b.loop.size;
      for (int i = 0; i < r; ++i) {
        double q = 0, v = 0;
        for (int k = 0; k < r; ++k) {
          q += b.q_a(i, k) * ydd[o + k];
          v += b.v_a(i, k) * ydd[o + k];
        }
        column[o + i] = q;
        column[nr + o + i] = v;
      }
    }
  }
  for (const FreeJoint& free : free_joints_) {
    const int n = static_cast<int>(free.q_v.rows()), o = free.offset;
    out.Fx.block(o, o, n, n) += free.q_y;
    out.Fx.block(o, nr + o, n, n) += free.q_v;
    out.Fx.block(nr + o, nr + o, n, n).diagonal().array() += 1;
  }
  for (const Block& b : blocks_) {
    const int o = b.loop.offset, r = b.loop.size;
    out.Fx.block(o, o, r, r) += b.q_y;
    out.Fx.block(o, nr + o, r, r) += b.q_v;
    out.Fx.block(nr + o, o, r, r) += b.v_y;
    out.Fx.block(nr + o, nr + o, r, r) += b.v_v;
  }
}

// Gradient and Hessian of a state cost with respect to the dofs of one joint.
void ReducedNode::calcJointCost(const StateCost& state, double w, const Joint& joint, JointVector& gradient,
                                JointMatrix& hessian) const {
  const int n = joint.nv;
  const JointVector weights = w * state.weights.segment(joint.idx_v, n);
  JointVector d(n);
  calcJointDifference(joint, state.q_ref.segment(joint.idx_q, joint.nq), ws_.q.segment(joint.idx_q, joint.nq), d);
  if (!isCurved(joint)) {
    gradient = weights.cwiseProduct(d);
    hessian = weights.asDiagonal();
    return;
  }
  JointMatrix J(n, n);
  calcJointDifferenceJacobian(joint, d, J);
  const JointMatrix WJ = weights.asDiagonal() * J;
  gradient.noalias() = WJ.transpose() * d;
  hessian.noalias() = J.transpose() * WJ;
}

void ReducedNode::addStateCost(const StateCost& state, double scale, StageModel& out) {
  const int nv = model_.nv(), nr = reduction_.size;
  const double w = scale * state.weight;
  JointVector gradient;
  JointMatrix hessian;
  for (const FreeJoint& free : free_joints_) {
    const Joint& joint = model_.joints()[free.joint];
    const int o = free.offset, n = joint.nv, k = joint.idx_v;
    calcJointCost(state, w, joint, gradient, hessian);
    out.lx.segment(o, n) += gradient;
    out.lxx.block(o, o, n, n) += hessian;
    const JointVector weights = w * state.weights.segment(nv + k, n);
    out.lx.segment(nr + o, n) += weights.cwiseProduct(ws_.v.segment(k, n) - state.v_ref.segment(k, n));
    out.lxx.block(nr + o, nr + o, n, n).diagonal() += weights;
  }
  for (Block& b : blocks_) {
    // Changes of q are N dy, of v N dy_v + Z dy: gradients by dof, and Hessians times N and Z.
    const int o = b.loop.offset, r = b.loop.size;
    const MatrixXd& N = b.at.basis().N;
    for (size_t j = 0; j < b.loop.joints.size(); ++j) {
      const Joint& joint = model_.joints()[b.loop.joints[j]];
      const int at = b.loop.model.joints()[j + 1].idx_v, n = joint.nv;
      calcJointCost(state, w, joint, gradient, hessian);
      b.gradient_q.segment(at, n) = gradient;
      b.HN.middleRows(at, n) = hessian.lazyProduct(N.middleRows(at, n));
    }
    for (size_t k = 0; k < b.loop.dofs.size(); ++k) {
      const int dof = b.loop.dofs[k];
      const double weight = w * state.weights[nv + dof];
      b.gradient_v[k] = weight * (ws_.v[dof] - state.v_ref[dof]);
      b.wy.row(k) = weight * b.Z.row(k);
      b.wv.row(k) = weight * N.row(k);
    }
    addSmallProductTransposed(N, b.gradient_q, out.lx.segment(o, r));
    addSmallProductTransposed(b.Z, b.gradient_v, out.lx.segment(o, r));
    addSmallProductTransposed(N, b.gradient_v, out.lx.segment(nr + o, r));
    addSmallProductTransposed(N, b.HN, out.lxx.block(o, o, r, r));
    addSmallProductTransposed(b.Z, b.wy, out.lxx.block(o, o, r, r));
    addSmallProductTransposed(b.Z, b.wv, out.lxx.block(o, nr + o, r, r));
    addSmallProductTransposed(b.wv, b.Z, out.lxx.block(nr + o, o, r, r));
    addSmallProductTransposed(N, b.wv, out.lxx.block(nr + o, nr + o, r, r));
  }
}

void ReducedNode::addResiduals(const ResidualStack& stack, bool running, StageModel& out) {
  const int nr = reduction_.size, rows = static_cast<int>(stack.r.size()), nu = model_.nu();
  if (Rx_.rows() != rows) {
    Rx_.setZero(rows, 2 * nr);
    Ru_.setZero(rows, nu);
  }
  Rx_.setZero();
  addColumns(stack.q, &BlockBasisN, Rx_.leftCols(nr));
  addColumns(stack.v, &BlockZ, Rx_.leftCols(nr));
  addColumns(stack.v, &BlockBasisN, Rx_.rightCols(nr));
  if (running && contact_rows_ > 0) {
    Rx_.noalias() += stack.lambda.rightCols(contact_rows_) * dlambda_.leftCols(2 * nr);
    Ru_.noalias() = stack.lambda.rightCols(contact_rows_) * dlambda_.rightCols(nu);
  }
  scaled_ = stack.hessian.asDiagonal() * Rx_;
  out.lx.noalias() += Rx_.transpose() * stack.gradient;
  out.lxx.noalias() += Rx_.transpose() * scaled_;
  if (!running) return;
  Ru_scaled_ = stack.hessian.asDiagonal() * Ru_;
  out.lu.noalias() += Ru_.transpose() * stack.gradient;
  out.luu.noalias() += Ru_.transpose() * Ru_scaled_;
  out.lux.noalias() += Ru_.transpose() * scaled_;
}

void ReducedNode::differenceAbout(Block& b, const BlockBasis& basis, ConstVectorRef x0, ConstVectorRef x1,
                                  VectorRef dx) const {
  const int nq = model_.nq(), nv = model_.nv(), nr = reduction_.size;
  gatherConfiguration(model_, b.loop, x1.head(nq), b.q);
  b.loop.model.difference(basis.q, b.q, b.d);
  dx.segment(b.loop.offset, b.loop.size).noalias() = basis.WN.transpose() * b.d;
  for (size_t k = 0; k < b.loop.dofs.size(); ++k) b.d[k] = x1[nq + b.loop.dofs[k]] - x0[nq + b.loop.dofs[k]];
  dx.segment(nr + b.loop.offset, b.loop.size).noalias() = basis.WN.transpose() * b.d;
  (void)nv;
}

void ReducedNode::differenceFree(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const {
  const int nq = model_.nq(), nr = reduction_.size;
  for (size_t i = 0; i < reduction_.free_joints.size(); ++i) {
    const Joint& joint = model_.joints()[reduction_.free_joints[i]];
    const int o = reduction_.free_offsets[i], n = joint.nv, k = joint.idx_v;
    calcJointDifference(joint, x0.segment(joint.idx_q, joint.nq), x1.segment(joint.idx_q, joint.nq), dx.segment(o, n));
    dx.segment(nr + o, n) = x1.segment(nq + k, n) - x0.segment(nq + k, n);
  }
}

// Bases at x for integrate() and difference(): those of the last linearization, unless x is another point.
bool ReducedNode::updateChart(ConstVectorRef x) {
  if (chart_x_ == x) return true;
  for (Block& b : blocks_) {
    gatherConfiguration(model_, b.loop, x.head(model_.nq()), b.q);
    if (!b.scratch.update(b.loop, b.q)) return fail(b, b.scratch);
    b.chart = b.scratch.basis();
  }
  chart_x_ = x;
  return true;
}

void ReducedNode::storeChart() {
  for (Block& b : blocks_) b.chart = b.at.basis();
  chart_x_.head(model_.nq()) = ws_.q;
  chart_x_.tail(model_.nv()) = ws_.v;
}

}  // namespace

std::unique_ptr<NodeModel> makeReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec) {
  return std::make_unique<ReducedNode>(model, reduction, spec);
}

}  // namespace bielle
