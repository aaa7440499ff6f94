// Reads the two files of a robot, or what stands for them.
#include "bielle/formats/reader.h"

#include <algorithm>
#include <filesystem>

#include "bielle/model/error.h"
#include "formats/reader_dialects.h"
#include "formats/reader_loops.h"
#include "formats/robot_files.h"
#include "model/listing.h"
#include "model/missing_part.h"

namespace bielle {
namespace {

// A key of the file that completes a robot replaces what the robot's own files say: what is then no more is told.
template <typename Spec>
void warnOfLost(const char* key, const std::vector<Spec>& own, const std::vector<Spec>& former, std::string Spec::*name,
                YamlFile& yaml) {
  std::vector<std::string> lost;
  for (const Spec& spec : former)
    if (std::none_of(own.begin(), own.end(), [&](const Spec& other) { return other.*name == spec.*name; }))
      lost.push_back(spec.*name);
  if (!own.empty() && !lost.empty())
    yaml.warnings.push_back(yaml.path + ": key '" + key + "': it replaces that of the robot: left out are " +
                            listItems(lost));
}

// A reference replaces that of its name as a whole, though a file may give one angle of it.
void warnOfLostAngles(const std::vector<Reference>& own, const std::vector<Reference>& former, YamlFile& yaml) {
  for (const Reference& reference : own)
    for (const Reference& other : former) {
      if (other.name != reference.name) continue;
      std::vector<std::string> lost;
      for (const auto& [joint, q] : other.joints)
        if (!reference.joints.count(joint) && std::any_of(q.begin(), q.end(), [](double x) { return x != 0; }))
          lost.push_back(joint);
      if (!other.height_frame.empty() && reference.height_frame.empty()) lost.push_back("its height");
      if (!other.feet.empty() && reference.feet.empty()) lost.push_back("its feet");
      if (!lost.empty())
        yaml.warnings.push_back(yaml.path + ": reference '" + reference.name +
                                "': it replaces that of the robot: left out are " + listItems(lost) +
                                "; give them as well, or another name");
    }
}

// Keys of the file that completes a robot take precedence over what the robot's own files say.
void complete(const YamlFile& own, YamlFile& yaml) {
  const auto replace = [](const auto& from, auto& to) {
    if (!from.empty()) to = from;
  };
  yaml.path = own.path;
  warnOfLost("motors", own.motors, yaml.motors, &MotorSpec::joint, yaml);
  warnOfLost("closures", own.closures, yaml.closures, &ClosureSpec::name, yaml);
  warnOfLost("contacts", own.contacts, yaml.contacts, &ContactSpec::name, yaml);
  replace(own.joint_types, yaml.joint_types);
  yaml.frames.insert(yaml.frames.end(), own.frames.begin(), own.frames.end());
  replace(own.closures, yaml.closures);
  if (!own.closures.empty()) yaml.axes = own.axes;
  replace(own.motors, yaml.motors);
  for (const MotorSpec& motor : own.motors)
    if (motor.armature) yaml.armature.erase(motor.joint);
  replace(own.armature, yaml.armature);
  for (const JointForceSpec& spec : own.joint_forces) {  // by joint
    const auto is_same = [&spec](const JointForceSpec& other) { return other.joint == spec.joint; };
    yaml.joint_forces.erase(std::remove_if(yaml.joint_forces.begin(), yaml.joint_forces.end(), is_same),
                            yaml.joint_forces.end());
  }
  yaml.joint_forces.insert(yaml.joint_forces.end(), own.joint_forces.begin(), own.joint_forces.end());
  replace(own.point_springs, yaml.point_springs);
  replace(own.contacts, yaml.contacts);
  warnOfLostAngles(own.references, yaml.references, yaml);
  replace(own.references, yaml.references);
  replace(own.serial_joints, yaml.serial_joints);
  replace(own.importance, yaml.importance);
  if (own.cross_inertia) yaml.cross_inertia = own.cross_inertia;
  if (own.base) yaml.base = own.base;
  if (own.rounding) yaml.rounding = own.rounding;
  if (own.motor_armature) yaml.motor_armature = own.motor_armature;
  if (own.gravity) yaml.gravity = own.gravity;
  yaml.wear.plays.insert(yaml.wear.plays.end(), own.wear.plays.begin(), own.wear.plays.end());
  for (const RodFriction& friction : own.wear.frictions) {  // by closure
    std::vector<RodFriction>& frictions = yaml.wear.frictions;
    const auto is_same = [&friction](const RodFriction& other) { return other.closure == friction.closure; };
    frictions.erase(std::remove_if(frictions.begin(), frictions.end(), is_same), frictions.end());
    frictions.push_back(friction);
  }
  yaml.names.insert(yaml.names.end(), own.names.begin(), own.names.end());
  yaml.warnings.insert(yaml.warnings.end(), own.warnings.begin(), own.warnings.end());
}

RobotFiles readUrdfAndYaml(const std::filesystem::path& path) {
  if (path.extension() == ".xacro") refuseXacro(path.string(), "file");
  const auto& readers = getRobotSources().readers;
  if (const auto reader = readers.find(path.extension().string()); reader != readers.end())
    return reader->second(path.string());
  if (contains(listExchangeExtensions(), path.extension().string()))
    throw MissingPart("the reader of " + path.extension().string() + " files");
  RobotFiles files;
  files.urdf = parseUrdf(readRobotText(path.string()), path.string(), files.yaml);
  std::filesystem::path settings = path;
  settings.replace_extension(".yaml");
  const bool has_settings = std::filesystem::exists(settings);
  const YamlFile own = has_settings ? readYaml(settings.string()) : YamlFile();
  const std::filesystem::path loops = findLoopClosures(path);
  if (own.closures.empty() && files.yaml.closures.empty() && !loops.empty())
    readLoopClosures(loops.string(), files.urdf, files.yaml);
  if (!has_settings) return files;
  if (!own.models.empty() || own.generator || own.composed)
    throw InputError(own.path,
                     own.composed    ? "key 'tree'"
                     : own.generator ? "key 'generator'"
                                     : "key 'model'",
                     "there is a URDF beside this file, " + path.string(),
                     "remove the key, or move the file to another directory");
  complete(own, files.yaml);
  return files;
}

RobotFiles generate(const YamlFile& yaml) {
  if (!getRobotSources().generate) throw MissingPart("the generators of robots");
  return getRobotSources().generate(yaml);
}

RobotFiles readRobotFiles(const std::filesystem::path& path);

RobotFiles readCompleted(const YamlFile& own) {
  const std::string model = findModel(own);
  if (model.empty()) {
    std::string models;
    for (const std::string& name : own.models) models += (models.empty() ? "" : ", ") + name;
    throw InputError(own.path, "key 'model'",
                     models.empty() ? "it is missing, as is `generator`, and there is no URDF beside this file"
                                    : "the robot that this file completes was not found: " + models,
                     "put its directory into one of those in BIELLE_ROBOTS, or correct the key");
  }
  return readRobotFiles(std::filesystem::path(model).lexically_normal());
}

RobotFiles readRobotFiles(const std::filesystem::path& path) {
  if (path.extension() != ".yaml") return readUrdfAndYaml(path);
  const YamlFile own = readYaml(path.string());
  if (own.composed) return generate(own);
  RobotFiles files = own.generator ? generate(own) : readCompleted(own);
  complete(own, files.yaml);
  return files;
}

}  // namespace

RobotFiles parseRobotText(const RobotText& text, const std::string& path) {
  RobotFiles files;
  files.urdf = parseUrdf(text.urdf, path, files.yaml);
  files.yaml = parseYaml(text.yaml, path);
  return files;
}

RobotSources& getRobotSources() {
  static RobotSources sources;
  return sources;
}

std::string LoadedRobot::path() const {
  return (std::filesystem::path(directory) / std::filesystem::path(file).filename()).lexically_normal().string();
}

std::vector<std::string> listHarmless(const std::string& file) { return readRobotFiles(file).urdf.harmless; }

std::map<std::string, double> listEfforts(const std::string& file) {
  std::map<std::string, double> efforts;
  for (const UrdfJoint& joint : readRobotFiles(file).urdf.joints)
    if (joint.effort) efforts[joint.joint.name] = *joint.effort;
  return efforts;
}

LoadedRobot loadRobot(const std::string& name_or_path, const LoadOptions& options) {
  // So that all messages name a file alike.
  const std::filesystem::path path = std::filesystem::path(findRobotFile(name_or_path)).lexically_normal();
  LoadedRobot robot;
  RobotFiles files = readRobotFiles(path);
  warnOfOpenLoops(files.urdf, files.yaml);
  robot.model = combineFiles(std::move(files), options.base, &robot);
  robot.file = std::filesystem::absolute(path).lexically_normal().string();
  robot.directory = path.has_parent_path() ? path.parent_path().string() : ".";
  return robot;
}

}  // namespace bielle
