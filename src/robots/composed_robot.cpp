#include "robots/composed_robot.h"

#include <algorithm>
#include <filesystem>
#include <functional>

#include "bielle/model/error.h"
#include "robots/part_composer.h"
#include "robots/part_parameters.h"

namespace bielle {
namespace {

// Joints depth first, those of one link in the order in which they were added.
void sortJoints(UrdfFile& urdf) {
  std::map<std::string, std::vector<const UrdfJoint*>> below;
  for (const UrdfJoint& joint : urdf.joints) below[joint.parent].push_back(&joint);
  std::vector<UrdfJoint> sorted;
  const std::function<void(const std::string&)> visit = [&](const std::string& link) {
    for (const UrdfJoint* joint : below[link]) {
      sorted.push_back(*joint);
      visit(joint->child);
    }
  };
  visit(urdf.root);
  urdf.joints = std::move(sorted);
}

void checkMounts(const Composition& composition) {
  for (const MountCheck& mount : composition.mounts) {
    const UrdfFile& urdf = composition.files.urdf;
    const bool is_joint = std::any_of(urdf.joints.begin(), urdf.joints.end(),
                                      [&mount](const UrdfJoint& j) { return j.joint.name == mount.name; });
    const bool is_link = mount.name == "world" || urdf.links.count(mount.name) > 0;
    if (mount.kind == MountKind::Link ? is_link : is_joint) continue;
    const bool is_other = is_link || is_joint;
    mount.entry.fail("the part wants a " + std::string(mount.kind == MountKind::Link ? "link" : "joint") +
                         " here, and '" + mount.name + (is_other ? "' is a " : "' is not there") +
                         (is_other ? (is_link ? "link" : "joint") : ""),
                     "name one that the robot has");
  }
}

}  // namespace

ComposedRobot::ComposedRobot(const std::string& path, const std::map<std::string, std::string>& parts)
    : file_(&library_.read(path)), parameters_("parameter", std::filesystem::path(path).stem().string()) {
  if (!file_->mounts.empty())
    throw InputError(path, "key 'mounts'", "it is a part of a robot", "give a robot whose `tree` mounts it");
  library_.own_parts = parts;
  for (const PartParameter& p : listParameters(library_, *file_, {})) {
    const std::string element = "parameter '" + p.option.name + "' of " + p.file;
    if (p.required)
      throw InputError(path, element, "nothing gives it a value", "declare one of this name, or `set` it");
    parameters_.add(p.option);
  }
}

bool ComposedRobot::uses(const std::string& parameter, PartChoices chosen) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  chosen.erase(parameter);  // which would not be listed
  const std::vector<PartParameter>& used = listParameters(library_, *file_, chosen);
  return std::any_of(used.begin(), used.end(),
                     [&parameter](const PartParameter& p) { return p.option.name == parameter; });
}

RobotFiles ComposedRobot::make(const OptionSet& parameters) const {
  OptionSet own = parameters_;
  for (const Option& option : parameters) own.set(option.name, option.value);
  const std::lock_guard<std::mutex> lock(mutex_);
  MountedPart robot;
  for (const Option& option : own) robot.values[option.name] = option.value;
  Composition composition{library_, {}, {}, {}};
  RobotFiles& files = composition.files;
  files.urdf.path = files.yaml.path = file_->path;
  files.urdf.name = std::filesystem::path(file_->path).stem().string();
  composePart(*file_, robot, composition);
  for (const std::function<void()>& add : composition.later) add();
  if (files.urdf.root.empty())
    throw InputError(file_->path, "key 'tree'", "no link is without a parent", "leave that of one out");
  sortJoints(files.urdf);
  checkMounts(composition);
  return std::move(composition.files);
}

}  // namespace bielle
