#pragma once
// A node of the reduced formulation as a value, and the layout of a problem's nodes, known before evaluation.
#include "bielle/dynamics/impact.h"
#include "dynamics/loop_bases.h"
#include "dynamics/saddle_point.h"
#include "ocp/transcription.h"

namespace bielle {

// A cluster at one node.
struct ClusterNode {
  explicit ClusterNode(const ReducedCluster& cluster) : at(cluster), next(cluster) {
    v_next.setZero(cluster.model.nv());
  }
  ClusterBasis at;    // at the state
  ClusterState next;  // at q+
  VectorXd v_next;    // n, v+
};

// Half way along a midpoint step: robot_problem.h Eq. (2).
struct ReducedMidpoint {
  ReducedMidpoint(const Model& model, const Reduction& reduction);
  std::vector<SE3> X_WB;               // nb
  std::vector<ClusterState> clusters;  // closed by the first drift
  VectorXd v;                          // nv, after it
  VectorXd a, lambda;                  // nv, constraint rows; with that velocity: they foresee the velocity half way
};

// It stores only what is expensive to recompute, so that a long horizon fits into the caches.
struct ReducedEvaluation : RobotEvaluation {
  ReducedEvaluation(const Model& model, const Reduction& reduction) : X_WB(model.numBodies()) {
    clusters.reserve(reduction.clusters.size());
    for (const ReducedCluster& cluster : reduction.clusters) clusters.emplace_back(cluster);
  }
  int leading = 0;        // of a step: rows of F^T before those of (dy, dy_v), countLeading()
  std::vector<SE3> X_WB;  // nb
  std::vector<ClusterNode> clusters;
  SaddlePointFactors factors;                 // of reduced_kernel.h, Eq. (b)
  std::unique_ptr<ImpactWorkspace> impact;    // only of an impact
  std::unique_ptr<ReducedMidpoint> midpoint;  // only of a midpoint step
};

// The bases at its state.
class NodeBases : public LoopBases {
 public:
  NodeBases(const Reduction& reduction, const ReducedEvaluation& at) : reduction_(reduction), at_(at) {}
  const ReducedCluster& getCluster(int index) const override { return reduction_.clusters[index]; }
  const ClusterBasis& getBasis(int index) const override { return at_.clusters[index].at; }

 private:
  const Reduction& reduction_;
  const ReducedEvaluation& at_;
};

// Contacts of one node. A slot holds one contact, always on the same body; two contacts of a body take two slots.
struct ContactLayout {
  struct Contact {
    const Closure* closure;
    int slot;
    int row, rows;  // among the contact rows
    Matrix3d turn;  // from the angular part of a twist in the contact frame to the last rows; zero for rows it lacks
  };
  std::vector<Contact> contacts;
  int closure_rows = 0;  // of the model's closures, which come before the contacts
  int rows = 0;          // of all contacts
};

// All nodes of a problem.
struct ReducedLayout {
  ReducedLayout(const Model& model, const Reduction& reduction, const std::vector<StageSpec>& specs);
  // After the spec of a node has been replaced. \throws std::invalid_argument when its contacts need other slots
  void updateStage(int node, const std::vector<StageSpec>& specs);
  // After the state cost of a node has changed.
  void updateStateCost(int node, const std::vector<StageSpec>& specs);

  std::vector<int> tips;                 // bodies in contact at some stage
  std::vector<std::vector<int>> outers;  // per tip, reduced coordinates that move it
  std::vector<int> slots;                // tip of each slot
  std::vector<ContactLayout> contacts;   // per node
  int most_contact_rows = 0, most_constraint_rows = 0;
  // Per node, -1: none. Nodes with equal costs have the same number, which no other cost ever had.
  std::vector<int> state_costs;

 private:
  ContactLayout makeContacts(const StageSpec& spec) const;
  int next_state_cost_ = 0;
};

}  // namespace bielle
