#include "motion.h"

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "model/joint.h"
#include "simbody_bridge.h"

namespace bielle::validation {
namespace {

struct StateRate {
  VectorXd d, v;  // d' and v' of Eq. (1)
};

class Integrator {
 public:
  explicit Integrator(const Model& model)
      : model_(model), set_(makeConstraintSet(model)), ws_(model), J_q_(model.nv(), model.nv()), J_dv_(J_q_) {}

  // One step of length h; false when the dynamics have no solution.
  bool step(double h, VectorXd& q, VectorXd& v) {
    const VectorXd zero = VectorXd::Zero(model_.nv());
    StateRate k1, k2, k3, k4;
    if (!calcRate(q, zero, v, k1) || !calcRate(q, h / 2 * k1.d, v + h / 2 * k1.v, k2) ||
        !calcRate(q, h / 2 * k2.d, v + h / 2 * k2.v, k3) || !calcRate(q, h * k3.d, v + h * k3.v, k4))
      return false;
    q = model_.integrate(q, h / 6 * (k1.d + 2 * k2.d + 2 * k3.d + k4.d));
    v += h / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v);
    gap = getLarger(gap, retract(model_, ws_, set_, q));
    v = projectVelocity(model_, ws_, set_, q, v);
    return true;
  }

  double calcEnergy(const VectorXd& q, const VectorXd& v) {
    updatePositions(model_, ws_, q);
    updateVelocities(model_, ws_, v);
    const double kinetic = calcKineticEnergy(model_, ws_);
    kinetic_energy = getLarger(kinetic_energy, kinetic);
    return kinetic + calcPotentialEnergy(model_, ws_);
  }

  double gap = 0, kinetic_energy = 0;  // largest so far

 private:
  bool calcRate(const VectorXd& q, const VectorXd& d, const VectorXd& v, StateRate& rate) {
    rate.d = v;
    for (int i = 1; i < model_.numBodies(); ++i) {
      const Joint& joint = model_.joints()[i];
      auto J_dv = J_dv_.topLeftCorner(joint.nv, joint.nv);
      calcJointIntegrateJacobians(joint, d.segment(joint.idx_v, joint.nv), J_q_.topLeftCorner(joint.nv, joint.nv),
                                  J_dv);
      rate.d.segment(joint.idx_v, joint.nv) = J_dv.inverse() * v.segment(joint.idx_v, joint.nv);
    }
    const VectorXd tau = VectorXd::Zero(model_.nv());
    const NumericalStatus status = updateConstrainedDynamics(model_, ws_, cws_, set_, model_.integrate(q, d), v, tau);
    rate.v = cws_.a;
    return status == NumericalStatus::Ok;
  }

  const Model& model_;
  ConstraintSet set_;
  Workspace ws_;
  ConstrainedWorkspace cws_;
  MatrixXd J_q_, J_dv_;
};

}  // namespace

double retract(const Model& model, Workspace& ws, const ConstraintSet& constraints, VectorXd& q) {
  if (constraints.rows == 0) return 0;
  MatrixXd H(constraints.rows, model.nv()), J(constraints.rows, model.nv());
  VectorXd h(constraints.rows);
  for (int iteration = 0;; ++iteration) {
    updatePositions(model, ws, q);
    H.setZero();
    for (size_t c = 0; c < constraints.closures.size(); ++c) {
      const Closure& closure = constraints.closures[c];
      const int row = constraints.offsets[c], n = getRows(closure.kind);
      h.segment(row, n) = calcClosureResidual(ws, closure);
      calcClosureResidualJacobian(ws, closure, H.middleRows(row, n));
    }
    const double gap = calcLargest(h);
    if (gap < 1e-14 || iteration == 4) return gap;
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
    decomposition.setThreshold(1e-8);
    decomposition.compute(H);
    q = model.integrate(q, -decomposition.solve(h));
  }
}

MotionReport compareMotion(const Model& model, ConstVectorRef q0, ConstVectorRef v0, const MotionOptions& options) {
  MotionReport report;
  Integrator integrator(model);
  VectorXd q = q0, v = v0;
  const double energy = integrator.calcEnergy(q, v);
  const int steps = static_cast<int>(std::lround(options.duration / options.step));
  for (int i = 0; i < steps; ++i) {
    if (!integrator.step(options.duration / steps, q, v)) return report;
    report.energy_error = getLarger(report.energy_error, std::abs(integrator.calcEnergy(q, v) - energy));
  }
  SimbodyBridge simbody(model, model.closures());
  simbody.setState(q0, v0, VectorXd::Zero(model.nv()));
  VectorXd q_simbody, v_simbody;
  simbody.integrate(options.duration, options.simbody_accuracy, q_simbody, v_simbody);
  report.energy_error_simbody = std::abs(simbody.calcKineticEnergy() + simbody.calcPotentialEnergy() - energy);
  report.ok = true;
  report.distance = calcLargest(model.difference(q_simbody, q));
  report.travelled = calcLargest(model.difference(q0, q));
  report.gap = integrator.gap;
  report.kinetic_energy = integrator.kinetic_energy;
  report.q = q;
  report.v = v;
  return report;
}

}  // namespace bielle::validation
