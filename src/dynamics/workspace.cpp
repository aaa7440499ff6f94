#include "bielle/dynamics/workspace.h"

#include <stdexcept>

#include "math/lanes.h"

namespace bielle {

template <typename T>
WorkspaceOf<T>::WorkspaceOf(const Model& model) {
  const int nb = model.numBodies(), nv = model.nv();
  armature = model.armature().cast<T>();
  q.setZero(model.nq());
  X_WB.resize(nb);
  Y.assign(nb, Matrix6<T>::Zero());
  v.setZero(nv);
  a.setZero(nv);
  V.assign(nb, Vector6<T>::Zero());
  h.assign(nb, Vector6<T>::Zero());
  hc.assign(nb, Vector6<T>::Zero());
  A.assign(nb, Vector6<T>::Zero());
  F.assign(nb, Vector6<T>::Zero());
  Yc.assign(nb, Matrix6<T>::Zero());
  Bc.assign(nb, Matrix3<T>::Zero());
  for (Matrix6X<T>* m : {&J, &w_minus, &dJ, &dV, &dA, &YJ, &BtJ, &Gq, &Gv}) m->setZero(6, nv);
  M.setZero(nv, nv);
  for (VectorX<T>* x : {&b, &stiffness, &resistance}) x->setZero(nv);
  dID_dq.setZero(nv, nv);
  dID_dv.setZero(nv, nv);
}

template <typename T>
void requireStage(const WorkspaceOf<T>& ws, WorkspaceStage stage, const char* function, const char* call) {
  if (ws.stage < stage) throw std::logic_error(std::string(function) + " needs " + call + " to be called first");
}

void requireBodyVelocities(const Workspace& ws, const char* function) {
  if (ws.stage != WorkspaceStage::Bodies) requireStage(ws, WorkspaceStage::Velocity, function, "updateVelocities");
}

template struct WorkspaceOf<double>;
template struct WorkspaceOf<Lanes>;
template void requireStage(const Workspace&, WorkspaceStage, const char*, const char*);
template void requireStage(const WorkspaceOf<Lanes>&, WorkspaceStage, const char*, const char*);

}  // namespace bielle
