#pragma once
/// \file Dead points of the linkages of an adopted robot.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// One line for each linkage with a dead point between `start` and `posture`, and for each dead point that a linkage's joints can
/// reach from the posture.
/// \param model  with its motors and serial joints
std::vector<std::string> describeDeadPoints(const Model& model, ConstVectorRef start, ConstVectorRef posture);

}  // namespace bielle
