#include <limits>

#include "bielle/results/result.h"

namespace bielle {

VectorXd calcRmsEfforts(const Model& model, const MotionRecord& record) {
  const RowMatrixXd& velocities = record.has_midpoints ? record.v_mid : record.v;
  const double duration = record.time[record.time.size() - 1] - record.time[0];
  VectorXd squares = VectorXd::Zero(model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    for (Eigen::Index k = 0; k < record.u.rows(); ++k) {
      const double u = record.u(k, m), c = motor.getEffortFactor(u * velocities(k, motor.dof));
      squares[m] += (record.time[k + 1] - record.time[k]) * (c * u) * (c * u);
    }
  }
  return duration > 0 ? VectorXd((squares / duration).cwiseSqrt()) : squares;
}

ElectricalEnergy calcElectricalEnergy(const Model& model, const MotionRecord& record, double regeneration) {
  ElectricalEnergy out;
  out.regeneration = regeneration;
  out.by_motor.setZero(model.nu());
  const RowMatrixXd& velocities = record.has_midpoints ? record.v_mid : record.v;
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    out.num_assumed += motor.torque_loss ? 0 : 1;
    for (Eigen::Index k = 0; k < record.u.rows(); ++k) {
      const double h = record.time[k + 1] - record.time[k], u = record.u(k, m);
      out.by_motor[m] += h * calcElectricalPower(motor, u, velocities(k, motor.dof), regeneration);
    }
  }
  out.total = out.by_motor.sum();
  const Eigen::Index last = record.com.rows() - 1;
  out.distance = (record.com.row(last) - record.com.row(0)).head<2>().norm();
  out.cost_of_transport = out.distance < ElectricalEnergy::kLeastDistance
                              ? std::numeric_limits<double>::quiet_NaN()
                              : out.total / (model.mass() * model.gravity().norm() * out.distance);
  return out;
}

}  // namespace bielle
