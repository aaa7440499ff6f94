/// \file Bipetto sidesteps and turns: the same problem as a walk, with other footholds.
///
/// Feet are commanded by the displacement D of their middle frame P per step, in its own axes (footsteps.h, Eq. 1),
///     P_i = P_{i-1} D,    D = Rz(yaw / 2) (forward, lateral) Rz(yaw / 2),                                      (1)
/// so that n equal steps turn by n yaw, on the spot, or along an arc whose chord per step is 2 r sin(yaw / 2). A
/// lateral motion takes two steps: one foot opens the stance, the other one closes it. In both cases the feet must not
/// touch each other, and the range of Bipetto's hips is small: at each landing we print the distance of the soles and
/// the rotation of the base.
///
/// Usage: 08_turn [DIRECTORY [side SPEED | turn ANGLE [RADIUS]]]   writes trajectory.csv, trajectory.npz, summary.json
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/walk.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

Motion makeMotion(const Model& model, int argc, char** argv) {
  const auto number = [&](int i, double value) { return argc > i ? std::atof(argv[i]) : value; };
  if (argc > 2 && std::strcmp(argv[2], "side") == 0) {
    SideWalkOptions options;
    options.speed = number(3, options.speed);
    options.steps = 4;
    return makeSideWalk(model, options);
  }
  TurnOptions options;
  options.angle = number(3, options.angle);
  options.radius = number(4, options.radius);
  return makeTurn(model, options);
}

struct Feet {
  SE3 left, right;
  double distance = 0;  // between the soles, m
};

Feet calcFeet(const Model& model, Workspace& ws) {
  const auto place = [&](const ContactFrame& foot) { return getPlacement(ws, foot.body, foot.X_BF); };
  const ContactFrame &left = model.contacts()[model.findContact("foot_left")],
                     &right = model.contacts()[model.findContact("foot_right")];
  Feet feet{place(left), place(right)};
  feet.distance = calcSoleDistance(left, feet.left, right, feet.right);
  return feet;
}

// Every double support, at its first node.
void printLandings(const Motion& motion, const ShootingTrajectory& trajectory) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  std::printf("\n%7s %9s %9s %15s %15s %13s\n", "t [s]", "x [m]", "y [m]", "feet head [rad]", "base [rad]",
              "apart [m]");
  int k = 0;
  for (const ContactPhase& phase : motion.schedule.phases) {
    if (phase.contacts.size() == 2) {
      updatePositions(model, ws, trajectory.xs[k].head(model.nq()));
      const Feet feet = calcFeet(model, ws);
      const SE3 middle = calcMiddle(feet.left, feet.right);
      std::printf("%7.3f %9.4f %9.4f %15.4f %15.4f %13.4f\n", motion.schedule.getTime(k), middle.p.x(), middle.p.y(),
                  calcHeading(middle), calcHeading(ws.X_WB[1]), feet.distance);
    }
    k += phase.nodes;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const LoadedRobot robot = loadRobot("bipetto");
  const Motion motion = makeMotion(robot.model, argc, argv);
  SolveObserver observer;
  observer.motion.callback = makeFddpPrinter(std::cout);
  const Solution solution = solve(motion, {}, observer);
  const FddpSummary& summary = solution.summary;
  const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);

  printLandings(motion, solution.trajectory);
  std::printf("\n%s after %d iterations and %.2f s, slip %.2f mm\n", getName(summary.termination), summary.iterations,
              summary.seconds, 1e3 * result.slip_position);
  for (const std::string& path : writeResult(argc > 1 ? argv[1] : "turn", result)) std::printf("%s\n", path.c_str());
  return result.converged() ? 0 : 1;
}
