#pragma once
// A jump, measured on its trajectory by kinematics and the ballistic parabola, independently of the solver.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"

namespace bielle::testing {

inline int findPhase(const ContactSchedule& schedule, const std::string& name) {
  int node = 0;
  for (const ContactPhase& phase : schedule.phases) {
    if (phase.name == name) return node;
    node += phase.nodes;
  }
  FAIL("there is no phase " << name);
  return -1;
}

struct JumpOutcome {
  double lowest_corner = 1e9, clearance = 0;      // of the soles over the ground: at any time; at mid-flight, m
  double touchdown = 0;                           // largest speed of a foot as it comes down, m/s
  double misplaced = 0;                           // largest distance of a foot from where it should land, m
  double slip = 0;                                // farthest a foot goes from where it stood when its contact began, m
  double tilt = 0;                                // of the torso from the vertical, rad
  double knee_lowest = 1e9, knee_highest = -1e9;  // bend of a knee, positive as at the start, rad
  double stone = 0;                               // largest distance of the CoM from the parabola in flight, m
  double rise = 0;                                // of the CoM from take-off to mid-flight, m
  double pressure = 0;                            // centre of pressure over half the sole, at most 1
  double force = 1e9, friction = 0;               // least vertical force, N; largest tangential over vertical force
  double end_speed = 0;                           // largest velocity coordinate at the end
  Vector3d travel;                                // of the CoM from start to end, m
};

inline void measureFeet(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  const int flight = findPhase(motion.schedule, "flight"), land = findPhase(motion.schedule, "land");
  std::vector<Vector3d> places(model.contacts().size());
  for (int k = 0; k < static_cast<int>(t.xs.size()); ++k) {
    updatePositions(model, ws, t.xs[k].head(model.nq()));
    updateVelocities(model, ws, t.xs[k].tail(model.nv()));
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      const ContactFrame& contact = model.contacts()[c];
      const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
      double low = 1e9;
      for (int i : {-1, 1})
        for (int j : {-1, 1})
          low = std::min(low, (X.p + X.R * Vector3d(i * contact.half_length, j * contact.half_width, 0)).z());
      out.lowest_corner = std::min(out.lowest_corner, low);
      if (k == (flight + land) / 2) out.clearance = c == 0 ? low : std::min(out.clearance, low);
      if (k == 0 || k == land) places[c] = X.p;
      if (k < flight || k >= land) out.slip = std::max(out.slip, (X.p - places[c]).norm());
      if (k != land) continue;
      const Vector6d V = ws.V[contact.body];
      out.touchdown = std::max(out.touchdown, (V.head<3>() + V.tail<3>().cross(X.p)).norm());
      out.misplaced = std::max(out.misplaced, (X.p - motion.schedule.getPhase(land).contacts[c].X_WT.p).norm());
    }
  }
}

inline void measureBody(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  const int flight = findPhase(motion.schedule, "flight"), land = findPhase(motion.schedule, "land");
  std::vector<Vector3d> com;
  for (const VectorXd& x : t.xs) {
    updatePositions(model, ws, x.head(model.nq()));
    com.push_back(calcCom(model, ws));
    out.tilt = std::max(out.tilt, std::acos(std::min(1.0, getPlacement(ws, 1, SE3()).R(2, 2))));
    for (const char* name : {"knee_left", "knee_right"}) {
      const int i = model.joints()[model.findJoint(name)].idx_q;
      const double bend = std::copysign(1, t.xs[0][i]) * x[i];
      out.knee_lowest = std::min(out.knee_lowest, bend);
      out.knee_highest = std::max(out.knee_highest, bend);
    }
  }
  // The stone through the places at take-off and touchdown.
  const double T = motion.schedule.getTime(land) - motion.schedule.getTime(flight);
  for (int k = flight; k <= land; ++k) {
    const double s = static_cast<double>(k - flight) / (land - flight);
    const Vector3d stone = (1 - s) * com[flight] + s * com[land] + 0.5 * 9.81 * T * T * s * (1 - s) * Vector3d::UnitZ();
    out.stone = std::max(out.stone, (com[k] - stone).norm());
  }
  out.rise = com[(flight + land) / 2].z() - 0.5 * (com[flight].z() + com[land].z());
  out.end_speed = t.xs.back().tail(model.nv()).cwiseAbs().maxCoeff();
  out.travel = com.back() - com.front();
}

inline void measureForces(const Motion& motion, const ShootingTrajectory& t, JumpOutcome& out) {
  const Model& model = motion.problem->model();
  RobotEvaluator evaluator(*motion.problem);
  for (size_t k = 0; k < t.us.size(); ++k) {
    const ConstraintSet& set = motion.problem->spec(static_cast<int>(k)).constraints;
    if (static_cast<int>(set.closures.size()) == set.num_loops) continue;
    const RobotEvaluation& at = evaluator.evaluate(static_cast<int>(k), t.xs[k], t.us[k]);
    REQUIRE(at.status == NumericalStatus::Ok);
    for (size_t c = set.num_loops; c < set.closures.size(); ++c) {
      const ContactFrame& contact = model.contacts()[set.getContact(static_cast<int>(c))];
      const Vector6d f = at.lambda.segment<6>(set.offsets[c]);
      out.force = std::min(out.force, f[2]);
      out.friction = std::max(out.friction, f.head<2>().norm() / f[2]);
      out.pressure = std::max(
          {out.pressure, std::abs(f[4] / f[2]) / contact.half_length, std::abs(f[3] / f[2]) / contact.half_width});
    }
  }
}

// The trajectory that the motion holds.
inline JumpOutcome measureJump(const Motion& motion) {
  JumpOutcome out;
  measureFeet(motion, motion.guess, out);
  measureBody(motion, motion.guess, out);
  measureForces(motion, motion.guess, out);
  return out;
}

}  // namespace bielle::testing
