#pragma once
// Up to kLane steps and their derivatives at once, one node per lane (lanes.h): what reduced_node.h needs of the mechanism for
// its Eqs. (b) to (g). Nodes may have different contacts and time steps. What is left to each of them is its residuals, its
// quadratic model, and the system of its contacts where some are redundant.
#include "bielle/dynamics/reduced_tree.h"
#include "cluster_gap.h"
#include "contact_system.h"
#include "reduced_state_cost.h"

namespace bielle {

class ReducedNode;

// One cluster of loops at the nodes of all lanes.
struct ClusterLanes {
  explicit ClusterLanes(const ReducedCluster& l);
  const ReducedCluster& loop;
  ClusterBasisOf<Lanes> at, next;                      // at the states, at q+
  WorkspaceOf<Lanes> own;                              // of the cluster's model at q+
  ClusterMotionOf<Lanes> motion, ahead;                // at the states, in the whole model; at q+, in the cluster
  VectorX<Lanes> left, step, zeta, independent, rows;  // n, n, rank, rank, m
  MatrixX<Lanes> HN, HnNn, JqN, P, Pn;                 // n x r, as in reduced_node.h
  MatrixX<Lanes> E, En, S, X, Xn;                      // r x r: those of Eqs. (f) and (g)
  MatrixX<Lanes> mixed, mixed_next;                    // r x r: P^T N', P'^T N'
  std::vector<LogicOf<Lanes>::Index> pivots;
  // r x r: dy+ and dy_v+ of Eq. (g) by dy and dy_v; by dy' they are h times those by dy_v
  MatrixX<Lanes> q_y, q_v, v_y, v_v;
  ClusterGapOf<Lanes> gap;  // to the node states
  VectorX<Lanes> q_near;    // nq, where a basis is known that may be that of a node state
  LaneMask turned, placed;  // where X exists; where the bases of the node states do
  // Of a step
  ClusterScratchOf<Lanes> scratch;
  ClusterStateOf<Lanes> closing;                                  // at q+
  VectorX<Lanes> drift, a_d, predicted, surplus, target, v_next;  // rank, n, rank, rank, r, n
};

// A contact that some node may have, always at the same body.
struct ContactLanes {
  int tip = 0;                 // index among the tips
  bool used = false;           // by some lane
  SE3Of<Lanes> X_WF;           // of the contact's frame
  Vector6<Lanes> wrench;       // on the body, world
  Lanes kd;                    // gain
  Matrix6<Lanes> kp_rate;      // kp times the residual's rate by the frame's twist
  Matrix6X<Lanes> dy, dv;      // 6 x outer coordinates of the tip: Eq. (c) for all six rows
  Vector6<Lanes> kp_residual;  // kp times the residual
  Matrix6X<Lanes> J;           // 6 x outer coordinates, all rows of J_c N
  Vector6<Lanes> gamma;        // all rows of gamma_c + J_c a_d
};

// What one lane holds, for its node alone.
struct LaneView {
  LaneView(const Model& model, const Reduction& reduction, const std::vector<ClusterLanes>& clusters,
           const std::vector<ContactLanes>& contacts);
  struct Cluster {
    MatrixXd Z, q_y, q_v, v_y, v_v;  // as in ClusterLanes
    VectorXd gap, gap_v;             // r
    bool turned, placed;
  };
  struct Contact {
    Matrix6Xd dy, dv;  // as in ContactLanes
  };
  Workspace ws;   // V and hc behind a step; what residuals look at, behind linearize()
  VectorXd dydd;  // (nu + 2 size) x size, padded: room, A_y^T, A_v^T
  std::vector<Cluster> clusters;
  std::vector<Contact> contacts;
  StateCostModel state_cost;
};

// `get` says where the numbers of an item are; lanes without an item do what the first one does.
template <typename Item, typename Get, typename Out>
void packItems(const Item* items, int count, const Get& get, Out& out) {
  std::array<const double*, kLane> in;
  for (int l = 0; l < kLane; ++l) in[l] = get(items[l < count ? l : 0]);
  packLanes(in, out.size(), out.data());
}

class ReducedLanes {
 public:
  // \param slots  tips of all contacts that one node may have, a tip with two contacts twice
  ReducedLanes(const Model& model, const Reduction& reduction, const std::vector<int>& tips,
               const std::vector<int>& slots);

  // Steps of at most kLane reduced nodes whose states and motor forces are there, and the bases of those that go on from
  // another node. Finds the bases of the others (`placed`: where that went through) and solves Eq. (b); returns where.
  LaneMask startSteps(NodeModel* const* nodes, int count, LaneMask& placed);
  // Eq. (b) of a lane where it did not, with gamma at the contact rows of its node; and its solution back.
  void loadSystem(int lane, MatrixXd& M, MatrixXd& JcN, VectorXd& f, VectorXd& gamma) const;
  void storeAccelerations(int lane, const VectorXd& ydd);
  // The rest of the steps; returns where that went through.
  LaneMask finishSteps();
  // What the nodes keep, but for those that failed.
  void storeSteps(const bool* ok);

  // ReducedNode::calcDifferences() for at most kLane nodes whose charts are those at x0.
  void calcDifferences(const NodeModel::Difference* items, int count);

  // ReducedNode::integrate() for at most kLane nodes whose bases are those at x; tells where that went through.
  LaneMask integrate(const NodeModel::Integration* items, int count);

  // Derivatives about the last step of each of at most kLane reduced nodes.
  void linearize(const NodeModel::Linearization* items, int count);

  // Lane of a node of the last call, -1 for others.
  int findLane(const ReducedNode* node) const;

  LaneView& getView(int lane) { return views_[lane]; }
  // Reduced coordinates that move the contact of a slot.
  const std::vector<int>& getOuter(int slot) const { return tree_.getTip(contacts_[slot].tip).outer; }

 private:
  template <typename Get>
  void pack(const Get& get, Eigen::Index size, Lanes* out) const;
  template <typename Get>
  void unpack(const Lanes* in, Eigen::Index size, const Get& get, Eigen::Index stride = 1) const;
  template <typename Get>
  void setNodes(int count, const Get& get) {
    nodes_.clear();
    for (int l = 0; l < count; ++l) nodes_.push_back(get(l));
  }
  void packPlacements();
  void packNodes();
  LaneMask updatePoints();
  template <typename GetBasis>
  void packBasis(const ReducedCluster& cluster, const GetBasis& getBasis, ClusterBasisOf<Lanes>& to) const;
  void packPoint(size_t i);
  void packClusterStep(size_t i);
  void packCluster(size_t i);
  void packSteps();
  void updateContactRows(size_t slot);
  void storeFactors(const LaneMask& solved);
  void storeForces(size_t lane);
  void storeDerivatives();
  LaneMask close(ClusterLanes& b);
  void packContact(size_t slot);
  bool packStateCosts();
  void updateStateCosts();
  void linearizeStateCosts();
  void updateForces();
  void updateContact(ContactLanes& contact);
  void linearizeStep(ClusterLanes& b);
  void updateGap(size_t i, const NodeModel::Linearization* items);
  void findNodeBasis(size_t i, const NodeModel::Linearization* items, const LaneMask& open);

  const Model& model_;
  const Reduction& reduction_;
  const std::vector<int>& tips_;
  std::vector<ReducedNode*> nodes_;
  WorkspaceOf<Lanes> ws_;
  std::vector<ClusterLanes> clusters_;
  std::vector<ClusterLiftOf<Lanes>> lifts_;
  std::vector<ContactLanes> contacts_;
  struct FreeDofs {
    int dof, offset, size;  // of a joint outside all loops: velocity coordinates, reduced coordinates
  };
  std::vector<FreeDofs> free_;
  ReducedTreeOf<Lanes> tree_;
  std::vector<Vector6<Lanes>> f_ext_;  // nb
  VectorX<Lanes> v_, a_, tau_;         // nv
  VectorX<Lanes> x0_, x1_, dx_;        // nq + nv, nq + nv, 2 size
  Lanes h_;
  MatrixX<Lanes> A_y_, A_v_;  // size x size, reduced_tree.h Eqs. (2) and (3)
  ContactSystem system_;      // six rows for each slot
  ReducedStateCostOf<Lanes> state_cost_;
  std::array<const StateCost*, kLane> state_costs_{};  // whose references it holds
  std::vector<LaneView> views_;
};

}  // namespace bielle
