#pragma once
/// \file The contents of the two files of a robot before they are combined (for the readers).
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/model.h"
#include "bielle/model/wear.h"
#include "formats/decimals.h"
#include "formats/yaml_entry.h"

namespace bielle {

inline constexpr double kNoLimit =
    1e15;  ///< from here on a limit in a URDF or SDF file is none: libsdformat has 1e16 for it

struct UrdfLink {
  std::string name;
  Inertia inertia;  ///< in the link frame; zero without an <inertial> element
  std::vector<Visual> visuals;
  std::vector<Shape> shapes;
};

struct UrdfJoint {
  std::string parent, child;               ///< links
  Joint joint;                             ///< name, kind, X_PJ, axis
  VectorXd lower, upper;                   ///< per coordinate of its velocity, or empty for none
  std::optional<double> effort, velocity;  ///< of joints with one coordinate
  double damping = 0, friction = 0;        ///< of <dynamics>
  std::string mimicked;  ///< joint whose coordinate times `multiplier`, plus `offset`, is that of this one; or empty
  double multiplier = 1, offset = 0;
};

/// A URDF file, or the tree of another one, checked to be one tree. Joints are depth first, the children of a link in the order
/// of the file.
struct UrdfFile {
  std::string path, name, root;
  std::map<std::string, UrdfLink> links;
  std::vector<UrdfJoint> joints;
  std::vector<std::string> warnings;
  std::vector<std::string>
      harmless;                ///< what is left out and changes no mechanism: "file: element (lines)", maybe attributes
  RoundingTolerance rounding;  ///< of the numbers of its placements
  bool has_own_base = false;   ///< it says itself what is free: the option of a free base has no effect
  bool is_urdf = false;        ///< its floating joints have origins, from which other formats do not count
  std::vector<std::string> dependent{};  ///< joints that it says depend on others
};

/// Joint kind that replaces that of the URDF, with the axes of a universal joint in the joint's frame.
struct JointRetyping {
  JointKind kind = JointKind::Fixed;
  Vector3d axis = Vector3d::UnitZ(), axis2 = Vector3d::UnitY();
};

struct ClosureSpec {
  std::string name, frame1, frame2;
  ClosureKind kind = ClosureKind::Weld6D;
  Vector3d axis = Vector3d::UnitZ();
  std::map<std::string, double> coefficients;         ///< of a coupler, by joint,
  std::map<std::string, std::vector<double>> higher;  ///< and those of q^2, q^3, .. of joints that have them
  double offset = 0;
  std::optional<double> length;  ///< of a distance; by default that of the neutral posture
  double kp = 0, kd = 0;
};

/// Half the range within which a sum of coordinates is kept by a coupler, and its play told: rad, and m if one of them slides.
inline constexpr double kMostPlay = 0.1, kMostSlidePlay = 0.01;

/// A link that only turns with a motor, next to massless: nothing without mass has inertia.
UrdfLink makeRotor(const std::string& name);

/// A frame that the tree does not have.
struct FrameSpec {
  std::string name, link;
  SE3 X_LF;
};

struct MotorSpec {
  std::string joint;
  std::optional<double> armature, effort, velocity, torque_loss, continuous_effort;
  MotorDrive drive;
  std::string role = {};  ///< in a robot composed of parts
};

struct JointForceSpec {
  std::string joint;
  JointForce force;
};

struct PointSpringSpec {
  std::string frame1, frame2;
  PointSpring spring;  ///< its points in these frames
};

struct ContactSpec {
  std::string name, frame;
  ContactKind kind = ContactKind::Surface6D;
  double half_length = 0, half_width = 0;
};

/// What an entry calls a part of the robot.
struct RobotName {
  enum class Kind { Joint, Frame, Contact };
  Kind kind;
  std::string name;
  YamlEntry entry;
};

/// A robot's YAML file. Names are not resolved yet.
struct YamlFile {
  std::string path;
  std::vector<std::string> models;  ///< of the robot that this file completes, in the order in which they are tried
  std::optional<YamlEntry> generator,
      settings;                       ///< of the robot that this file is, or completes; names and values as given
  std::optional<YamlEntry> composed;  ///< the whole document of a robot composed of parts; then all else is empty
  std::optional<BaseKind> base;
  std::vector<std::pair<std::string, JointRetyping>> joint_types;  ///< in the order of the file
  std::optional<double> cross_inertia;                             ///< of universal joints, kg m^2
  std::vector<FrameSpec> frames;
  std::vector<ClosureSpec> closures;
  std::vector<MotorSpec> motors;
  std::map<std::string, double> armature;  ///< joint -> kg m^2
  std::optional<double> motor_armature;    ///< of every motor
  std::vector<JointForceSpec> joint_forces;
  std::vector<PointSpringSpec> point_springs;
  std::vector<ContactSpec> contacts;
  std::vector<Reference> references;
  std::vector<std::string> serial_joints;
  std::vector<std::pair<std::string, std::array<double, 2>>> importance;  ///< joint -> of its position, of its velocity
  std::optional<Vector3d> gravity;
  Wear wear;                              ///< of the robot in worlds
  std::vector<RobotName> names;           ///< all that this file uses, to be found in the robot
  Decimals axes{Decimals::Kind::Angles};  ///< of closures
  std::optional<double> rounding;         ///< instead of that of the numbers, rad and m
  std::vector<std::string> warnings;
};

/// \param path  named in errors, and the place of meshes
/// \param settings  gets what elements of Drake say
/// \throws InputError for anything but one tree of named links with finite numbers
UrdfFile parseUrdf(const std::string& xml, const std::string& path, YamlFile& settings);

/// \throws InputError that says how to make a URDF of a file written in xacro
[[noreturn]] void refuseXacro(const std::string& path, const std::string& element);

/// \throws InputError for unknown keys, wrong types, lists that do not match
YamlFile parseYaml(const std::string& text, const std::string& path);
YamlFile readYaml(const std::string& path);
/// The keys that a robot's YAML file has in common with a part: closures, motors, joint_forces, point_springs, contacts, references,
/// serial_joints, importance, gravity and base.
const std::vector<std::string>& listSharedKeys();
void readSharedKeys(const YamlFields& fields, YamlFile& file);
extern const YamlKeys kFrameKeys;  ///< of an entry of `frames`

/// A name for what has none in its file: `made`, or, where several are in one line, with a number behind it.
template <typename IsTaken>
std::string makeUnusedName(const std::string& made, const IsTaken& isTaken) {
  std::string name = made;
  for (int i = 2; isTaken(name); ++i) name = made + "_" + std::to_string(i);
  return name;
}
std::string nameClosure(const std::string& made, const YamlFile& file);
std::string namePointSpring(const std::string& made, const YamlFile& file);

/// The whole content of a file. \throws InputError when it cannot be read, or is too large
std::string readRobotText(const std::string& path);

/// The URDF, the MJCF or the YAML file with a generator of the robot that a file with the key `model` completes; empty if none of
/// them exists.
std::string findModel(const YamlFile& yaml);

/// A URDF with its YAML file, or what stands for them, and possibly a file that completes them.
struct RobotFiles {
  UrdfFile urdf;
  YamlFile yaml;
};

/// Extensions of files that stand for both files of a robot: those of MuJoCo, SDF and USD.
const std::vector<std::string>& listExchangeExtensions();

/// The files that formatRobot() wrote the text of. \param path  named in errors, and the place of meshes
RobotFiles parseRobotText(const RobotText& text, const std::string& path);

/// UrdfFile::harmless of the file of a robot. \throws InputError as loadRobot() does
std::vector<std::string> listHarmless(const std::string& file);

/// UrdfJoint::effort of the joints of the file of a robot that have one, by name, whether a motor drives them or not.
/// \throws InputError as loadRobot() does
std::map<std::string, double> listEfforts(const std::string& file);

/// The model of both files. Of what is harmless, the warnings give the number.
/// \param base  overrides the file's key   \param told  receives warnings, locked loops and wear; null for none
Model combineFiles(RobotFiles files, std::optional<BaseKind> base, LoadedRobot* told);

/// What other libraries add to loadRobot() when a program that links them starts (model/missing_part.h).
struct RobotSources {
  /// Readers of other formats by the extension of their files. They throw InputError for what cannot be read as a robot.
  std::map<std::string, RobotFiles (*)(const std::string& path)> readers;
  /// The files of the robot that a YAML file with the key `generator`, or one composed of parts, describes.
  RobotFiles (*generate)(const YamlFile&) = nullptr;
};
RobotSources& getRobotSources();

}  // namespace bielle
