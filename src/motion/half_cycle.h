#pragma once
/// \file A cycle as its first half and the mirror image of that.
///
/// With x -> m(x) the mirror image of a state in a vertical plane, displaced over the ground so that the foot of node 0 comes to where
/// the other foot stands at node h = N / 2,
///     x_{k+h} = m(x_k),    u_{k+h} = m(u_k),    k = 0 .. h                                                        (1)
/// is a cycle if x_h = m(x_0). If costs are stationary among such cycles, they are so among all cycles, provided that the problem is its own
/// mirror image: at every k
///     f_{k+h}(m(x), m(u)) = m(f_k(x, u)),    l_{k+h}(m(x), m(u)) = l_k(x, u),                                       (2)
/// and constraints and bounds of k + h are those of k, maybe in another order and with other signs (Palais, "The principle of
/// symmetric criticality", 1979).
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "motion/mirror.h"
#include "motion/periodic_motion.h"

namespace bielle {

class HalfCycle {
 public:
  /// Compares the problem with its mirror image at every node, at states and torques beside the guess.
  /// \param motion  a cycle, which must outlive it   \param why  receives what has no mirror image, where there is no such half
  static std::optional<HalfCycle> find(const Motion& motion, std::string& why);

  const RobotProblem& problem() const { return *problem_; }
  VectorXd mapState(const VectorXd& x) const { return robot_.mapState(G_, x); }

  /// The first half of a starting point.
  StartingPoint take(const StartingPoint& start) const;
  /// The whole cycle of a solution of the half one, Eq. (1), with its multipliers.
  ShootingTrajectory unfold(const ShootingTrajectory& half) const;
  Multipliers unfold(const ShootingTrajectory& half, const Multipliers& multipliers) const;

 private:
  // A row of constraints of a node and its mirror image, which is `sign` times that.
  struct Row {
    int node = 0, row = 0;  // of the half problem
    double sign = 1;
  };

  HalfCycle(const RobotProblem& whole, MirroredRobot robot, const SE3& G);
  bool compare(const ShootingTrajectory& guess, std::string& why);
  // Derivative of m from the last node of the half to the last of the whole, in their tangent spaces at x and m(x).
  MatrixXd differentiateMap(const VectorXd& x) const;

  const RobotProblem* whole_;
  MirroredRobot robot_;
  SE3 G_;
  std::shared_ptr<RobotProblem> problem_;
  std::vector<std::vector<Row>> rows_;  // of nodes h .. N
};

}  // namespace bielle
