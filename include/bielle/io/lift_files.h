#pragma once
/// \file A serial motion read back, and its lift to the closed model as files.
#include "bielle/io/result.h"
#include "bielle/transmission/lift.h"

namespace bielle {

/// What lift() needs, of a record of a motion of the serial model.
/// \param motion  made anew as it was asked for: its contacts in force at every stage
/// \throws ModelError when the record is not one of that motion
SerialTrajectory makeSerialTrajectory(const Motion& motion, const MotionRecord& record);

/// The lifted motion as far as it got, in the form of a solved one: converged if it was lifted, the mean of the cost of (1) of
/// lift.h per node as its cost. At least one stage must have been lifted.
MotionResult makeLiftedResult(const RunInfo& run, const Model& closed, const Motion& serial, const LiftResult& lifted,
                              double seconds);

/// Writes lift.json: outcome, and per node status, errors, margin and evaluations; with a result trajectory.csv,
/// trajectory.npz and summary.json too. Returns the paths. \throws ModelError naming the file and why
std::vector<std::string> writeLift(const std::string& directory, LiftMethod method, const LiftResult& lifted,
                                   const MotionResult* result);

}  // namespace bielle
