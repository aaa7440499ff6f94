#pragma once
// The behaviour of a walking robot, measured on its trajectory by kinematics and by the dynamics of its stages.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "math/so3.h"

namespace bielle {

struct StepMeasures {
  double slip = 0;                          // of a stance foot from where it touched down, m
  double slip_angle = 0;                    // rad
  double penetration = 0;                   // of a corner of a stance sole, m
  double lowest = 1e9;                      // corner of a swing sole over the ground, m
  double clearance = 1e9;                   // the same at mid-swing
  double foothold = 0;                      // distance of a landing foot from its place, m
  double touchdown = 0;                     // velocity of a landing foot at its last node in the air, m/s
  double tilt_at_landing = 0;               // of its sole, rad
  double feet = 1e9;                        // distance of the soles seen from above, m
  double pressure = 0;                      // centre of pressure over half the sole
  double friction = 0;                      // horizontal over vertical force
  double load = 1e9;                        // vertical force of a stance foot, N
  double tilt = 0;                          // of the torso, rad
  double heading = 0;                       // largest, rad
  double base_low = 1e9, base_high = -1e9;  // m
  double bend = 1e9;                        // of a knee, smallest, rad; zero: straight, positive: forward
  double velocity_jump = 0;                 // of a motor from node to node, away from contact switches, rad/s
  double switch_jump = 0;                   // the same at contact switches
  double motor_velocity = 0, torque = 0;    // largest, rad/s and N m
  double torque_variation = 0;              // sum of |u_{k+1} - u_k| over motors and time, N m
  Vector3d start = Vector3d::Zero(), end = Vector3d::Zero();  // centre of mass, m
  double final_speed = 0;                                     // of the fastest coordinate, rad/s or m/s
  std::vector<double> touchdown_times;                        // s
  std::vector<Vector3d> touchdown_coms;                       // m
};

class StepMeter {
 public:
  StepMeter(Motion& motion, const ShootingTrajectory& t)
      : motion_(motion), t_(t), model_(motion.problem->model()), ws_(model_), evaluator_(*motion.problem) {}

  StepMeasures measure() {
    const int stages = motion_.problem->numStages();
    int k = 0;
    std::vector<bool> before(model_.contacts().size(), true);
    for (const ContactPhase& phase : motion_.schedule.phases) {
      std::vector<bool> stands(model_.contacts().size(), false);
      for (const ContactTarget& target : phase.contacts) stands[target.contact] = true;
      for (int i = 0; i < phase.nodes; ++i, ++k) measureNode(k, i, phase, stands, before);
      before = stands;
    }
    measureNode(stages, -1, motion_.schedule.phases.back(), before, before);
    out_.end = calcCom(model_, ws_);
    out_.final_speed = t_.xs.back().tail(model_.nv()).cwiseAbs().maxCoeff();
    return out_;
  }

 private:
  SE3 getFoot(int c) const { return getPlacement(ws_, model_.contacts()[c].body, model_.contacts()[c].X_BF); }

  double calcLowestCorner(int c) const {
    const ContactFrame& contact = model_.contacts()[c];
    double lowest = 1e9;
    for (double x : {-1, 1})
      for (double y : {-1, 1}) {
        const Vector3d p = getFoot(c).act({x * contact.half_length, y * contact.half_width, 0});
        lowest = std::min(lowest, p.z() - motion_.ground.calcHeight(p.x(), p.y()));
      }
    return lowest;
  }

  void measureNode(int k, int i, const ContactPhase& phase, const std::vector<bool>& stands,
                   const std::vector<bool>& before) {
    const int nq = model_.nq(), nv = model_.nv();
    updatePositions(model_, ws_, t_.xs[k].head(nq));
    updateVelocities(model_, ws_, t_.xs[k].tail(nv));
    if (k == 0) out_.start = calcCom(model_, ws_);
    for (size_t c = 0; c < stands.size(); ++c) {
      const int foot = static_cast<int>(c);
      if (i == 0 && stands[c] && !before[c]) measureLanding(k, foot, phase);
      if (!stands[c]) {
        places_[c].reset();
        out_.lowest = std::min(out_.lowest, calcLowestCorner(foot));
        const ContactFrame& contact = model_.contacts()[c];
        speeds_[c] = calcFrameVelocity(ws_, contact.body, contact.X_BF).head<3>().norm();
        if (i == phase.nodes / 2) out_.clearance = std::min(out_.clearance, calcLowestCorner(foot));
        continue;
      }
      if (!places_[c]) places_[c] = getFoot(foot);
      const SE3 moved = places_[c]->inverseTimes(getFoot(foot));
      out_.slip = std::max(out_.slip, moved.p.norm());
      out_.slip_angle = std::max(out_.slip_angle, log3(moved.R).norm());
      out_.penetration = std::max(out_.penetration, -calcLowestCorner(foot));
    }
    measureBody(k, i);
    if (i >= 0) measureForces(k, phase);
  }

  void measureLanding(int k, int c, const ContactPhase& phase) {
    for (const ContactTarget& target : phase.contacts)
      if (target.contact == c) out_.foothold = std::max(out_.foothold, (getFoot(c).p - target.X_WT.p).norm());
    out_.touchdown = std::max(out_.touchdown, speeds_[c]);
    out_.tilt_at_landing = std::max(out_.tilt_at_landing, std::acos(std::min(1.0, getFoot(c).R(2, 2))));
    out_.touchdown_times.push_back(motion_.schedule.getTime(k));
    out_.touchdown_coms.push_back(calcCom(model_, ws_));
  }

  void measureBody(int k, int i) {
    const Matrix3d R = ws_.X_WB[1].R;
    out_.tilt = std::max(out_.tilt, std::acos(std::min(1.0, R(2, 2))));
    out_.heading = std::max(out_.heading, std::abs(std::atan2(R(1, 0), R(0, 0))));
    out_.base_low = std::min(out_.base_low, ws_.X_WB[1].p.z());
    out_.base_high = std::max(out_.base_high, ws_.X_WB[1].p.z());
    if (model_.contacts().size() == 2) {
      const ContactFrame &a = model_.contacts()[0], &b = model_.contacts()[1];
      const SE3 X = getFoot(0).inverseTimes(getFoot(1));
      const Eigen::Vector2d reach = X.R.topLeftCorner<2, 2>().cwiseAbs() * Eigen::Vector2d(b.half_length, b.half_width);
      out_.feet = std::min(out_.feet, std::max(std::abs(X.p.x()) - a.half_length - reach.x(),
                                               std::abs(X.p.y()) - a.half_width - reach.y()));
    }
    for (const char* leg : {"_left", "_right"}) out_.bend = std::min(out_.bend, calcBend(leg));
    for (const Motor& motor : model_.motors()) {
      const int dof = model_.nq() + motor.dof;
      out_.motor_velocity = std::max(out_.motor_velocity, std::abs(t_.xs[k][dof]));
      if (k == 0) continue;
      double& jump = (i == 0 || i == 1) ? out_.switch_jump : out_.velocity_jump;
      jump = std::max(jump, std::abs(t_.xs[k][dof] - t_.xs[k - 1][dof]));
    }
    if (i < 0) return;
    out_.torque = std::max(out_.torque, t_.us[k].cwiseAbs().maxCoeff());
    if (k > 0) out_.torque_variation += (t_.us[k] - t_.us[k - 1]).cwiseAbs().sum();
  }

  // Between thigh and shin, seen from the left of the torso; nothing for a leg without a knee.
  double calcBend(const std::string& leg) const {
    if (model_.findJoint("knee" + leg) < 0) return 1e9;
    const auto at = [&](const std::string& joint) { return ws_.X_WB[model_.findJoint(joint + leg)].p; };
    const Vector3d left = ws_.X_WB[1].R.col(1), knee = at("knee");
    const Vector3d thigh = (knee - at("hipy")).normalized(), shin = (at("ankley") - knee).normalized();
    return std::atan2(left.dot(thigh.cross(shin)), thigh.dot(shin));
  }

  void measureForces(int k, const ContactPhase& phase) {
    const RobotEvaluation& at = evaluator_.evaluate(k, t_.xs[k], t_.us[k]);
    if (at.status != NumericalStatus::Ok) {
      out_.load = -1e9;
      return;
    }
    const ConstraintSet& set = motion_.problem->spec(k).constraints;
    for (size_t c = 0; c < phase.contacts.size(); ++c) {
      const ContactFrame& contact = model_.contacts()[phase.contacts[c].contact];
      const Vector6d f = at.lambda.segment<6>(set.offsets[set.num_loops + c]);
      out_.load = std::min(out_.load, f[2]);
      out_.friction = std::max(out_.friction, f.head<2>().norm() / std::max(f[2], 1e-9));
      out_.pressure = std::max(
          {out_.pressure, std::abs(f[4] / f[2]) / contact.half_length, std::abs(f[3] / f[2]) / contact.half_width});
    }
  }

  Motion& motion_;
  const ShootingTrajectory& t_;
  const Model& model_;
  Workspace ws_;
  RobotEvaluator evaluator_;
  std::array<std::optional<SE3>, 8> places_;
  std::array<double, 8> speeds_{};  // of the feet in the air, m/s
  StepMeasures out_;
};

// Checks the feet in every motion with steps: they stand still, clear the ground, land where they should, and push
// without tipping or slipping.
inline void checkFeet(const StepMeasures& m) {
  CHECK(m.slip < 1e-3);
  CHECK(m.penetration < 1e-3);
  CHECK(m.lowest > -1e-3);
  CHECK(m.clearance > 0.01);
  CHECK(m.foothold < 2e-3);
  CHECK(m.touchdown < 0.2);
  CHECK(m.feet > 0.05);
  CHECK(m.pressure < 1);
  CHECK(m.friction < 0.7);
  CHECK(m.load > 5);
}

}  // namespace bielle
