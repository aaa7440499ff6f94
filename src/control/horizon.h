#pragma once
// The stages through which the windows of predictive control lead.
#include "bielle/control/predictive_controller.h"

namespace bielle {

// Stages are numbered from the start on, without end. The problem holds those of the longest window that begins at getFirst()
// of the stage given to prepare() last, and those from begin() to end().
class Horizon {
 public:
  virtual ~Horizon() = default;
  virtual RobotProblem& getProblem() = 0;
  // Where the window begins whose solution is to be in force from this stage on.
  virtual int getFirst(int stage) const = 0;
  virtual void prepare(int first) = 0;
  virtual int begin() const = 0;
  virtual int end() const = 0;

  virtual int getNode(int stage) const = 0;      // of the problem
  virtual double getStart(int stage) const = 0;  // s
  virtual int getPhase(int stage) const = 0;
  // Near which a window that ends here should end.
  virtual const VectorXd& getState(int stage) const = 0;
  // A first guess of the state and the controls.
  virtual VectorXd makeGuess(int stage) const = 0;
  virtual const VectorXd& getControl(int stage) const = 0;
  // A guess for a node from this stage to `end` that follows the others: of its control, and of the state after it. They hold
  // those of the node before.
  virtual void extend(int stage, int end, VectorXd& x, VectorXd& u) const = 0;
  // Whether the guess of the first window is a solution.
  virtual bool isSolved() const = 0;
};

// By which the times of the robot are larger than those of the reference robot.
double calcTimeScale(const RobotProblem& problem);

// A solved motion, then copies of its last stage. The problem is a copy of the motion's.
std::unique_ptr<Horizon> makeMotionHorizon(const Motion& motion, const ShootingTrajectory& plan,
                                           const PredictiveOptions& options);
// A walk whose stages are made when a window reaches them.
std::unique_ptr<Horizon> makeWalkHorizon(CommandedWalk walk, const PredictiveOptions& options);

}  // namespace bielle
