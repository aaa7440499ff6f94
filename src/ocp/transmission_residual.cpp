#include "bielle/ocp/residual.h"

namespace bielle {
namespace {

class TransmissionResidual : public Residual {
 public:
  explicit TransmissionResidual(Transmission transmission) : transmission_(std::move(transmission)) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override {
    r[0] = calcTransmission(transmission_, node.model, node.ws.q, node.loops);
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    calcTransmissionJacobian(transmission_, node.model, node.ws.q, rows.q, node.loops);
  }

 private:
  Transmission transmission_;
};

}  // namespace

std::unique_ptr<Residual> makeTransmission(const Transmission& transmission) {
  return std::make_unique<TransmissionResidual>(transmission);
}

}  // namespace bielle
