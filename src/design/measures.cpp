#include "bielle/design/measures.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/reduction.h"

namespace bielle {
namespace {

// Positions of the motors among the dofs of a block.
std::vector<int> findMotors(const Model& model, const LoopBlock& block) {
  std::vector<int> positions;
  for (size_t i = 0; i < block.dofs.size(); ++i)
    for (const Motor& motor : model.motors())
      if (motor.dof == block.dofs[i]) positions.push_back(static_cast<int>(i));
  return positions;
}

// 1 / sigma_min(Q_M); infinite when the block cannot be evaluated.
double calcConditioning(const LoopBlock& block, const std::vector<int>& motors, BlockPoint& point,
                        const VectorXd& q_block) {
  if (!point.update(block, q_block)) return std::numeric_limits<double>::infinity();
  const MatrixXd& N = point.basis().N;
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(N).householderQ() * MatrixXd::Identity(N.rows(), N.cols());
  MatrixXd Q_M(motors.size(), Q.cols());
  for (size_t i = 0; i < motors.size(); ++i) Q_M.row(static_cast<Eigen::Index>(i)) = Q.row(motors[i]);
  const double least = Eigen::JacobiSVD<MatrixXd>(Q_M).singularValues().tail<1>()[0];
  return least > 0 ? 1 / least : std::numeric_limits<double>::infinity();
}

double calcWorstConditioning(const Model& model, const ShootingTrajectory& trajectory) {
  double worst = 1;
  if (model.closures().empty()) return worst;
  const Reduction reduction = makeReduction(model, trajectory.xs.front().head(model.nq()));
  for (const LoopBlock& block : reduction.blocks) {
    const std::vector<int> motors = findMotors(model, block);
    if (static_cast<int>(motors.size()) < block.size || block.size == 0) continue;  // moved by others too
    BlockPoint point(block);
    VectorXd q_block(block.model.nq());
    for (const VectorXd& x : trajectory.xs) {
      gatherConfiguration(model, block, x.head(model.nq()), q_block);
      worst = std::max(worst, calcConditioning(block, motors, point, q_block));
    }
  }
  return worst;
}

}  // namespace

MotionMeasures calcMotionMeasures(const Model& model, const std::vector<double>& dt,
                                  const ShootingTrajectory& trajectory) {
  MotionMeasures out;
  double duration = 0;
  for (double h : dt) duration += h;
  for (int m = 0; m < model.nu(); ++m) {
    MotorMeasures motor;
    double squares = 0;
    for (size_t k = 0; k < dt.size(); ++k) {
      const double h = dt[k], u = h > 0 ? trajectory.us[k][m] : 0;  // an impact takes no time and no torque
      const double v = trajectory.xs[k][model.nq() + model.motors()[m].dof];
      motor.peak_torque = std::max(motor.peak_torque, std::abs(u));
      motor.peak_speed = std::max(motor.peak_speed, std::abs(v));
      motor.energy += h * std::abs(u * v);
      squares += h * u * u;
    }
    motor.rms_torque = duration > 0 ? std::sqrt(squares / duration) : 0;
    out.motors.push_back(motor);
  }
  out.conditioning = calcWorstConditioning(model, trajectory);
  return out;
}

const char* getName(Measure measure) {
  switch (measure) {
    case Measure::PeakTorque:
      return "peak_torque";
    case Measure::RmsTorque:
      return "rms_torque";
    case Measure::Energy:
      return "energy";
    case Measure::Conditioning:
      break;
  }
  return "conditioning";
}

double getMeasure(Measure measure, const std::vector<int>& motors, const std::vector<MotionMeasures>& motions) {
  double value = 0;
  for (const MotionMeasures& motion : motions) {
    if (measure == Measure::Conditioning) value = std::max(value, motion.conditioning);
    for (int m : motors) {
      const MotorMeasures& motor = motion.motors[m];
      if (measure == Measure::PeakTorque) value = std::max(value, motor.peak_torque);
      if (measure == Measure::RmsTorque) value = std::max(value, motor.rms_torque);
      if (measure == Measure::Energy) value += motor.energy;
    }
  }
  return value;
}

}  // namespace bielle
