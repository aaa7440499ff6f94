#include "bielle/dynamics/workspace.h"

#include <stdexcept>

namespace bielle {

Workspace::Workspace(const Model& model) {
  const int nb = model.numBodies(), nv = model.nv();
  q.setZero(model.nq());
  X_WB.resize(nb);
  Y.assign(nb, Matrix6d::Zero());
  v.setZero(nv);
  a.setZero(nv);
  V.assign(nb, Vector6d::Zero());
  h.assign(nb, Vector6d::Zero());
  hc.assign(nb, Vector6d::Zero());
  A.assign(nb, Vector6d::Zero());
  F.assign(nb, Vector6d::Zero());
  Yc.assign(nb, Matrix6d::Zero());
  Bc.assign(nb, Matrix3d::Zero());
  for (Matrix6Xd* m : {&J, &w_minus, &dJ, &dV, &dA, &YJ, &BtJ, &Gq, &Gv}) m->setZero(6, nv);
  M.setZero(nv, nv);
  b.setZero(nv);
  dID_dq.setZero(nv, nv);
  dID_dv.setZero(nv, nv);
}

void requireStage(const Workspace& ws, WorkspaceStage stage, const char* function, const char* call) {
  if (ws.stage < stage) throw std::logic_error(std::string(function) + " needs " + call + " to be called first");
}

}  // namespace bielle
