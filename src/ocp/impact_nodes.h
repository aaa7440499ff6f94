#pragma once
// Stages that are rigid impacts (dynamics/impact.h), in both formulations: (q, v) becomes (q, v+).
//
// Full:    dq+ = dq,   dv+ = D_q dq + D_v dv.
// Reduced: the bases stay, and with dq = N dy, dv = N dy_v + Z dy, dv+ = N dy_v+ + Z+ dy+, where (W N)^T Z+ = 0,
//     dy+ = dy,   dy_v+ = (W N)^T ((D_q N + D_v Z) dy + D_v N dy_v)                                                   (a)
// read about the node state's own basis where a gap is open. Impacts are few: they are solved with all dofs.
#include "bielle/dynamics/impact.h"
#include "full_node.h"
#include "reduced_node.h"

namespace bielle {

class FullImpactNode : public FullNode {
 public:
  FullImpactNode(const Model& model, const StageSpec& spec);
  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;

 private:
  ImpactWorkspace iws_;
};

class ReducedImpactNode : public ReducedNode {
 public:
  ReducedImpactNode(const Model& model, const Reduction& reduction, const StageSpec& spec,
                    std::shared_ptr<ReducedWorkPool> pool);
  bool updateStep(ConstVectorRef x, ConstVectorRef u, const NodeModel* previous) override;
  bool startStep(ConstVectorRef, ConstVectorRef, const NodeModel*) override { return false; }
  void prepareLinearization(const Linearization*, int) override {}
  bool linearizeStep(ConstVectorRef x_next_node, StageModel& out) override;

 private:
  void updateForceDerivatives();
  bool linearizeCluster(Cluster& b, ConstVectorRef x_next_node, StageModel& out);
  bool updateGap(Cluster& b);
  void linearizeFreeJoint(const FreeJoint& free, StageModel& out) const;

  ImpactWorkspace iws_;
  MatrixXd D_y_, D_v_;  // size x nv, transposes of D_q N + D_v Z and D_v N
};

}  // namespace bielle
