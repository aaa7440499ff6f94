#pragma once
/// \file Drake's own elements of a URDF: loops, springs between points, rotors and gears of motors, ball and universal joints.
#include "formats/robot_files.h"
#include "formats/xml_document.h"

namespace bielle {

/// Whether the file speaks to Drake: it declares that name space, or has an element of it anywhere.
bool isForDrake(const XMLElement& robot);

/// Whether an element of <robot> is a joint: <joint> or <drake:joint>.
bool isJoint(const XMLElement& element);

/// Makes of the file what a URDF reader without these elements accepts: <drake:joint> becomes a joint of a kind that it knows, and
/// limits of effort and speed, which Drake lets one omit, become 0.
void removeDrake(XMLElement& robot);

/// Adds what the elements say to the contents of the two files. Frames for the ends of loops are links with fixed joints.
/// \param file  the tree, to which limits on one side and frames are added
/// \throws InputError naming the line for what lacks an entry, is no number, or names what does not exist
void readDrakeElements(const XMLElement& robot, UrdfFile& file, YamlFile& settings);

}  // namespace bielle
