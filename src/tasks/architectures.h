#pragma once
// A comparison of robots on the same motions: the robots, the motions, and the resulting cases.
//
// In a YAML file:
//   robots:                        # name: a robot (name, or path from this file), or a generator with its parameters
//     bipetto: {robot: bipetto}
//     cleobot: {generator: cleobot, set: {hip_height: 0.5}}
//   mass: 25.7                     # kg, of every robot, set by its trunk; omitted: unchanged
//   motions:
//     - {motion: squat, set: {depth: 0.6}}
//   speeds: {motion: walk, option: speed, from: 0.3, to: 1.0, step: 0.1}     # the largest that passes
//   groups: {hips: [hip], "knees and ankles": [knee, ankle]}     # motors by parts of their names, the first that fits
//   drives: {motor_constant: 2, regeneration: 0}                 # of all motors (design/measures.h); omitted: each robot's own
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "design/spec.h"
#include "tasks/cases.h"

namespace bielle::tasks {

struct Architecture {
  std::string name;
  RobotSpec robot;
};

// With its settings: "walk-speed-0.5".
std::string makeName(const MotionSpec& motion);

struct MotorGroup {
  std::string name;
  std::vector<std::string> words;
  std::optional<YamlEntry> entry = {};  // the list of words
};

struct ArchitectureSpec {
  std::string path, text;
  std::vector<Architecture> robots;
  double mass = 0;  // kg; 0: unchanged
  std::vector<MotionSpec> motions;
  std::vector<MotionSpec> speeds;  // slowest first; may be empty
  std::vector<double> speed_values;
  std::vector<MotorGroup> groups;  // the last one has no words: all motors
  DriveTable drives;               // without constants of single motors
};

// \throws InputError naming the file, the key with its line, and the remedy
ArchitectureSpec readArchitectureSpec(const std::string& path);

// A robot in a comparison.
struct Contender {
  std::string name, directory;  // where its files were written
  LoadedRobot robot;
  double trunk_factor = 1;  // mass and inertia of the trunk over what they were
};

// Makes the robots and writes them to directory/NAME.
// \throws InputError when there is no such robot, or its trunk cannot compensate for the mass
std::vector<Contender> makeContenders(const ArchitectureSpec& spec, const std::string& directory);

// Its result is in kMotion.
constexpr const char* kMotion = "motion";
Case makeArchitectureCase(const Contender& contender, const MotionSpec& motion);

}  // namespace bielle::tasks
