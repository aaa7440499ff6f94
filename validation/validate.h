#pragma once
/// \file Bielle's dynamics against Simbody's, quantity by quantity, on random closed states of a robot.
///
/// A state is drawn around a start (the robot's first reference, or its neutral configuration, or a closed one near
/// that): a random tangent step, closed again by closeConfiguration; random velocities projected on the closures and on
/// a random set of contacts in force; random generalized forces on all joints. Every row holds the largest difference
/// over the samples of a vector or matrix, relative to the largest entry of Simbody's (or to a hundredth of the
/// mechanism's response without constraints, if that is larger). Accelerations and their derivatives are first weighted
/// by M_ii^(1/2), so that rounding errors of the lightest link do not dominate.
///
/// Forward dynamics are compared twice. "Simbody solver": Simbody's own realize(Acceleration), on both sides without
/// rotors (makeModelWithoutArmature). "With rotors": the unchanged robot, against SimbodyBridge::solveWithArmature.
/// The rows of Simbody's own solver allow for its rounding where that is larger than the tolerance
/// (OracleSolution::rounding). With redundant constraint rows, individual forces are not determined; accelerations and
/// generalized forces J^T lambda are.
///
/// Derivatives are compared along the closed manifold, the only place where both formulations must agree: along curves
/// q(t), v(t) that satisfy closures and contacts,  da/dt = da_dq q' + da_dv v'  against central differences of the
/// sixth order of Simbody's a; likewise the forces; and da_du column by column.
///
/// Optionally, both programs integrate a free motion of the robot without rotors.
#include <ostream>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle::validation {

struct ValidationOptions {
  int samples = 10;
  unsigned seed = 1;
  double tolerance = 1e-9;             ///< relative, of every row but the derivatives
  int derivative_samples = 3;          ///< number of samples whose derivatives are checked
  double derivative_tolerance = 1e-6;  ///< relative
  double derivative_step = 1e-3;       ///< h of the central differences, s
  VectorXd start;                      ///< nq, around which states are drawn; empty: the first reference, or neutral
  double perturbation = 0.3;           ///< largest change of a coordinate before closing, m or rad
  double velocity = 1;                 ///< largest coordinate of the velocity before projection, m/s or rad/s
  double force = 10;  ///< largest generalized force, N m or N; less on dofs that it would accelerate beyond 1e5 m/s^2
  double motion_duration = 0;  ///< s, of a free motion from the first state (motion.h); 0 for none
  double motion_step = 1e-3;   ///< s, of our integrator
  /// Tolerance of the distance at the end relative to the path length, and of the energy error relative to the kinetic
  /// energy.
  double motion_tolerance = 1e-6;
};

struct ValidationRow {
  std::string quantity;
  double difference = 0;  ///< largest relative difference; infinity if a number is not finite
  double tolerance = 0;   ///< infinite for rows that only inform
  int samples = 0;        ///< number compared
  bool passed() const { return difference <= tolerance; }
};

struct ValidationReport {
  std::string robot;
  std::string engine = "Simbody";  ///< that it was compared with
  int states = 0;                  ///< samples drawn
  int redundant_states = 0;        ///< of these, the number with redundant constraint rows
  std::vector<ValidationRow> rows;
  std::string failure;  ///< reason if nothing could be compared, or empty
  bool passed() const;
  const ValidationRow* findRow(const std::string& quantity) const;
};

/// Compares the model with its Simbody twin.
ValidationReport validateRobot(const Model& model, const ValidationOptions& options = {});

/// The same with Simbody's system made from another model with the same joints, closures and contacts: shows that a
/// wrong model fails.
ValidationReport validateAgainst(const Model& model, const Model& oracle, const ValidationOptions& options = {});

void printReport(std::ostream& out, const ValidationReport& report);

}  // namespace bielle::validation
