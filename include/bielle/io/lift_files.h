#pragma once
/// \file Reads a serial motion and writes its lift to the closed model.
#include "bielle/io/result.h"
#include "bielle/transmission/lift.h"

namespace bielle {

/// The input of lift() from a record of a motion of the serial model.
/// \param motion  the same request made again, for the active contacts of every stage
/// \throws ModelError when the record is not one of that motion
SerialTrajectory makeSerialTrajectory(const Motion& motion, const MotionRecord& record);

/// The lifted part of the motion in the form of a solved one: converged if it was lifted entirely; its cost is the mean per
/// node of the cost of (1) of lift.h. At least one stage must have been lifted.
MotionResult makeLiftedResult(const RunInfo& run, const Model& closed, const Motion& serial, const LiftResult& lifted,
                              double seconds);

/// Writes lift.json: outcome, and per node status, errors, margin and evaluations; with a result trajectory.csv,
/// trajectory.npz and summary.json too. Returns the paths. \throws ModelError naming the file and why
std::vector<std::string> writeLift(const std::string& directory, LiftMethod method, const LiftResult& lifted,
                                   const MotionResult* result);

}  // namespace bielle
