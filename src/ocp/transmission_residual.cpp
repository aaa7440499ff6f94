#include "bielle/ocp/residual.h"
#include "dynamics/linkage_workspace.h"

namespace bielle {
namespace {

class TransmissionResidual : public Residual {
 public:
  explicit TransmissionResidual(const Linkage& linkage) : linkage_(linkage) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    LinkageWorkspaces own;
    r[0] = calcTransmission(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws.q, node.loops);
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    LinkageWorkspaces own;
    calcTransmissionJacobian(linkage_, node.linkages ? *node.linkages : own, node.model, node.ws.q, rows.q, node.loops);
  }

 private:
  Linkage linkage_;
};

}  // namespace

std::unique_ptr<Residual> makeTransmission(const Linkage& linkage) {
  return std::make_unique<TransmissionResidual>(linkage);
}

}  // namespace bielle
