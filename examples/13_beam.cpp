/// \file Bipetto steps over a beam: a motion of one's own from footholds, in a few lines (docs/new_motion.md).
///
/// Steps on any ground are planned from footholds X_i alone (locomotion.h). Here both feet cross a beam of height h and
/// thickness d that lies at right angles before the soles, so that with the half length l of a sole and the distance e that
/// it keeps from the beam, each moves by
///     s = d + 2 (l + e).                                                                                           (1)
/// The corners c of a sole then have to be above the surface z(x, y) of the ground with its beam:
///     c_z - z(c_x, c_y) >= 0   at every node,                                                                      (2)
/// which the solver imposes while a foot swings, and which we look at again afterwards.
///
/// Usage: 13_beam [DIRECTORY [HEIGHT]]   writes trajectory.csv, trajectory.npz, summary.json
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/locomotion.h"
#include "bielle/motion/solve.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

struct BeamOptions {
  double height = 0.05;     // m
  double thickness = 0.05;  // m
  double distance = 0.03;   // of the soles, before and behind, m
  LocomotionOptions gait;
};

MotionPlan planBeam(const Model& model, const BeamOptions& o, const StandingRobot& standing) {
  const Stance stance = makeStance(model, o.gait, standing);
  const SE3 start = calcMiddle(stance.feet[0], stance.feet[1]);
  const double half = model.contacts()[stance.contacts[0]].half_length;
  const Vector3d stride = start.R.col(0) * (o.thickness + 2 * (half + o.distance));  // Eq. (1)
  LocomotionTask task;
  task.name = "beam";
  task.plan.start = stance.feet;
  for (Side side : {Side::Right, Side::Left}) {
    const SE3& foot = stance.feet[static_cast<int>(side)];
    task.plan.steps.push_back({side, {foot.R, foot.p + stride}});
  }
  task.ground.height = start.p.z();
  const Vector3d middle(half + o.distance + o.thickness / 2, 0, o.height);
  task.ground.steps.push_back({start.act(middle), o.thickness, 2, calcHeading(start)});
  LocomotionOptions gait = o.gait;
  gait.timing.single = 0.7;
  gait.swing.height = o.height + 0.03;
  gait.swing.leave = 0.25;  // up first, then ahead
  gait.swing.arrive = 0.75;
  return planLocomotion(model, stance, task, gait);
}

// The least of Eq. (2) over nodes and corners of both soles, m.
double calcClearance(const Motion& motion, const ShootingTrajectory& trajectory) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  double least = 1;
  for (const VectorXd& x : trajectory.xs) {
    updatePlacements<double>(model, ws, x.head(model.nq()));
    for (const ContactFrame& foot : model.contacts())
      for (double sx : {-1.0, 1.0})
        for (double sy : {-1.0, 1.0}) {
          const Vector3d corner =
              getPlacement(ws, foot.body, foot.X_BF).act(Vector3d(sx * foot.half_length, sy * foot.half_width, 0));
          least = std::min(least, corner.z() - motion.ground.calcHeight(corner.x(), corner.y()));
        }
  }
  return least;
}

}  // namespace

int main(int argc, char** argv) {
  const LoadedRobot robot = loadRobot("bipetto");
  BeamOptions options;
  if (argc > 2) options.height = std::atof(argv[2]);
  const Solution solution =
      solve(makeMotion(robot.model, planBeam(robot.model, options, makeStandingRobot(robot.model)), {}));
  const double clearance = calcClearance(solution.motion, solution.trajectory);
  std::printf("%s after %d iterations; soles stay %.1f mm over ground and beam\n",
              getName(solution.summary.termination), solution.summary.iterations, 1e3 * clearance);
  if (argc > 1) writeResult(argv[1], makeResult({"bipetto", robot.file, {}}, solution));
  return solution.converged() && clearance > -1e-4 ? 0 : 1;
}
