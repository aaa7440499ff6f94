#include <cmath>

#include "dynamics/linkage_workspace.h"
#include "dynamics/reduction.h"
#include "ocp/residual_data.h"

namespace bielle {
namespace {

class TransmissionArctan : public DescribedResidual {
 public:
  explicit TransmissionArctan(const Linkage& linkage) : linkage_(linkage) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    LinkageWorkspaces own;
    const double rho =
        calcTransmission(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws, node.loops);
    r[0] = std::atan(rho) + (rho < -1 ? M_PI : 0);
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    LinkageWorkspaces own;
    const double rho = calcTransmissionJacobian(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws,
                                                rows.q, node.loops);
    for (int dof : linkage_.cluster->dofs) rows.q(0, dof) /= 1 + rho * rho;
  }
  ResidualData describe() const override {
    const ReducedCluster& cluster = *linkage_.cluster;
    const auto inModel = [&](std::vector<int> dofs) {
      for (int& dof : dofs) dof = cluster.dofs[dof];
      return dofs;
    };
    std::vector<int> bodies;
    for (const Closure& twist : linkage_.bodies) bodies.push_back(cluster.joints[twist.body1 - 1]);
    ResidualData data{"transmission_arctan",
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

std::unique_ptr<Residual> makeTransmissionArctan(const Linkage& linkage) {
  return std::make_unique<TransmissionArctan>(linkage);
}

}  // namespace bielle
