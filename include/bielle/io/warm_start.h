#pragma once
/// \file Starting a solve from a previous result.
#include "bielle/io/record.h"

namespace bielle {

/// Replaces the guess of a motion by states and torques of a record of the same robot: node by node when the lengths
/// agree, else each node takes the recorded one at the same share of the duration. The base is carried along so that the feet that stand
/// are at the places of the new motion.
/// \throws ModelError when the coordinates or motors are others, or the record has numbers that are not finite
void setGuess(const MotionRecord& record, Motion& motion);

/// The record in a directory that writeResult() wrote.
/// \throws ModelError naming the directory or file, and why it cannot be read
MotionRecord readResultRecord(const std::string& directory);

}  // namespace bielle
