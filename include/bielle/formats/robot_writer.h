#pragma once
/// \file A model written as the files that loadRobot reads (formats/reader.h).
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/model.h"
#include "bielle/model/wear.h"

namespace bielle {

struct RobotText {
  std::string urdf, yaml;
};

/// Numbers have as many digits as read back to the same bits. Rotations are roll, pitch and yaw, of which readers make the same
/// matrices up to rounding. Every body, joint,
/// frame, closure, motor, contact and reference keeps its name; links that were merged into a body become frames.
/// Bodies keep their order if the model lists them depth first.
/// \param remark  comment at the head of both files
/// \throws InputError naming anything that the files cannot express: a universal joint whose axes are not axes of its
///   frame, limits of joints with several coordinates
RobotText formatRobot(const Model& model, const std::string& remark = "", const Wear& wear = {});

struct UrdfText {
  std::string urdf;
  std::vector<std::string> warnings;  ///< each names something that is left out
};

/// A URDF alone, for programs that read nothing else: couplers of two joints as <mimic>, dampers and friction as
/// <dynamics>, motor limits as joint limits.
/// \throws InputError naming a joint that URDF does not have (universal, spherical), or as above
UrdfText formatUrdf(const Model& model);

/// Writes DIRECTORY/NAME.urdf and .yaml, where NAME is the last component of DIRECTORY.
/// \throws InputError as above, or when they cannot be written
void writeRobot(const Model& model, const std::string& directory, const std::string& remark = "",
                const Wear& wear = {});

/// The entry of a motor in a YAML file besides its armature and limits: its loss, drive and continuous effort, as keys and values.
std::vector<std::pair<const char*, std::string>> getMotorData(const Motor& motor);

}  // namespace bielle
