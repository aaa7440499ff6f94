#include "worlds/posture_hold.h"

#include "bielle/dynamics/assembly.h"
#include "bielle/motion/motion.h"

namespace bielle::worlds {

PostureHold::PostureHold(const Model& model) : model_(model), q_(makeStandingPosture(model)) {
  std::vector<int> feet;
  for (size_t c = 0; c < model.contacts().size(); ++c) feet.push_back(static_cast<int>(c));
  u_ = calcStaticTorques(model, makeConstraintSet(model, makeContactTargets(model, q_, feet, 0, 0)), q_).u;
}

VectorXd PostureHold::calcTorques(ConstVectorRef q, ConstVectorRef v) const {
  VectorXd u = u_;
  for (int m = 0; m < model_.nu(); ++m) {
    const Motor& motor = model_.motors()[m];
    const int at = model_.joints()[motor.joint].idx_q;
    u[m] += kStiffness * (q_[at] - q[at]) - kDamping * v[motor.dof];
  }
  return u;
}

}  // namespace bielle::worlds
