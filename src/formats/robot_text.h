#pragma once
/// \file Numbers, and names for what has none, in the files that a robot is written as.
#include <string>

#include "bielle/model/model.h"

namespace bielle {

/// A mass, an inertia or whatever else has no scale: twelve digits unless `format` (of printf, for one double) says others.
std::string formatRobotNumber(double value, const char* format = "%.12g");

/// A length, an angle or a direction, rounded to 1e-12.
std::string formatRounded(double value);
std::string formatRounded(const Vector3d& v, const char* separator = " ");

/// Every digit of a number: what is read back is the same.
std::string formatExact(double value);
std::string formatExact(const Vector3d& v);

/// The root link is carried by the free-flyer that the reader makes: nothing else is on the ground.
bool hasImpliedFreeFlyer(const Model& model);

/// A frame of the model at this place; if there is none, `made`.
std::string findFrameName(const Model& model, int body, const SE3& X_BF, const std::string& made);

/// \throws InputError
[[noreturn]] void refuseToWrite(const Model& model, const std::string& element, const std::string& problem);

}  // namespace bielle
