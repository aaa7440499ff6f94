#pragma once
// Motors of a robot by name, of another type or behind another gear.
#include <string>
#include <vector>

#include "bielle/design/parametrization.h"

namespace bielle {

// Those of these names, in which * stands for any text, each once, in the order of the model. Names without it that are not there
// are returned in `unknown`, if given, as are patterns that fit no motor.
std::vector<int> findMotors(const Model& model, const std::vector<std::string>& names,
                            std::vector<std::string>* unknown = nullptr);

// The motor `type` in the place of `motor`: everything but name and joint is that of the type. Efficiencies of a motor without a type
// are those of what a part puts behind it: they stay.
void setType(const Motor& type, Motor& motor);

// Another gear, of `ratio` turns of the rotor per turn of the joint: torques change like the ratio, speeds inversely, armature like its
// square. A motor whose winding is known pays for a larger ratio than its own (GearCost). Returns what the gear weighs more, kg.
double setRatio(double ratio, const GearCost& cost, Motor& motor);

}  // namespace bielle
