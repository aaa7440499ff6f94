// Every way a robot file can be wrong: the error names the file, the element and a remedy.
#include <catch2/catch.hpp>
#include <iostream>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/yaml_progress.h"
#include "get_error.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// The error message of loadRobot, empty when it succeeds.
std::string getErrorOfLoading(const std::string& name_or_path) {
  return getError([&] { loadRobot(name_or_path); });
}

struct Mistake {
  std::string from, to;          // in the toy's file
  std::string element, problem;  // expected
  std::string remedy;
};

// The message must read "file: element: ... problem ...; ... remedy ...".
void checkError(const std::string& error, const std::string& file, const Mistake& m) {
  CAPTURE(error, m.to);
  REQUIRE(!error.empty());
  CHECK(error.compare(0, file.size() + 2, file + ": ") == 0);
  const size_t element = error.find(m.element, file.size());
  CHECK(element == file.size() + 2);
  const size_t problem = error.find(m.problem, file.size() + 2 + m.element.size());
  CHECK(problem != std::string::npos);
  const size_t separator = error.rfind("; ");
  REQUIRE(separator != std::string::npos);
  CHECK(error.find(m.remedy, separator) != std::string::npos);
}

const std::string kSecondArm = "<link name=\"arm\"/></robot>";

const std::vector<Mistake> kUrdfMistakes = {
    {"</robot>", "", "line ", "not well-formed XML", "syntax"},
    {"<robot name=\"toy\">", "<robot name=\"toy>", "line ", "not well-formed XML", "syntax"},
    {"<robot name=\"toy\">", "<robot>", "element 'robot'", "no name", "name attribute"},
    {"</robot>", kSecondArm, "link 'arm'", "declared twice (line 40)", "rename"},
    {"name=\"wrist\"", "name=\"shoulder\"", "joint 'shoulder'", "declared twice", "rename"},
    {"name=\"wrist\"", "", "joint from 'arm' to 'hand' (line 30)", "no name", "name attribute"},
    {"<child link=\"hand\"/>", "<child link=\"nail\"/>", "joint 'wrist'", "child link 'nail' does not exist",
     "declare"},
    {"<parent link=\"arm\"/>", "", "joint 'wrist'", "parent link '' does not exist", "declare"},
    {"<child link=\"hand\"/>", "<child link=\"rod\"/>", "link 'rod'", "child of two joints, 'wrist' and 'rod_joint'",
     "closure"},
    {"</robot>", "<link name=\"other\"/></robot>", "link 'other'", "second root beside 'base'", "joint"},
    {"<parent link=\"arm\"/>", "<parent link=\"hand\"/>", "link 'hand'", "cycle", "closure"},
    {"<mass value=\"3\"/>", "<mass value=\"nan\"/>", "link 'base'", "<mass value=\"nan\"> (line 5)", "correct"},
    {"<mass value=\"3\"/>", "<mass value=\"1e999\"/>", "link 'base'", "finite", "correct"},
    {"<mass value=\"3\"/>", "<mass value=\"1e308\"/>", "link 'base'", "its mass (1e+308 kg)", "correct"},
    {"xyz=\"0 0 0.5\"", "xyz=\"0 0 1e300\"", "joint 'shoulder'", "its origin is not within 1e+12 m", "correct"},
    {"<mass value=\"3\"/>", "<mass value=\"three\"/>", "link 'base'", "<mass value=\"three\">", "correct"},
    {"<mass value=\"3\"/>", "<mass value=\"-3\"/>", "link 'base'", "mass is negative (-3", "0 or more"},
    {"<mass value=\"3\"/>", "", "robot 'toy'", "Link [base]", "correct"},
    {"ixx=\"0.01\"", "ixx=\"-0.01\"", "link 'arm'", "negative principal moment", "correct <inertia>"},
    {"ixx=\"0.01\"", "", "robot 'toy'", "Link [arm]", "correct"},
    {"xyz=\"0.2 0 0\"", "xyz=\"0.2 0\"", "joint 'wrist'", "<origin xyz=\"0.2 0\"> (line 31)", "correct"},
    {"xyz=\"0 1 0\"", "xyz=\"0 0 0\"", "joint 'shoulder'", "axis is not a direction", "non-zero"},
    {"type=\"continuous\"", "type=\"hinge\"", "joint 'rod_joint'", "type 'hinge' is unknown", "revolute"},
    {"type=\"continuous\"", "", "joint 'rod_joint'", "type '' is unknown", "revolute"},
    {"lower=\"-1\" upper=\"2\"", "lower=\"2\" upper=\"-1\"", "joint 'shoulder'", "lower limit is above", "swap"},
    {"effort=\"5\"", "effort=\"-5\"", "joint 'shoulder'", "limit is negative", "0 for none"},
    {"effort=\"5\"", "effort=\"inf\"", "joint 'shoulder'", "<limit effort=\"inf\">", "correct"},
    {"<box size=\"0.2 0.02 0.02\"/>", "", "robot 'toy'", "Link [arm]", "correct"},
    {"<limit lower=\"-1\" upper=\"2\" effort=\"5\" velocity=\"7\"/>", "", "robot 'toy'", "limits", "correct"},
    {"name=\"hand\"/>", "name=\"world\"/>", "joint 'wrist'", "child link 'hand' does not exist", "declare"},
    {"<axis xyz=\"0 0 1\"/>", "<mimic joint=\"elbow\"/>", "closure 'rod_joint'", "no moving joint 'elbow'", "fixed"},
    {"<axis xyz=\"0 0 1\"/>", "<mimic joint=\"rod_joint\"/>", "joint 'rod_joint'", "mimics itself", "another"},
    {"<axis xyz=\"0 0 1\"/>", "<mimic joint=\"shoulder\" multiplier=\"two\"/>", "joint 'rod_joint'",
     "<mimic multiplier=\"two\"> (line 38)", "correct"},
    {"name=\"rod_joint\"", "name=\"root_joint\"", "joint 'root_joint'", "two joints have this name", "rename"},
};

const std::string kLoops = "closed_loop: [[hand, rod]]", kType = "type: [6D]", kMotors = "name_mot: [shoulder]";

const std::vector<Mistake> kYamlMistakes = {
    {kType, "type: [6D", "line ", "not well-formed YAML", "syntax"},
    {kMotors, "name_mot [shoulder]", "key 'name_mot [shoulder]' (line 3)", "unknown", "name_mot, motors"},
    {kType, "typo: [6D]", "key 'typo' (line 2)", "unknown", "known keys are closed_loop, type"},
    {kType, "type: [6D]\ntype: [3D]", "document", "key 'type' is given twice", "keep one"},
    {kType, kType + "\n<<: {base: fixed}", "key '<<'", "unknown", "known keys are"},
    {kType, kType + "\ngravity: [0, 0, 0x10]", "key 'gravity'[2]", "not a number", "give one number"},
    {kType, "type: [7d]", "key 'type'[0] (line 2)", "'7d' is unknown", "6d (weld)"},
    {kType, "type: [6d, 6d]", "key 'type' (line 2)", "2 element(s)", "give 1"},
    {kType, "", "document", "no 'type'", "add it"},
    {kLoops, "", "key 'type'", "no closed_loop", "frames"},
    {kType, kType + "\nframes: {tip: {link: nail}}", "frame 'tip'", "no link 'nail'", "name"},
    {kType, kType + "\nframes: {rod: {link: arm}}", "frame 'rod'", "of this name already", "rename"},
    {kType, kType + "\nclosure_name: [a, b]", "key 'closure_name'", "2 element(s)", "give 1"},
    {kLoops, "closed_loop: [[hand]]", "key 'closed_loop'[0] (line 1)", "1 element(s)", "give 2"},
    {kLoops, "closed_loop: hand", "key 'closed_loop'", "not a list", "[a, b, ...]"},
    {kLoops, "closed_loop: [[hand, foot]]", "key 'closed_loop'[0][1] (line 1)", "no link or joint 'foot'",
     "known are world, arm"},
    {kLoops, "closed_loop: [[hand, hand]]", "closure 'hand--hand'", "with itself", "two frames"},
    {kLoops, "closed_loop: [[hand, arm]]", "closure 'hand--arm'", "same rigid body", "joint between"},
    {kLoops, "closed_loop: [[hand, rod], [arm, rod]]", "key 'type' (line 2)", "1 element(s)", "give 2"},
    {kType, kType + "\nclosures: [{name: hand--rod, frames: [hand, rod], type: 3d}]", "closure 'hand--rod'",
     "two closures", "rename"},
    {kType, kType + "\nclosures: [{frames: [arm, rod], type: 6d, axis: [0, 0, 1]}]", "key 'closures'[0]: key 'axis'",
     "only a hinge", "5d"},
    {kType, kType + "\nclosures: [{frames: [arm, rod], type: 5d, axis: [0, 0, 0]}]", "closure 'arm--rod'",
     "not a direction", "non-zero"},
    {kType, kType + "\nclosures: [{frames: [arm, rod], type: 6d, kp: -1}]", "closure 'arm--rod'", "gain", "kp and kd"},
    {kType, kType + "\nclosures: [{frames: [arm, rod]}]", "key 'closures'[0]", "no 'type'", "add it"},
    {kType, kType + "\nclosures: [{frames: [arm, rod], type: 6d, stiffness: 1}]", "key 'closures'[0]: key 'stiffness'",
     "unknown", "name, frames, type, axis, length, joints, offset, kp, kd"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler}]", "key 'closures'[0]", "no 'joints'", "add it"},
    {kType, kType + "\nclosures: [{type: coupler, joints: {}}]", "key 'closures'[0]", "no 'name'", "add it"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, frames: [arm, rod]}]", "key 'closures'[0]: key 'frames'",
     "coordinates, not frames", "joints"},
    {kType, kType + "\nclosures: [{frames: [arm, rod], type: 6d, offset: 1}]", "key 'closures'[0]: key 'offset'",
     "only a coupler", "type coupler"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1}}]", "closure 'belt'",
     "fewer than two", "fixed"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1, elbow: 1}}]",
     "key 'closures'[0]: key 'joints': key 'elbow' (line 3)", "no joint 'elbow'", "known are root_joint, shoulder"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1, rod_joint: []}}]",
     "key 'closures'[0]: key 'joints': key 'rod_joint'", "has no coefficient", "give a number, or a list"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1, rod_joint: 0}}]", "closure 'belt'",
     "zero or not finite", "omit"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1, root_joint: 1}}]", "closure 'belt'",
     "free-flyer joint of 6", "revolute"},
    {kType, kType + "\nclosures: [{name: belt, type: coupler, joints: {shoulder: 1, rod_joint: 1}, kd: -1}]",
     "closure 'belt'", "gain", "kp and kd"},
    {"type: [6D]", "type: [coupler]", "key 'type'[0]", "does not connect frames", "closures"},
    {kMotors, "name_mot: [elbow]", "key 'name_mot'[0] (line 3)", "no joint 'elbow'", "known are root_joint, shoulder"},
    {kMotors, "name_mot: [wrist]", "motor 'wrist'", "no moving joint", "not fixed"},
    {kMotors, "name_mot: [shoulder, shoulder]", "motor 'shoulder'", "two motors", "once"},
    {kMotors, kMotors + "\njoint_name: [shoulder]\njoint_type: [SPHERICAL]", "motor 'shoulder'", "3 coordinates",
     "revolute"},
    {kMotors, "motors: {shoulder: {effort: 0}}", "motor 'shoulder'", "effort limit", "positive"},
    {kMotors, "motors: {shoulder: {velocity: -1}}", "motor 'shoulder'", "velocity limit", "positive"},
    {kMotors, "motors: {shoulder: {armature: -1}}", "motor 'shoulder'", "armature", "inertia"},
    {kMotors, "motors: {shoulder: {torque_loss: -0.1}}", "motor 'shoulder'", "torque_loss", "W/(N m)^2"},
    {kMotors, "motors: {shoulder: {torque_loss: .inf}}", "key 'motors': key 'shoulder': key 'torque_loss' (line 3)",
     "not finite", "finite"},
    {kMotors, "motors: {shoulder: {effort: .nan}}", "key 'motors': key 'shoulder': key 'effort' (line 3)", "not finite",
     "finite"},
    {kMotors, "motors: {shoulder: {ratio: 0}}", "motor 'shoulder'", "ratio is not positive", "turns of the rotor"},
    {kMotors, "motors: {shoulder: {resistance: 1}}", "motor 'shoulder'", "without its torque constant",
     "add torque_constant"},
    {kMotors, "motors: {shoulder: {voltage: 24}}", "motor 'shoulder'", "without its torque constant",
     "add torque_constant"},
    {kMotors, "motors: {shoulder: {torque_constant: -1}}", "motor 'shoulder'", "0 or more", "N m/A"},
    {kMotors, "motors: {shoulder: {torque_constant: 1, current: 0}}", "motor 'shoulder'", "not positive", "V and A"},
    {kMotors, "motors: {shoulder: {efficiency: 1.1}}", "motor 'shoulder'", "efficiency is outside", "0.9"},
    {kMotors, "motors: {shoulder: {back_efficiency: 0}}", "motor 'shoulder'", "efficiency is outside", "0.9"},
    {kMotors, "motors: {shoulder: {continuous_effort: 0}}", "motor 'shoulder'", "continuous effort", "indefinitely"},
    {kMotors, "motors: {shoulder: {type: ak81}}", "key 'motors': key 'shoulder': key 'type'",
     "no motor 'ak81' in a catalogue", "ak80-9"},
    {kMotors, "motors: {shoulder: }\nmotor_catalogue: none.yaml", "key 'motor_catalogue' (line 4)",
     "there is no file 'none.yaml'", "relative to this file"},
    {kMotors, "motor_catalogue: none.yaml", "key 'motor_catalogue' (line 3)", "no motor is taken from it", "`type`"},
    {kMotors, kMotors + std::string("\n---\nmotors: {rod_joint: {}}"), "document (line 5)", "a further document",
     "file of its own"},
    {kMotors, kMotors + std::string("\n...\nmotors: {rod_joint: {}}"), "document (line 5)", "a further document",
     "file of its own"},
    {kMotors, "motors: {shoulder: {torque: 1}}", "key 'motors': key 'shoulder': key 'torque'", "unknown", "effort"},
    {kMotors, "motors: [shoulder]", "key 'motors'", "not a map", "{name: value, ...}"},
    {kMotors, "motors: {shoulder: {armature: 1}}\narmature: {shoulder: 2}", "motor 'shoulder'", "both", "keep one"},
    {kMotors, "joint_forces: {elbow: {damping: 1}}", "key 'joint_forces': key 'elbow' (line 3)", "no joint 'elbow'",
     "known are root_joint, shoulder"},
    {kMotors, "joint_forces: {root_joint: {damping: 1}}", "force on joint 'root_joint'", "6 coordinates", "revolute"},
    {kMotors, "joint_forces: {shoulder: {stiffness: -1}}", "force on joint 'shoulder'", "0 or more", "correct"},
    {kMotors, "joint_forces: {shoulder: {friction_speed: 0}}", "force on joint 'shoulder'", "friction_speed", "damper"},
    {kMotors, "joint_forces: {shoulder: {friction: 2, stiction: 1}}",
     "key 'joint_forces': key 'shoulder': key 'stiction'", "less than the friction", "in motion"},
    {kMotors, "joint_forces: {shoulder: {friction: 2, stribeck_speed: 1}}",
     "key 'joint_forces': key 'shoulder': key 'stribeck_speed'", "no stiction", "`stiction`"},
    {kMotors, "joint_forces: {shoulder: {stiction: 2, stribeck_speed: 0.01}}",
     "key 'joint_forces': key 'shoulder': key 'stribeck_speed'", "not above", "that of sliding"},
    {kMotors, "play: {elbow: 0.001}", "play of 'elbow'", "no such joint or closure", "stands for any text"},
    {kMotors, "play: {shoulder: -0.001}", "key 'play': key 'shoulder'", "negative", "from stop to stop"},
    {kMotors, "play: {shoulder: 0.001}", "play of 'shoulder'", "no armature", "armature"},
    {kMotors, "point_springs: {s: {stiffness: 1, rest: 1}}", "key 'point_springs': key 's'", "no 'frames'", "add it"},
    {kMotors, "point_springs: {s: {frames: [arm, no]}}", "key 'point_springs': key 's': key 'frames'[1] (line 3)",
     "no link or joint 'no'", "known are world, arm"},
    {kMotors, "point_springs: {s: {frames: [arm, hand]}}", "point spring 's'", "same rigid body", "two bodies"},
    {kMotors, "point_springs: {s: {frames: [arm, rod], stiffness: 5}}", "key 'point_springs': key 's'", "no rest",
     "its length"},
    {kMotors, "point_springs: {s: {frames: [world, arm], damping: -5}}", "point spring 's'", "0 or more", "N s/m"},
    {kMotors, "point_springs: {s: {frames: [arm, rod], points: [[0, 0, 0]]}}",
     "key 'point_springs': key 's': key 'points'", "1", "2"},
    {kMotors, "point_springs: {s: {frames: [arm, rod], length: 1}}", "key 'point_springs': key 's': key 'length'",
     "unknown", "rest"},
    {kMotors, "joint_forces: {shoulder: {mass: 1}}", "key 'joint_forces': key 'shoulder': key 'mass'", "unknown",
     "stiffness"},
    {kMotors, "armature: {elbow: 2}", "key 'armature': key 'elbow' (line 3)", "no joint 'elbow'",
     "known are root_joint"},
    {kMotors, "armature: {rod_joint: -2}", "armature of 'rod_joint'", "0 or more", "inertia"},
    {kMotors, "armature: [1]", "key 'armature'", "not a number", "number"},
    {kMotors, "joint_name: [shoulder]", "key 'joint_name'", "no joint_type", "both"},
    {kMotors, "joint_name: [shoulder]\njoint_type: [FIXED, FIXED]", "key 'joint_type'", "2 element(s)", "give 1"},
    {kMotors, "joint_name: [shoulder]\njoint_type: [UJOINT_XX]", "key 'joint_type'[0]", "'UJOINT_XX' is unknown",
     "UJOINT_XY"},
    {kMotors, "joint_name: [shoulder]\njoint_type: [UJOINT_XW]", "key 'joint_type'[0]", "unknown", "SPHERICAL"},
    {kMotors, "joint_name: [shoulder, shoulder]\njoint_type: [FIXED, FIXED]", "key 'joint_name'", "listed twice",
     "once"},
    {kMotors, "base: floating", "key 'base'", "'floating' is unknown", "free or fixed"},
    {kMotors, "gravity: [0, 0]", "key 'gravity'", "2 element(s)", "give 3"},
    {kMotors, "gravity: [0, 0, down]", "key 'gravity'[2]", "not a number", "number"},
    {kMotors, "serial_joints: [elbow]", "key 'serial_joints'[0] (line 3)", "no joint 'elbow'", "known are root_joint"},
    {kMotors, "serial_joints: [shoulder, shoulder]", "serial joint 'shoulder'", "twice", "once"},
    {kMotors, "cross_inertia: 0", "key 'cross_inertia'", "not positive", "kg m^2"},
    {kMotors, "importance: {elbow: [1, 1]}", "key 'importance': key 'elbow' (line 3)", "no joint 'elbow'",
     "known are root_joint"},
    {kMotors, "importance: {shoulder: [1, -1]}", "key 'importance': key 'shoulder'", "negative", "0 or more"},
    {kMotors, "importance: {shoulder: 1}", "key 'importance': key 'shoulder'", "not a list", "[a, b"},
    {kMotors, "contacts: {toe: {frame: foot, type: 6d}}", "key 'contacts': key 'toe': key 'frame' (line 3)",
     "no link or joint 'foot'", "known are world, arm"},
    {kMotors, "contacts: {toe: {frame: hand, type: 4d}}", "key 'contacts': key 'toe': key 'type'", "unknown", "3d"},
    {kMotors, "contacts: {toe: {frame: hand, type: 3d, sole: [1, 1]}}", "key 'contacts': key 'toe': key 'sole'",
     "no sole", "6d"},
    {kMotors, "contacts: {toe: {frame: hand, type: 6d, sole: [-1, 1]}}", "contact 'toe'", "sole", "length and width"},
    {kMotors, "contacts: {toe: {type: 6d}}", "key 'contacts': key 'toe'", "no 'frame'", "add it"},
    {kMotors, "references: {up: {joints: {elbow: 1}}}",
     "key 'references': key 'up': key 'joints': key 'elbow' (line 3)", "no joint 'elbow'", "known are root_joint"},
    {kMotors, "references: {up: {joints: {shoulder: [1, 2]}}}", "reference 'up'", "2 value(s)", "that many"},
    {kMotors, "references: {up: {joints: {root_joint: [0, 0, 0, 0, 0, 0, 2]}}}", "reference 'up'", "unit length",
     "normalise"},
    {kMotors, "references: {up: {feet: {toe: [0, 0, 0]}}}",
     "key 'references': key 'up': key 'feet': key 'toe' (line 3)", "no contact 'toe'", "known are none"},
    {kMotors, "references: {up: {height: {frame: head, value: 1}}}",
     "key 'references': key 'up': key 'height': key 'frame' (line 3)", "no link or joint 'head'",
     "known are world, arm"},
    {kMotors, "references: {up: {height: {frame: hand}}}", "key 'references': key 'up': key 'height'", "no 'value'",
     "add it"},
    {kMotors, "references: {up: {pose: 1}}", "key 'references': key 'up': key 'pose'", "unknown", "joints, height"},
};

}  // namespace

TEST_CASE("the toy robot itself loads without a word") {
  const RobotDirectory directory;
  const LoadedRobot robot = loadRobot(directory.writeRobot(kToyUrdf, kToyYaml));
  CHECK(robot.warnings.empty());
}

TEST_CASE("a wrong URDF is an error that names file, element and remedy, and urdfdom keeps silent") {
  const RobotDirectory directory;
  std::ostringstream captured;
  std::streambuf* const terminal = std::cerr.rdbuf(captured.rdbuf());
  std::vector<std::string> errors;
  for (const Mistake& m : kUrdfMistakes)
    errors.push_back(getErrorOfLoading(directory.writeRobot(replaceOnce(kToyUrdf, m.from, m.to), kToyYaml)));
  std::cerr.rdbuf(terminal);
  for (size_t i = 0; i < errors.size(); ++i) checkError(errors[i], directory.path() + "/robot.urdf", kUrdfMistakes[i]);
  CHECK(captured.str().empty());
}

TEST_CASE("a wrong YAML is an error that names file, element and remedy") {
  const RobotDirectory directory;
  for (const Mistake& m : kYamlMistakes)
    checkError(getErrorOfLoading(directory.writeRobot(kToyUrdf, replaceOnce(kToyYaml, m.from, m.to))),
               directory.path() + "/robot.yaml", m);
}

TEST_CASE("messages name a file by one path, however it is given") {
  const RobotDirectory directory;
  const std::string place = directory.writeRobot(kToyUrdf, replaceOnce(kToyYaml, "type: [6D]", "type: [7D]"));
  const std::string completing = directory.write("mine/mine.yaml", "model: ../mine/../robot.urdf\n");
  for (const std::string& given :
       {place, place + "/", place + "/./robot.urdf", place + "/mine/../robot.urdf", completing}) {
    CAPTURE(given);
    CHECK(getErrorOfLoading(given).rfind(directory.path() + "/robot.yaml: key 'type'[0] (line 2)", 0) == 0);
  }
}

TEST_CASE("files that are no robot at all are errors") {
  const RobotDirectory directory;
  CHECK(getErrorOfLoading(directory.writeRobot("", "")).find("not well-formed XML") != std::string::npos);
  for (const char* text : {"{\n\"motion\": \"squat\"}", "  time,q\n0,1\n", "PK\x03\x04\x14\xeb"})  // of results
    CHECK_THAT(getErrorOfLoading(directory.writeRobot(text, "")),
               Catch::Contains("it is no XML") && Catch::Contains("the directory of a result"));
  CHECK(getErrorOfLoading(directory.writeRobot("<world/>", "")).find("not <robot>") != std::string::npos);
  CHECK(getErrorOfLoading(directory.writeRobot("<robot name='a'/>", "")).find("no link") != std::string::npos);
  CHECK(getErrorOfLoading(directory.writeRobot("<robot name='a'><link name='b'/></robot>", "base: fixed"))
            .find("no moving joints; declare") != std::string::npos);
  CHECK(getErrorOfLoading(directory.writeRobot(kToyUrdf, "- a list")).find("document (line 1): it is not a map") !=
        std::string::npos);
  std::string deep = "<robot name='a'>";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  CHECK(getErrorOfLoading(directory.writeRobot(deep, "")).find("nested deeper") != std::string::npos);
  CHECK(getErrorOfLoading(directory.writeRobot(kToyUrdf, std::string(100000, '['))).find("robot.yaml") !=
        std::string::npos);
}

TEST_CASE("files written in xacro are refused with the way to expand them") {
  const RobotDirectory directory;
  const std::string place = directory.path();
  const std::string xacro =
      "<robot name=\"a\" xmlns:xacro=\"http://ros.org/wiki/xacro\">\n<xacro:property name=\"l\"/></robot>";
  const std::string remedy =
      "it is written in xacro, which is not expanded here; expand it and give the result: `xacro ";
  const std::string path = directory.write("leg.urdf.xacro", xacro);
  for (const std::string& given : {path, place})
    CHECK(getErrorOfLoading(given) == path + ": file: " + remedy + path + " > leg.urdf`");
  const std::string urdf = directory.write("robot.urdf", xacro);
  CHECK(getErrorOfLoading(urdf) == urdf + ": <xacro:property> (line 2): " + remedy + urdf + " > robot.expanded.urdf`");
  const std::string toy = kToyUrdf;
  CHECK(getErrorOfLoading(directory.write("robot.urdf", replaceOnce(toy, "<robot ", "<robot xmlns:xacro=\"x\" "))) ==
        "");
}

TEST_CASE("names that are not in UTF-8 are refused where they are, in every format") {
  const RobotDirectory directory;
  const std::string urdf = kToyUrdf, yaml = kToyYaml;
  const std::string mjcf = "<mujoco>\n<worldbody>\n<body name='arm'><joint name='knee'/></body></worldbody></mujoco>";
  const auto check = [](const std::string& error, const std::string& place) {
    CAPTURE(error);
    CHECK(error.compare(0, place.size(), place) == 0);
    CHECK(error.find("UTF-8") != std::string::npos);
  };
  // A letter of Latin-1, an overlong form, half a surrogate pair, a lead byte without its successors.
  for (const std::string bad : {"\xe9", "\xc0\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\xe2\x82"}) {
    check(getErrorOfLoading(directory.writeRobot(replaceOnce(urdf, "\"wrist\"", "\"wr" + bad + "st\""), yaml)),
          directory.path() + "/robot.urdf: line 30: ");
    check(getErrorOfLoading(directory.writeRobot(urdf, yaml + "# " + bad + "\n")),
          directory.path() + "/robot.yaml: line 4: ");
    check(getErrorOfLoading(directory.write("robot.xml", replaceOnce(mjcf, "knee", "kn" + bad))),
          directory.path() + "/robot.xml: line 3: ");
  }
  for (const char* good : {"\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\xa6\xb5", "&#233;"})
    CHECK(getErrorOfLoading(
              directory.writeRobot(replaceOnce(urdf, "\"wrist\"", std::string("\"") + good + "\""), yaml)) == "");
  check(getErrorOfLoading(directory.writeRobot(replaceOnce(urdf, "\"wrist\"", "\"&#xd800;\""), yaml)),
        directory.path() + "/robot.urdf: <joint> (line 30): its attribute 'name'");
}

TEST_CASE("moments of inertia that no body can have, and those of rotors without mass, are told") {
  const RobotDirectory directory;
  const auto load = [&](const char* from, const char* to) {
    return loadRobot(directory.writeRobot(replaceOnce(kToyUrdf, from, to), kToyYaml));
  };
  const LoadedRobot thin = load("ixx=\"0.01\"", "ixx=\"0.001\"");
  REQUIRE(thin.warnings.size() == 1);
  CHECK_THAT(thin.warnings[0], Catch::Contains("link 'arm': its principal moments violate the triangle inequality"));
  const auto getMoment = [](const LoadedRobot& robot) {
    return robot.model.bodies()[robot.model.findJoint("shoulder")].inertia.I_com.trace();
  };
  CHECK(getMoment(thin) == Approx(getMoment(load("<mass value=\"3\"/>", "<mass value=\"3\"/>")) - 0.009));
  const LoadedRobot rotor = load("<mass value=\"3\"/>", "<mass value=\"0\"/>");
  REQUIRE(rotor.warnings.size() == 1);
  CHECK_THAT(rotor.warnings[0],
             Catch::Contains("link 'base': it has rotational inertia but no mass: 1e-9 kg is taken"));
}

TEST_CASE("XML entities are refused for what they are") {
  const RobotDirectory directory;
  const std::string declared = "<?xml version=\"1.0\"?>\n<!DOCTYPE robot [\n<!ENTITY m \"3\">\n]>\n";
  for (const char* root : {"robot", "mujoco"}) {
    const std::string text = declared + "<" + root + " name=\"&m;\"/>";
    const std::string path = directory.write(std::string("it") + (root[0] == 'r' ? ".urdf" : ".xml"), text);
    CHECK(getErrorOfLoading(path).find(path + ": <!DOCTYPE> (line 2): it declares entities, which are not read; ") ==
          0);
  }
}

// Texts on which yaml-cpp 0.7 does so are not needed: this is what it tells then.
TEST_CASE("a YAML document that begins where the last one did is an error") {
  YamlProgress progress;
  YAML::Mark mark;
  for (mark.pos = 0; mark.pos < 3; ++mark.pos) progress.OnDocumentStart(mark);
  --mark.pos;
  CHECK_THROWS_WITH(progress.OnDocumentStart(mark), Catch::Contains("nothing can begin here"));
}

// For any bytes, loadRobot returns a model or throws a InputError.
TEST_CASE("truncated and corrupted files never do worse than a InputError") {
  const RobotDirectory directory;
  const std::string urdf = kToyUrdf, yaml = std::string(kToyYaml) + "contacts: {toe: {frame: hand, type: 6d}}\n";
  int refused = 0, tried = 0;
  const auto attempt = [&](const std::string& u, const std::string& y) {
    ++tried;
    refused += !getErrorOfLoading(directory.writeRobot(u, y)).empty();
  };
  for (size_t n = 0; n < urdf.size(); n += 3) attempt(urdf.substr(0, n), yaml);
  for (size_t n = 1; n < yaml.size(); ++n) attempt(urdf, yaml.substr(0, n));
  for (char c : {'<', '"', '\0', '&', '\xef', '-'}) {
    for (size_t i = 0; i < urdf.size(); i += 7) attempt(std::string(urdf).replace(i, 1, 1, c), yaml);
    for (size_t i = 0; i < yaml.size(); ++i) attempt(urdf, std::string(yaml).replace(i, 1, 1, c));
  }
  CHECK(refused > tried / 2);
}
