#include "bielle/model/names.h"

#include <algorithm>

#include "bielle/model/error.h"

namespace bielle {
namespace {

std::vector<const char*> getPositionEntries(JointKind kind) {
  switch (kind) {
    case JointKind::Spherical:
      return {".qx", ".qy", ".qz", ".qw"};
    case JointKind::Universal:
      return {".angle1", ".angle2"};
    case JointKind::Planar:
      return {".x", ".y", ".angle"};
    case JointKind::FreeFlyer:
      return {".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"};
    case JointKind::Fixed:
      return {};
    default:
      return {""};
  }
}

std::vector<const char*> getVelocityEntries(JointKind kind) {
  switch (kind) {
    case JointKind::Spherical:
      return {".wx", ".wy", ".wz"};
    case JointKind::Universal:
      return {".rate1", ".rate2"};
    case JointKind::Planar:
      return {".vx", ".vy", ".rate"};
    case JointKind::FreeFlyer:
      return {".vx", ".vy", ".vz", ".wx", ".wy", ".wz"};
    case JointKind::Fixed:
      return {};
    default:
      return {""};
  }
}

}  // namespace

std::vector<std::string> makePositionNames(const Model& model) {
  std::vector<std::string> names;
  for (const Joint& joint : model.joints())
    for (const char* entry : getPositionEntries(joint.kind)) names.push_back(joint.name + entry);
  return names;
}

std::vector<std::string> makeVelocityNames(const Model& model) {
  std::vector<std::string> names;
  for (const Joint& joint : model.joints())
    for (const char* entry : getVelocityEntries(joint.kind)) names.push_back(joint.name + entry);
  return names;
}

std::vector<std::string> makeWrenchNames(const std::vector<std::string>& names) {
  std::vector<std::string> entries;
  for (const std::string& name : names)
    for (const char* entry : kWrenchEntries) entries.push_back(name + "." + entry);
  return entries;
}

int findColumn(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw InputError("", "column '" + name + "'", "the trajectory does not have it");
  return static_cast<int>(found - names.begin());
}

}  // namespace bielle
