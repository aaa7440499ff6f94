#include "dynamics/linkage_workspace.h"
#include "dynamics/reduction.h"
#include "ocp/residual_data.h"

namespace bielle {
namespace {

class TransmissionResidual : public DescribedResidual {
 public:
  explicit TransmissionResidual(const Linkage& linkage) : linkage_(linkage) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    LinkageWorkspaces own;
    r[0] = calcTransmission(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws, node.loops);
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    LinkageWorkspaces own;
    calcTransmissionJacobian(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws, rows.q, node.loops);
  }
  ResidualData describe() const override {
    const ReducedCluster& cluster = *linkage_.cluster;
    const auto inModel = [&](std::vector<int> dofs) {
      for (int& dof : dofs) dof = cluster.dofs[dof];
      return dofs;
    };
    std::vector<int> bodies;
    for (const Closure& twist : linkage_.bodies) bodies.push_back(cluster.joints[twist.body1 - 1]);
    ResidualData data{"transmission",
                      {{"closures", cluster.closure_indices},
                       {"dofs", cluster.dofs},
                       {"motor_dofs", inModel(linkage_.motor_dofs)},
                       {"output_dofs", inModel(linkage_.joint_dofs)},
                       {"output_bodies", bodies},
                       {"root", cluster.root},
                       {"length", linkage_.length},
                       {"reference", linkage_.reference},
                       {"reference_volume", linkage_.reference_volume}}};
    if (linkage_.idle > 0) data.values.emplace_back("idle", linkage_.idle);
    return data;
  }

 private:
  Linkage linkage_;
};

}  // namespace

std::unique_ptr<Residual> makeTransmission(const Linkage& linkage) {
  return std::make_unique<TransmissionResidual>(linkage);
}

}  // namespace bielle
