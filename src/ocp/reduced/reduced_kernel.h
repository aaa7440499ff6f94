#pragma once
// The reduced step, its differences and its derivatives: robot_problem.h Eqs. (1), (2) and (4), for as many nodes at
// once as a register of the processor has lanes. Written for one cluster with bases N, J, J^+ and metric W
// (reduction.h) at q, and N', J', J'^+ at q+; a joint outside all clusters is the case N = N' = W = 1 without rows.
//
// A tangent vector (dy, dy_v) at the state means, with Z, d_y and d_v of cluster_motion.h,
//     dq = N dy,   dv = N dy_v + Z dy,   da = N dy' + d_y dy + d_v dy_v                                             (a)
// Dynamics: with a = N y' + a_d, a_d = -J^+ gamma, and hats for projections by N^T from both sides,
//     M^ y' - (J_c N)^T lambda_c = N^T (tau - b - M a_d),    (J_c N) y' = -gamma_c - J_c a_d                        (b)
// where c are the contacts. The closure forces, which N^T eliminates, balance the remainder:
// J^T lambda_l = M a + b - tau - J_c^T lambda_c. Derivatives at fixed lambda_l and lambda_c are those of inverse
// dynamics (reduced_tree.h) and of the contact rows, with the columns J~, .. of the contact's body in place of J_k, ..
// of closure.h Eqs. (1) to (3).                                                                                     (c)
// Kick by k and drift by h: w = v + k a; e is the displacement before closing, A = h J' J_d W^{-1} J^T, and
// K = d(J^T zeta)/dq and K' = d(J'^T mu)/dq' are geometric stiffnesses, S = N'^T K' N':
//     e = (J_q - h J_d W^{-1} K) dq + h J_d dw                                                                      (d)
//     dq+ = e - h J_d W^{-1} J^T A^{-1} J' e,     dw' = dw - W^{-1} K dq - W^{-1} J^T A^{-1} J' e                   (e)
//     dy+ = (W N')^T dq+,   dy_v+ = (W N')^T dw' - S dy+,   mu = J'^{+T} W w'                                       (f)
// S appears because the projection of w' turns with q+. Nothing of the size of J needs to be inverted: (W N')^T times
// the oblique projection of (e) vanishes on J_d W^{-1} J^T, so that P = J_d^{-T} W N reads it. With
// P' = J_d^{-T} W N', X = (P^T N')^{-1}, X' = P'^T N' X, E = P^T J_q N - h N^T K N, and
// (W N)^T Z = (W N)^T d_y = (W N)^T d_v = 0,
//     dy+   = X E dy + h X (dy_v + k dy')
//     dy_v+ = (X' E - P'^T J_q N) / h dy + X' (dy_v + k dy') - S dy+                                                (g)
// An Euler step has k = h. A midpoint step is (g) twice, with h/2 for h: at the state with k = 0, then half way with k
// = h, where a belongs to the foreseen velocity v^ = v + h/2 N y'_0, y'_0 being that of v itself. N turns with q,
//     dy^_v = dy_v + h/2 (dy'_0 + T dy),    T = N^T d(J^T f)/dq N,    f = -J^{+T} W a_d                             (h)
// Where the time scale s of robot_problem.h Eq. (5) is free, h and k are in proportion to it. A longer drift acts like a
// kick along w, and (g) depends on dw only through (W N)^T dw. With y_v = (W N)^T v,
//     dy+_s = h X eta,   dy_v+_s = (X' - h S X) eta - (W N')^T v+ / s,   eta = (y_v + 2 k y') / s                  (i)
// for each drift, k being 0 in the first one of a midpoint step; half way, h y'_0 / (2 s) is added to (h).
// The stabilisation of its contacts is that of the state, and y'_0 has none: robot_problem.h Eq. (2).
// With a gap, the result is read about the node state's own basis (cluster_gap.h).
//
// All of it runs in lanes, even for a single node: the result of a lane does not depend on the others, so that results
// do not depend on batching. Only data whose sizes vary from node to node (costs, F^T) are processed node by node.
#include "dynamics/reduced_tree.h"
#include "ocp/reduced/cluster_gap.h"
#include "ocp/reduced/lane_transfer.h"
#include "ocp/reduced/reduced_evaluation.h"
#include "ocp/reduced/state_cost.h"

namespace bielle {

// A cluster at the nodes of all lanes; n dofs, m closure rows, r reduced coordinates.
struct ClusterLanes {
  explicit ClusterLanes(const ReducedCluster& cluster);
  const ReducedCluster& cluster;
  ClusterBasisOf<Lanes> at;            // at the states
  ClusterMotionOf<Lanes> motion;       // there, in the whole model
  ClusterScratchOf<Lanes> scratch;     // of updates and closings
  ClusterStateOf<Lanes> next;          // at q+
  VectorX<Lanes> v_next;               // n, v+
  VectorX<Lanes> drift, a, d, target;  // rank; n: a_d, then a; n; r
  VectorX<Lanes> left, forces, rows;   // n; rank and m: load on the closures, and their forces
  MatrixX<Lanes> mixed;                // r x r
  std::vector<LogicOf<Lanes>::Index> pivots;
  // Derivatives, named as in the equations
  WorkspaceOf<Lanes> own;                // of the cluster's model at q+
  ClusterMotionOf<Lanes> ahead;          // at q+, in the cluster
  MatrixX<Lanes> KN, KnNn, JqN, P, Pn;   // n x r
  MatrixX<Lanes> E, En, S, X, Xn, PnNn;  // r x r; PnNn = P'^T N'
  MatrixX<Lanes> q_y, q_v, v_y, v_v;     // r x r: dy+ and dy_v+ by dy and dy_v; by dy' they are k times those by dy_v
  ClusterGapOf<Lanes> gap;               // to the node states
};

// The contacts of one slot.
struct ContactLanes {
  int tip = 0;                   // index among the tips
  bool used = false;             // by some lane
  Lanes present;                 // 1 or 0
  SE3Of<Lanes> X_WF;             // of the contact's frame
  Matrix3<Lanes> turn;           // as ContactLayout::Contact::turn
  Lanes kd;                      // gain
  Vector6<Lanes> stabilization;  // kd nu - kp r at the state, as rows; of steps alone
  Matrix6<Lanes> kp_rate;        // kp times the rows of the rate of r by the frame's twist; of derivatives alone
  Vector6<Lanes> wrench;         // on the body, world; of derivatives alone
  Matrix6X<Lanes> dy, dv;        // 6 x outer coordinates of the tip: rows of Eq. (c)

  // Rows of a twist or acceleration in the world, and the wrench on the body of forces on the rows.
  template <typename Derived>
  Vector6<Lanes> selectRows(const Eigen::MatrixBase<Derived>& world) const {
    const Vector6<Lanes> full = X_WF.actInvMotion(world);
    Vector6<Lanes> out;
    linear(out) = present * linear(full);
    angular(out) = turn * angular(full);
    return out;
  }
  Vector6<Lanes> expandRows(const Vector6<Lanes>& rows_force) const {
    Vector6<Lanes> full;
    linear(full) = linear(rows_force);
    angular(full) = turn.transpose() * angular(rows_force);
    return X_WF.actForce(full);
  }
};

// Output of the kernel for one node: the data that residuals read, and derivatives in sizes common to all nodes.
struct LaneView {
  LaneView(const Model& model, const Reduction& reduction, const ReducedTreeOf<Lanes>& tree,
           const ReducedLayout& layout);
  struct Drift {
    MatrixXd q_y, q_v, v_y, v_v;  // as in ClusterLanes
  };
  struct Cluster {
    MatrixXd Z;           // as in ClusterLanes
    MatrixXd Z_mid;       // of a midpoint step: half way, at the velocity foreseen there
    Drift drift;          // of a step; of a midpoint step the second
    Drift first;          // of a midpoint step, Eq. (g) with k = 0
    MatrixXd T;           // r x r, Eq. (h)
    VectorXd gap, gap_v;  // r
  };
  struct Contact {
    Matrix6Xd dy, dv;  // as in ContactLanes
  };
  struct Acceleration {
    // (leading rows + 2 size) x size, padded: room for torques and time scale, then A_y^T and A_v^T of reduced_tree.h
    VectorXd dydd;
    std::vector<Contact> contacts;  // per slot
  };
  Workspace ws;
  Acceleration acceleration;
  Acceleration foreseen;                // that with which a midpoint step foresees its velocity
  std::vector<Contact> stabilizations;  // of a midpoint step, per slot: their derivatives at the state
  std::vector<Cluster> clusters;
  StateCostModel state_cost;
};

// Memory of one thread. Every function takes at most kLane items. Its only output is in these items and in the views,
// one per item.
class ReducedKernel {
 public:
  ReducedKernel(const Model& model, const Reduction& reduction, const ReducedLayout& layout);

  struct StepItem {
    int node;
    const StageSpec* spec;
    const ReducedEvaluation* previous;  // whose q+ is the state, or null
    ReducedEvaluation* at;              // with x and u
  };
  // Steps of one rule: fills `at` except for costs, sets the status of those that succeeded to Ok and the reason why
  // others failed. In the views it fills the data that residuals read.
  void step(const StepItem* items, int count, std::vector<LaneView>& views);
  // The same for states alone, at impacts and the terminal node.
  void place(const StepItem* items, int count, std::vector<LaneView>& views);

  struct LinearizeItem {
    int node;
    const StageSpec* spec;
    const ReducedEvaluation* at;
    const ReducedEvaluation* next;  // at the next node state; not read by linearizeStates()
    bool ok;                        // out
    std::string* failure;           // out, where it is not
  };
  // Derivatives of steps of one rule, all of the views.
  void linearizeSteps(LinearizeItem* items, int count, std::vector<LaneView>& views);
  // The same for states alone: the data that residuals read, Z and the state cost.
  void linearizeStates(LinearizeItem* items, int count, std::vector<LaneView>& views);

  void integrate(const IntegrateTask* tasks, int count);
  void difference(const DifferenceTask* tasks, int count);

  const ReducedTreeOf<Lanes>& tree() const { return tree_; }

 private:
  // reduced_transfer.cpp: copies numbers between nodes and lanes
  // What accelerations belong to.
  enum class Point { State, Foreseen, Midpoint };
  static Point getPoint(const StageSpec& spec) {
    return spec.step == StepRule::Midpoint ? Point::Midpoint : Point::State;
  }
  void loadState(LaneSource<const ReducedEvaluation> nodes, Point point);
  void loadBases(LaneSource<const ReducedEvaluation> nodes);
  void loadMidpointBases(LaneSource<const ReducedEvaluation> nodes);
  void loadPoints(const StepItem* items, int count);
  void loadControls(const StepItem* items, int count);
  void loadSteps(const StageSpec& spec, double h, int lane);
  enum class ContactUse { Step, Stabilization, Derivatives };
  void loadContacts(LaneSource<const ReducedEvaluation> nodes, const int* indices, Point point, ContactUse use);
  void loadContact(int lane, const ContactLayout::Contact& contact, const ReducedEvaluation& node, int closure_rows,
                   Point point, ContactUse use);
  bool loadStateCosts(const int* indices, const StageSpec* const* specs, int count);
  void loadAccelerations(LaneSource<const ReducedEvaluation> nodes, Point point);
  template <typename Get>
  void loadDrift(LaneSource<const ReducedEvaluation> nodes, const Get& get_state);
  void loadFirstDrift(LaneSource<const ReducedEvaluation> nodes);
  void loadLastDrift(LaneSource<const ReducedEvaluation> nodes);
  void storePoints(const StepItem* items, int count);
  void storeNext(size_t cluster, const StepItem* items, int count);
  void storeMidpoint(const StepItem* items, int count);
  void storeForeseen(const StepItem* items, int count);
  void storeStep(const StepItem* items, int count);
  void storeSystem(const StepItem& item, int lane);
  void storeContactForces(const ContactLayout& layout, int lane, VectorXd& lambda) const;
  void storeMotion(int count, std::vector<LaneView>& views) const;
  void storeColumns(int count, std::vector<LaneView>& views) const;
  void storeAcceleration(LaneSource<const ReducedEvaluation> nodes, std::vector<LaneView>& views,
                         LaneView::Acceleration LaneView::*to) const;
  template <typename Get>
  void storeContacts(int count, const Get& get) const;
  void storeMidpointTurns(int count, std::vector<LaneView>& views) const;
  void storeStabilizations(int count, std::vector<LaneView>& views) const;
  void storeDrift(int count, std::vector<LaneView>& views, LaneView::Drift LaneView::Cluster::*to) const;
  void storeGaps(int count, std::vector<LaneView>& views) const;

  // reduced_step.cpp
  LaneMask placeAll(const StepItem* items, int count);
  void placeBodies();
  void updateStateCosts(const StepItem* items, int count);
  LaneMask driftToMidpoint(const StepItem* items, int count);
  void updateSystem();
  void updateStabilizations();
  void updateLoads(Point point);
  void combineAccelerations();
  void foreseeVelocity();
  void driftFreeJoints();
  LaneMask driftCluster(ClusterLanes& c);
  void updateNextVelocity(ClusterLanes& c);
  void updateClosureForces();
  // Rows of a cluster's closures among those of the model.
  template <typename Visit>
  void visitClosureRows(const ReducedCluster& cluster, const Visit& visit) const {
    for (size_t j = 0; j < cluster.closures.closures.size(); ++j)
      visit(cluster.closures.offsets[j], closure_offsets_[cluster.closure_indices[j]],
            getRows(cluster.closures.closures[j].kind));
  }

  // reduced_derivatives.cpp
  struct Batch;
  void linearizeAccelerations(const Batch& batch, Point point);
  void linearizeMidpoints(const Batch& batch, LinearizeItem* items, std::vector<LaneView>& views);
  void updateForces();
  void updateContact(ContactLanes& contact);
  void addStabilization(ContactLanes& contact);
  void linearizeStabilizations(const Batch& batch, std::vector<LaneView>& views);
  void updateDrifts(LinearizeItem* items, int count);
  LaneMask updateClusterDerivatives(ClusterLanes& c);
  void storeTurns(int count, std::vector<LaneView>& views);
  void updateGap(size_t cluster, const LinearizeItem* items, int count);
  void linearizeStateCosts(const LinearizeItem* items, int count, std::vector<LaneView>& views);

  Model model_;
  const Reduction& reduction_;
  const ReducedLayout& layout_;
  WorkspaceOf<Lanes> ws_;
  std::vector<ClusterLanes> clusters_;
  std::vector<ClusterLiftOf<Lanes>> lifts_;
  ReducedTreeOf<Lanes> tree_;
  std::vector<ContactLanes> contacts_;  // per slot
  VectorX<Lanes> v_, a_, tau_, x1_;     // nv; nq + nv: the next states
  VectorX<Lanes> v_mid_;                // nv, the velocity foreseen half way
  Lanes kick_, drift_;                  // k and h of Eq. (g), s
  // Eq. (b), six rows for each slot
  SaddlePointOf<Lanes> system_;
  MatrixX<Lanes> M_, JcN_;                           // size x size, rows x size
  VectorX<Lanes> f_, gamma_, ydd_, contact_forces_;  // size, rows
  VectorX<Lanes> closure_forces_;                    // rows of all closures
  std::vector<int> closure_offsets_;                 // first row of each closure of the model
  VectorX<Lanes> u_, dx_;                            // nu; 2 size
  std::vector<Vector6<Lanes>> f_ext_;                // nb
  MatrixX<Lanes> A_y_, A_v_;                         // size x size, reduced_tree.h Eqs. (2) and (3)
  ReducedStateCost state_cost_;
  std::array<int, kLane> loaded_costs_;  // whose references and weights it holds
};

}  // namespace bielle
