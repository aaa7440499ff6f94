#include <cmath>

#include "dynamics/linkage_workspace.h"
#include "dynamics/reduction.h"
#include "ocp/residual_data.h"

namespace bielle {
namespace {

class TransmissionResidual : public DescribedResidual {
 public:
  TransmissionResidual(const Linkage& linkage, double largest) : linkage_(linkage), largest_(largest) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    LinkageWorkspaces own;
    const double rho =
        calcTransmission(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws, node.loops);
    if (!isBeyond(rho)) {
      r[0] = rho;
      return;
    }
    const double beyond = std::atan(rho) + (rho < 0 ? M_PI : 0) - std::atan(largest_);
    r[0] = largest_ + (1 + largest_ * largest_) * beyond;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    LinkageWorkspaces own;
    const double rho = calcTransmissionJacobian(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws,
                                                rows.q, node.loops);
    if (!isBeyond(rho)) return;
    const double slope = (1 + largest_ * largest_) / (1 + rho * rho);
    for (int dof : linkage_.cluster->dofs) rows.q(0, dof) *= slope;
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
                       {"reference_volume", linkage_.reference_volume},
                       {"largest", largest_}}};
    if (linkage_.idle > 0) data.values.emplace_back("idle", linkage_.idle);
    return data;
  }

 private:
  bool isBeyond(double rho) const { return rho > largest_ || rho < -1; }

  Linkage linkage_;
  double largest_;
};

}  // namespace

std::unique_ptr<Residual> makeTransmission(const Linkage& linkage, double largest) {
  return std::make_unique<TransmissionResidual>(linkage, largest);
}

}  // namespace bielle
