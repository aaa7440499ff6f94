/// \file Bipetto climbs stairs; the power of its motors.
///
/// Step i of the stairs is a box with its top at i H. Foot i moves from step i - 2 to step i, over the edge of the one
/// between: a path with its apex over the higher end, on which the sole, a rectangle, must stay above the ground G,
///     min over its corners c of  z_c - G(x_c, y_c)  >= 0   while it swings.                                    (1)
/// Lifting the mass m by H in a time T takes at least the mean power
///     P = m g H / T.                                                                                           (2)
/// The power that the motors deliver is the sum of u_i v_i over motors; without recovery of energy they consume the sum
/// of max(0, u_i v_i). For several step heights we solve the problem of 03_walk.cpp with footholds on the boxes, check
/// (1) corner by corner, and compare both powers with (2).
///
/// Usage: 04_stairs [DIRECTORY [STEPS [HEIGHT...]]]   writes the result of each height to DIRECTORY/HEIGHT
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/stairs.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"

using namespace bielle;

namespace {

// Eq. (1): the least height of a corner of a foot in the air over the ground under it, m.
double calcClearance(const Motion& motion, const MotionRecord& record) {
  const Model& model = motion.problem->model();
  Workspace ws(model);
  double lowest = 1e9;
  for (int k = 0; k < motion.problem->numStages(); ++k) {
    const std::vector<ContactTarget>& contacts = motion.schedule.getPhase(k).contacts;
    updatePositions(model, ws, record.q.row(k).transpose());
    for (size_t c = 0; c < model.contacts().size(); ++c) {
      const auto is_foot = [c](const ContactTarget& target) { return target.contact == static_cast<int>(c); };
      if (std::any_of(contacts.begin(), contacts.end(), is_foot)) continue;
      const ContactFrame& foot = model.contacts()[c];
      for (double x : {-foot.half_length, foot.half_length})
        for (double y : {-foot.half_width, foot.half_width}) {
          const Vector3d p = getPlacement(ws, foot.body, foot.X_BF).act({x, y, 0});
          lowest = std::min(lowest, p.z() - motion.ground.calcHeight(p.x(), p.y()));
        }
    }
  }
  return lowest;
}

struct Power {
  double net = 0, paid = 0;  // W
};

Power calcMeanPower(const Model& model, const MotionRecord& record, double duration) {
  Power power;
  const double h = record.time[1] - record.time[0];
  for (Eigen::Index k = 0; k < record.u.rows(); ++k)
    for (int m = 0; m < model.nu(); ++m) {
      const double p = record.u(k, m) * record.v(k, model.motors()[m].dof);
      power.net += h * p / duration;
      power.paid += h * std::max(0.0, p) / duration;
    }
  return power;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string directory = argc > 1 ? argv[1] : "stairs";
  StairsOptions options;
  options.depth = 0.2;
  if (argc > 2) options.stairs = std::atoi(argv[2]);
  std::vector<double> heights;
  for (int i = 3; i < argc; ++i) heights.push_back(std::atof(argv[i]));
  if (heights.empty()) heights = {-0.06, -0.03, 0.03, 0.06};

  const LoadedRobot robot = loadRobot("bipetto");
  const double g = robot.model.gravity().norm();
  std::printf("%9s %-10s %10s %9s %14s %10s %11s %11s %11s\n", "H [m]", "outcome", "iterations", "time [s]",
              "clearance [mm]", "slip [mm]", "Eq. 2 [W]", "motors [W]", "paid [W]");
  bool converged = true;
  for (double height : heights) {
    options.height = height;
    const Motion motion = makeStairs(robot.model, options);
    const Solution solution = solve(motion);
    const FddpSummary& summary = solution.summary;
    const MotionResult result = makeResult({"bipetto", robot.file, {}}, solution);
    const double duration = options.stairs * options.depth / options.speed;
    const Power power = calcMeanPower(robot.model, result.record, duration);
    std::printf("%9.3f %-10s %10d %9.2f %14.2f %10.2f %11.2f %11.2f %11.2f\n", height, getName(summary.termination),
                summary.iterations, summary.seconds, 1e3 * calcClearance(motion, result.record),
                1e3 * result.slip_position, robot.model.mass() * g * options.stairs * height / duration, power.net,
                power.paid);
    std::fflush(stdout);
    char name[32];
    std::snprintf(name, sizeof name, "/%.3f", height);
    writeResult(directory + name, result);
    converged = converged && result.converged();
  }
  std::printf("results in %s\n", directory.c_str());
  return converged ? 0 : 1;
}
