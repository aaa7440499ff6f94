#pragma once
/// \file The motions of designs: those of the start design, made anew for other designs or kept.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/motion/lift.h"
#include "bielle/motion/solve.h"
#include "design/measures.h"
#include "model/payload.h"

namespace bielle {

struct DesignMotion {
  std::string name;
  /// Called by several threads; the model is loaded.
  std::function<MotionPlan(const Model&, const StandingRobot&)> plan;
  double weight = 1;     ///< its share in objectives and in sums over motions, 0 or more
  Payload payload = {};  ///< that the robot carries in it
  /// As `bielle solve` makes it without being told the length of steps. None: of the plan alone.
  std::optional<MotionRequest> request = {};
};

/// With its payload, and its weight unless that is 1.
std::string describeMotion(const DesignMotion& motion);

/// For every motion the number of the first one with the same payload.
std::vector<size_t> groupByPayload(const std::vector<DesignMotion>& motions);

/// Its problem for a robot with its payload, from where it stands. Motions that are kept are lifted, which Euler steps
/// alone can be; the others are comparable with them.
Motion makeDesignMotion(const Model& model, const DesignMotion& motion, const StandingRobot& standing);

/// The goals of a motion, measured on states and schedule: a foot that stands counts as loaded.
std::vector<GoalOutcome> measureGoals(const Model& model, const std::vector<Goal>& goals,
                                      const ContactSchedule& schedule, const std::vector<double>& dt,
                                      const std::vector<VectorXd>& xs);
std::vector<GoalOutcome> measureGoals(const Motion& motion, const ShootingTrajectory& trajectory);

/// A motion of the start design.
struct SolvedMotion {
  MotionRecord record;
  std::vector<Goal> goals;
  ContactSchedule schedule;
  std::vector<VectorXd> postures;
  std::optional<SerialTrajectory> serial;  ///< of its equivalent serial chain, where there is one
};

/// The outcome of one motion of a design.
struct MotionOutcome {
  std::unique_ptr<Model> loaded;  ///< the robot with the payload of the motion
  double missing = 1;             ///< share of the motion
  std::string message;
  MotionMeasures measures;
  std::vector<GoalOutcome> goals;    ///< of the whole motion
  LiftResult lifted;                 ///< of a kept motion
  std::optional<Solution> solution;  ///< of one that was made anew, of the loaded robot
};

/// \param model  without payload, here and below   \param postures  that are listed
/// \param must_keep  whether the motion has to have a serial equivalent
/// \throws InputError when the motion fails
SolvedMotion solveStartMotion(const Model& model, const DesignMotion& motion, const FddpOptions& options, int postures,
                              bool must_keep);

/// Solved for a design, from the solution of the start design, or from the guess of the plan if there is none.
MotionOutcome remakeMotion(const Model& model, const DesignMotion& motion, const SolvedMotion* start,
                           const FddpOptions& options, const std::vector<MotorConversion>& drives);

/// A motion of the start design with the motors recomputed. \param q0  standing posture
LiftResult liftMotion(const Model& model, const VectorXd& q0, const SerialTrajectory& kept);

/// Postures and accelerations of the start design, which has a serial equivalent, motors recomputed.
/// \param margin  EvaluationOptions::margin
MotionOutcome keepMotion(const Model& model, const DesignMotion& motion, const SolvedMotion& start,
                         const std::vector<MotorConversion>& drives, double margin);

/// As `bielle solve` gives it: by its own steps, from its own guess, solved again where it does so. Without `lifted`
/// and `solution`. \param trajectory  of the closed model, with the velocities at which motors count
MotionOutcome solveUsually(const Model& model, const DesignMotion& motion, const std::vector<MotorConversion>& drives,
                           ShootingTrajectory& trajectory);

}  // namespace bielle
