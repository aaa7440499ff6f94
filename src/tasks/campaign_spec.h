#pragma once
/// \file A campaign in a YAML file: motions carried out again and again, under all combinations of some conditions.
///
/// ```yaml
/// motions:
///   - walk                       # directory of a solved motion, from this file
///   - {name: quick, solve: walk, robot: bipetto, set: {speed: 0.6}}     # solved first, once;
///                                # likewise options: {dead-point-margin: 0.3}, others of `bielle solve` by their names
/// options:                       # of `bielle simulate`, by their names: one value or a list of them
///   world: [bielle, mujoco]
///   friction: [0.5, 0.7]         # true stands for an option without a value, false for none
/// push:                          # one push in every run; each entry one number or a list of them
///   time: [1.5, 1.7]             # s; or  phase: [3.5]  for half of the plan's phase 3, counted from 0
///   direction: [0, 90, 180, 270] # degrees; 0, unless given
///   duration: 0.1                # s
///   impulse: [1, 2, 3]           # N s; or
///   largest_impulse: {up_to: 8, step: 0.25}    # the largest multiple of `step` that is survived, by bisection
/// ```
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/yaml_entry.h"
#include "tasks/dry_run.h"

namespace bielle::tasks {

struct CampaignMotion {
  std::string name;
  std::string directory;           ///< of its files; empty if it has to be solved
  std::string robot;               ///< of one to be solved
  std::vector<std::string> solve;  ///< arguments of `bielle`, without the output
  OptionEntries options = {};      ///< of `bielle solve`
  std::optional<YamlEntry> entry = {};
};

/// Something that is varied, with its place in the file.
struct CampaignAxis {
  enum class Kind { Motion, Option, PushTime, PushPhase, PushDirection, PushDuration, PushImpulse };
  Kind kind;
  std::string name;                 ///< of an option without its dashes; else for tables
  std::vector<std::string> values;  ///< as they are in the file; those of pushes are numbers
  YamlEntry entry;
};

/// Bisection among the multiples of `step` up to `up_to`, N s.
struct ImpulseSearch {
  double up_to = 0, step = 0;
  int count = 0;  ///< of the multiples
};

struct CampaignSpec {
  std::string path;
  std::vector<CampaignMotion> motions;
  std::vector<CampaignAxis> axes;  ///< motion first
  std::optional<ImpulseSearch> search;
  bool pushes = false;
};

/// Adds `--name value` to a command; for true the name alone, for false nothing.
void addOption(const std::string& name, const std::string& value, std::vector<std::string>& arguments);

/// \throws InputError naming the file, the key with its line, and the remedy. Options of programs are not checked
CampaignSpec readCampaignSpec(const std::string& path);

}  // namespace bielle::tasks
