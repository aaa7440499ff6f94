#include "control/dead_point_stop.h"

#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

constexpr double kLookAhead = 0.02;  // T, s
constexpr double kDamping = 0.4;     // k: a share of the motor's speed is taken away in an instant of control

}  // namespace

DeadPointStop::DeadPointStop(const Model& model, ConstVectorRef q, double stop) : model_(model), stop_(stop) {
  if (stop_ <= 0) return;
  linkages_ = listLinkages(model, q);
  Workspace ws(model);
  updatePositions(model, ws, q);
  updateMassMatrix(model, ws);
  inertia_.resize(model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const int dof = model.motors()[m].dof;
    inertia_[m] = ws.M(dof, dof);
  }
  gradient_.setZero(model.nu());
  for (const Linkage& linkage : linkages_) memory_.get(linkage);  // allocates
}

void DeadPointStop::add(const Measurement& measurement, VectorRef u) {
  period_ = measurement.time > time_ ? measurement.time - time_ : period_;
  time_ = measurement.time;
  if (period_ <= 0) return;  // the first instant
  for (const Linkage& linkage : linkages_) {
    const double rho = calcTransmission(linkage, memory_, model_, measurement.q, gradient_);
    brake(rho, 1, measurement, u);
    if (rho != 0) brake(1 / rho, -1 / (rho * rho), measurement, u);
  }
}

// Eq. (2) for s, whose derivative by rho is given.
void DeadPointStop::brake(double s, double ds, const Measurement& measurement, VectorRef u) const {
  const double slope = gradient_.norm() * std::abs(ds);
  if (!(slope > 0)) return;
  double speed = 0, inertia = 0;
  for (int m = 0; m < model_.nu(); ++m) {
    const double along = gradient_[m] * ds / slope;
    speed += along * measurement.v[model_.motors()[m].dof];
    inertia += along * along * inertia_[m];
  }
  const double way = (s - stop_) / slope;
  const double approach = -(way / kLookAhead + speed);
  if (!(approach > 0)) return;
  const double damping = kDamping * inertia / (period_ + measurement.delay);
  u += damping * approach * ds / slope * gradient_;
}

}  // namespace bielle
