#include "design/robot_slopes.h"

#include "bielle/design/cost_gradient.h"

namespace bielle {
namespace {

MotorFactors calcFactors(const Model& model, const std::vector<MotorConversion>& drives) {
  MotorFactors out = MotorFactors::Zero(kMotorFactors, model.nu());
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    const double constant = drives[static_cast<size_t>(m)].motor_constant;
    out(kPerEffort, m) = 1 / motor.effort_limit;
    out(kPerSpeed, m) = 1 / motor.velocity_limit;
    out(kPerContinuous, m) = 1 / motor.continuous_effort;
    out(kLoss, m) = 1 / (constant * constant);
    out(kDriving, m) = 1 / motor.drive.efficiency;
    out(kDriven, m) = motor.drive.back_efficiency;
    if (!motor.hasEnvelope()) continue;
    out(kVoltsPerEffort, m) = motor.voltsPerEffort() / motor.drive.voltage;
    out(kVoltsPerSpeed, m) = motor.voltsPerSpeed() / motor.drive.voltage;
  }
  return out;
}

}  // namespace

RobotSlopes calcRobotSlopes(const Parametrization& robot, const VectorXd& x, const DriveTable& drives) {
  const Model here = robot.make(x);
  RobotSlopes out;
  out.mass = here.mass();
  out.dmass.setZero(x.size());
  out.motors = here.motors();
  out.drives = makeDrives(here, drives);
  out.factors = calcFactors(here, out.drives);
  out.dfactors.assign(static_cast<size_t>(x.size()), MotorFactors::Zero(kMotorFactors, here.nu()));
  for (const Eigen::Index i : robot.listContinuous()) {
    const double step = kDesignStep * (robot.upper()[i] - robot.lower()[i]);
    const VectorXd dx = step * VectorXd::Unit(x.size(), i);
    const Model ahead = robot.make(x + dx), behind = robot.make(x - dx);
    out.dmass[i] = (ahead.mass() - behind.mass()) / (2 * step);
    out.dfactors[static_cast<size_t>(i)] =
        (calcFactors(ahead, makeDrives(ahead, drives)) - calcFactors(behind, makeDrives(behind, drives))) / (2 * step);
  }
  return out;
}

}  // namespace bielle
