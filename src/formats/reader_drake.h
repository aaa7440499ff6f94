#pragma once
/// \file Drake's own elements of a URDF: loops, couplers, springs between points, rotors and gears of motors, ball and universal joints.
#include <optional>

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

/// What <drake:linear_bushing_rpy> stands for: a hinge, ball or weld, by where it has no stiffness; empty if it is none of them.
/// \param torque, force  its stiffness in N m and N/m
std::optional<ClosureSpec> makeBushing(const Vector3d& torque, const Vector3d& force);
/// "its springs become a hinge that does not give"
std::string describeBushing(const ClosureSpec& bushing);
inline constexpr char kBushingRemedy[] =
    "make its stiffness positive, but for the torques about one axis or about all three";

/// <drake:tendon_constraint> of a URDF or an SDF file: a coupler, if its limits leave little play; else it is left out, with a warning.
void readDrakeTendon(const XMLElement& e, UrdfFile& file, YamlFile& settings);

}  // namespace bielle
