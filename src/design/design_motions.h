#pragma once
/// \file The motions of designs: those of the start design, made anew for other designs or kept.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/io/record.h"
#include "bielle/motion/motion.h"
#include "bielle/transmission/lift.h"
#include "design/measures.h"

namespace bielle {

struct DesignMotion {
  std::string name;
  std::function<MotionPlan(const Model&, const VectorXd& q0)> plan;  ///< called by several threads
};

/// Its problem, from a standing posture. Motions that are kept are lifted, which Euler steps alone can be; the others are
/// comparable with them.
Motion makeDesignMotion(const Model& model, const DesignMotion& motion, const VectorXd& posture);

/// A motion of the start design.
struct SolvedMotion {
  MotionRecord record;
  std::vector<VectorXd> postures;
  std::optional<SerialTrajectory> serial;  ///< of its equivalent serial chain, where there is one
  std::vector<int> kept_dofs;              ///< of the closed model: those of the chain, in its order
};

/// The outcome of one motion of a design.
struct MotionOutcome {
  double missing = 1;  ///< share of the motion
  std::string message;
  MotionMeasures measures;
  LiftResult lifted;               ///< of a kept motion
  std::unique_ptr<Motion> motion;  ///< of one that was made anew: the optimum, whose model must outlive it
  Multipliers multipliers;
};

/// \param postures  that are listed   \param must_keep  whether the motion has to have a serial equivalent
/// \throws ModelError when the motion fails
SolvedMotion solveStartMotion(const Model& model, const DesignMotion& motion, const FddpOptions& options, int postures,
                              bool must_keep);

/// Solved for a design, from the solution of the start design, or from the guess of the plan if there is none.
MotionOutcome remakeMotion(const Model& model, const DesignMotion& motion, const SolvedMotion* start,
                           const FddpOptions& options, const std::vector<MotorConversion>& drives);

/// Postures and accelerations of the start design, motors recomputed. \param margin  EvaluationOptions::margin
MotionOutcome keepMotion(const Model& model, const SerialTrajectory& kept, const std::vector<MotorConversion>& drives,
                         double margin);

}  // namespace bielle
