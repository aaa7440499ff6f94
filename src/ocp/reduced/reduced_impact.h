#pragma once
// Rigid impacts (dynamics/impact.h) in the reduced formulation: (q, v) becomes (q, v+). The bases stay, and with
// dq = N dy, dv = N dy_v + Z dy, dv+ = N dy_v+ + Z+ dy+, where (W N)^T Z+ = 0,
//     dy+ = dy,   dy_v+ = (W N)^T ((D_q N + D_v Z) dy + D_v N dy_v)                                                 (a)
// with a change to the node state's own basis if a gap is open. Impacts are few: they are solved with all dofs, one by
// one.
#include "ocp/reduced/node_assembly.h"

namespace bielle {

class ReducedImpact {
 public:
  ReducedImpact(const Model& model, const Reduction& reduction);

  // Computes v+ and impulses at a state that the kernel has placed; a failure is recorded in the status.
  void update(const ReducedKernel::StepItem& item);
  // Eq. (a), and the derivatives of the impulses.
  NumericalStatus linearize(const ConstraintSet& constraints, const ReducedEvaluation& at,
                            const ReducedEvaluation& next, const LaneView& view, NodeAssembly& assembly,
                            StageModel& out);

 private:
  struct Cluster {
    explicit Cluster(const ReducedCluster& c);
    const ReducedCluster& cluster;
    ClusterScratch scratch;
    ClusterMotion ahead;  // at q+, in the cluster
    ClusterGapOf<double> gap;
    MatrixXd WNP;  // n x r: W N P_v^T
  };
  void linearizeCluster(size_t index, const ReducedEvaluation& at, const ReducedEvaluation& next, StageModel& out);
  void updateGap(Cluster& c, const ClusterNode& node, const ClusterBasis& next);
  void linearizeFreeJoint(const NodeAssembly::FreeJoint& free, StageModel& out) const;

  Model model_;
  const Reduction& reduction_;
  std::vector<Cluster> clusters_;
  MatrixXd D_y_, D_v_;  // size x nv, transposes of D_q N + D_v Z and D_v N
};

}  // namespace bielle
