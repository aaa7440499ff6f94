#pragma once
// The reduced formulation: robot_problem.h Eq. (3) and its derivatives. Written for one cluster of loops with bases N, J, J^+
// and metric W (reduction.h) at q, and N', J', J'^+ at q+; a free joint is the case N = N' = W = I without rows.
//
// A tangent vector (dy, dy_v) at the state means, with Z, d_y and d_v of cluster_motion.h,
//     dq = N dy,   dv = N dy_v + Z dy,   da = N dy' + d_y dy + d_v dy_v                                               (a)
// Dynamics: with a = N y' + a_d, a_d = -J^+ gamma, and hats for projections by N^T from both sides,
//     M^ y' - (J_c N)^T lambda_c = N^T (tau - b - M a_d),    (J_c N) y' = -gamma_c - J_c a_d                          (b)
// where c are the contacts. The loop forces, which N^T hides, balance what is left: J^T lambda_l = M a + b - tau - J_c^T lambda_c.
// Derivatives at fixed lambda_l, lambda_c: those of inverse dynamics (reduced_tree.h), and of the contact rows, with the
// columns J~, .. of the contact's body in the place of J_k, .. of closure.h Eqs. (1) and (2).                         (c)
// Step: w = v + h a; e is the displacement before closing, A = h J' J_d W^{-1} J^T, H = d(J^T zeta)/dq,
// S = N'^T d(J'^T mu)/dq N':
//     e = (J_q - h J_d W^{-1} H) dq + h J_d dw                                                                        (d)
//     dq+ = e - h J_d W^{-1} J^T A^{-1} J' e,     dw' = dw - W^{-1} H dq - W^{-1} J^T A^{-1} J' e                     (e)
//     dy+ = (W N')^T dq+,   dy_v+ = (W N')^T dw' - S dy+,   mu = J'^{+T} W w'                                         (f)
// S is there because the projection of w' turns with q+. Nothing of the size of J needs to be inverted: (W N')^T times the
// oblique projection of (e) vanishes on J_d W^{-1} J^T, and so it is read by P = J_d^{-T} W N. With P' = J_d^{-T} W N',
// X = (P^T N')^{-1}, X' = P'^T N' X, E = P^T J_q N - h N^T H N, and (W N)^T Z = (W N)^T d_y = (W N)^T d_v = 0,
//     dy+   = X E dy + h X dy_v + h^2 X dy'
//     dy_v+ = (X' E - P'^T J_q N) / h dy + X' dy_v + h X' dy' - S dy+                                                 (g)
// With a gap, the result is read about the node state's own basis.
//
// A node keeps what cannot be had again for little: everything else lies in the memory of the thread that works on it, so
// that a long horizon fits into the caches.
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "bielle/dynamics/reduced_tree.h"
#include "node_model.h"
#include "reduced_lanes.h"
#include "reduced_state_cost.h"

namespace bielle {

// What a cluster needs within a call, n = nv, m rows of the closures, r reduced coordinates.
struct ClusterWork {
  explicit ClusterWork(const ReducedCluster& l);
  ClusterScratch scratch;
  ClusterState start, point;         // for integrate() and open gaps
  ClusterMotion motion, ahead;       // at the state, in the whole model; at q+, in the cluster
  ClusterGapOf<double> gap;          // of an impact
  VectorXd q, v, a, d;               // n (q: nq)
  VectorXd independent, zeta, rows;  // rank, rank, m
  MatrixXd HN;                       // n x r, scratch
  MatrixXd mixed;                    // r x r
  VectorXd target;                   // r
  std::vector<int> mixed_pivots;
};

// World placements of all bodies, where those of clusters are seen from the body that carries the cluster.
template <typename T>
void placeWhole(const Model& model, const Reduction& reduction, typename ArgumentsOf<T>::ConstVector q,
                std::vector<SE3Of<T>>& X_WB);

// A joint outside all loops: what dq+ makes of dy and of dv+, the identity and h but for curved joints.
struct FreeJoint {
  int joint = 0, offset = 0, size = 0;
  bool curved = false;
  JointMatrix q_y, q_v;  // nv x nv of the joint, where it is curved
};

// An order of state costs by the bytes of their numbers, NaN among them.
struct StateCostOrder {
  bool operator()(const StateCost* a, const StateCost* b) const;
};

// Sizes of the memory that the nodes of a problem share.
struct ReducedSizes {
  explicit ReducedSizes(const std::vector<StageSpec>& specs);
  std::vector<int> tips;                                   // bodies in contact at some stage
  std::vector<int> slots;                                  // of all contacts that a stage may have, their tips
  std::vector<int> contact_rows;                           // numbers of contact rows that occur
  int rows = 0;                                            // largest number of contact rows
  int constraints = 0;                                     // largest number of constraint rows
  int residuals = 0;                                       // largest number of residual rows
  std::set<const StateCost*, StateCostOrder> state_costs;  // those that differ
  // The one of them that is the same; null when the stage has none.
  const StateCost* findStateCost(const StateCost& cost) const;
};

// What a node with so many contact rows needs.
struct ContactWork {
  SaddlePoint saddle_point;
  MatrixXd JcN;  // rows x size
  VectorXd gamma, lambda;
};

// What a node needs within a call of RobotProblem. All nodes that one thread works on share it: it stays in the cache.
struct ReducedWork {
  ReducedWork(const Model& model, const Reduction& reduction, const ReducedSizes& sizes);
  Workspace ws;
  std::vector<ClusterWork> clusters;
  std::vector<ClusterLift> lifts;
  std::vector<FreeJoint> free_joints;
  ReducedTree tree;
  ReducedStateCostOf<double> state_cost;
  ReducedLanes lanes;
  std::map<int, ContactWork> contacts;  // by rows
  VectorXd a_d, force;                  // nv
  VectorXd f, ydd;                      // size
  MatrixXd M;                           // size x size
  struct Motor {
    int cluster, row;  // cluster and row of its N; or -1 and reduced coordinate
  };
  std::vector<Motor> motors;
  ResidualJacobians jacobians;
  VectorXd Rt, Rt_scaled, gradient;  // of setResiduals(), with room for any node
  VectorXd dlambda;                  // see shapeForceDerivatives(), likewise
};

// One for each thread that asks.
class ReducedWorkPool {
 public:
  ReducedWorkPool(const Model& model, const Reduction& reduction, const std::vector<StageSpec>& specs)
      : model_(model), reduction_(reduction), sizes_(specs) {}
  ReducedWork& get();
  const ReducedSizes& sizes() const { return sizes_; }

 private:
  const Model& model_;
  const Reduction& reduction_;
  const ReducedSizes sizes_;
  std::mutex mutex_;
  std::map<std::thread::id, std::unique_ptr<ReducedWork>> works_;
};

// A cluster of loops at one node: what lasts from call to call.
struct ClusterNode {
  explicit ClusterNode(const ReducedCluster& l) : loop(l), at(l), next(l), chart(at.WN) {
    v_next.setZero(l.model.nv());
    surplus.setZero(l.rank);
  }
  const ReducedCluster& loop;
  ClusterBasis at;    // at the state
  ClusterState next;  // at q+
  MatrixXd chart;     // W N at the last linearized state
  VectorXd v_next;
  VectorXd surplus;             // rank, zeta of the closing less its second-order prediction
  ClusterWork* work = nullptr;  // within a call
};

class ReducedNode : public NodeModel {
  friend class ReducedLanes;  // reads what the last step left, and leaves what the next one does

 public:
  using Cluster = ClusterNode;

  ReducedNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
              std::shared_ptr<ReducedWorkPool> pool);

  int tangentSize() const override { return 2 * reduction_.size; }
  void integrate(ConstVectorRef x, ConstVectorRef dx, VectorRef x_out) override;
  void integrateNodes(const Integration* items, int count) override;
  void difference(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) override;
  void calcDifferences(const Difference* items, int count) override;
  bool updateState(ConstVectorRef x) override;
  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  void restore() override;
  const Workspace& workspace() const override { return *shown_; }
  ResidualJacobians& startResiduals(const ResidualStack& stack) override;
  bool startStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  void finishSteps(NodeModel* const* nodes, int count, bool* ok) override;
  void showStep(int index) override;
  void prepareLinearization(const Linearization* items, int count) override;
  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;
  void linearizeState() override;
  double calcStateCost() override;
  void addStateCost(double scale, StageModel& out) override;
  void setResiduals(const ResidualStack& stack, bool running, StageModel& out) override;

 protected:
  // Bases and placements at x; the clusters are those that `previous` has closed there, if given.
  bool updatePoint(ConstVectorRef x, const ReducedNode* previous);
  // And kinematics in the workspace.
  bool updateState(ConstVectorRef x, const ReducedNode* previous);
  void setState(ConstVectorRef x);
  void takePoint(Cluster& b, const ClusterState& point);

  // out += (A X)^T with A for the whole model (k x nv) and X = N (free dofs: the identity) or Z (free dofs: zero).
  enum class Lift { N, Z };
  void addColumns(ConstMatrixRef A, Lift lift, MatrixRef out) const;
  // out = N^T x
  void projectVector(const VectorXd& x, VectorXd& out) const;
  // x += N y
  void addFromReduced(const VectorXd& y, VectorXd& x) const;
  bool fail(const Cluster& b, const ClusterState& point) {
    failure_ = point.describeFailure(b.loop, b.work->scratch);
    return false;
  }
  void loadStateCost();
  // Rt of setResiduals(), columns of rows that count.
  void updateResidualDerivatives(const ResidualStack& stack, bool running, PaddedMap Rt);
  void updateDriftAccelerations();
  void updateContacts();
  bool solveContacts();
  void stepFreeJoints();
  bool closeStep(const ReducedNode* previous);
  void finishStep();
  void showView(LaneView& view);
  // Derivatives of the contact forces by (u, dy, dy_v), one column per row of the contacts.
  PaddedMap shapeForceDerivatives() const;
  void loadContactDerivatives(const LaneView& view);
  void linearizeDynamics(LaneView& view);
  bool linearizeCluster(size_t i, LaneView::Cluster& view, ConstVectorRef x_next_node, StageModel& out);
  // The contact of this stage in a slot, as an index of its constraints; -1 if it has none there.
  int findContact(int slot) const;
  // The contact row of a row of a slot, -1 if this stage has none there.
  int getContactRow(size_t slot, int row) const { return slot_rows_[6 * slot + row]; }
  // Whether a contact has other rows than the first ones of its six.
  bool hasHinges() const;
  void linearizeFreeJoint(FreeJoint& free, const StageModel& out) const;
  PaddedMap shapeAccelerationDerivatives(LaneView& view) const;
  void assembleStep(LaneView& view, StageModel& out) const;
  void addMotorRows(PaddedMap out) const;
  // Whether the bases of this node are those at x.
  bool isKnown(ConstVectorRef x) const;
  void differenceAbout(Cluster& b, const MatrixXd& WN, ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const;
  void differenceFree(ConstVectorRef x0, ConstVectorRef x1, VectorRef dx) const;
  bool updateChart(ConstVectorRef x);
  void storeChart();

  // The memory of this thread; every function called from outside takes it first.
  void takeWork();

  const Reduction& reduction_;
  std::shared_ptr<ReducedWorkPool> pool_;
  ReducedWork* work_ = nullptr;
  const Workspace* shown_ = nullptr;
  std::vector<ClusterNode> clusters_;
  std::vector<int> contact_slots_;  // per contact
  std::vector<int> slot_rows_;      // per slot, see getContactRow()
  int num_loops_ = 0, loop_rows_ = 0, contact_rows_ = 0;
  std::vector<SE3> X_WB_;
  VectorXd q_, v_, tau_, a_;             // of the last update
  const ReducedNode* before_ = nullptr;  // within a step: the node whose next state this is, if known
  SaddlePointFactors factors_;           // of Eq. (b)
  VectorXd chart_x_;
  const StateCost* state_cost_;  // of the stage, the same object for equal ones; null: none
  bool has_state_value_ = false;
  double state_value_ = 0;                       // of the state cost at the last update
  VectorXd state_difference_;                    // nv, and of q to its reference
  const StateCostModel* state_model_ = nullptr;  // derivatives, where lanes have made them
};

}  // namespace bielle
