#pragma once
/// \file A generated robot by its name and parameters.
#include "bielle/robots/robot_loader.h"

namespace bielle {

/// The robot that a generator makes with these parameters; the others have their defaults.
/// \throws InputError as findGenerator() and Generator::make do, and naming parameters that would change nothing, since
/// no part that is chosen has them
Model generateRobot(const std::string& name, const OptionValues& settings);

}  // namespace bielle
