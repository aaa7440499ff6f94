#pragma once
/// \file A data set in a YAML file: motions of robots, in all combinations of some of their options.
///
/// ```yaml
/// licence: CC-BY-4.0             # of the data, for its card
/// formats: [mjlab, mcap]         # of bielle export; default: mjlab
/// fps: 50                        # of references for learning; default: 50
/// isaac_lab: 3                   # the version that reads amp and beyondmimic, 2 or 3
/// motions:                       # one map or a list; each entry of a map one value or a list of them
///   - solve: walk
///     robot: [bipetto, cleobot]  # names, or paths from this file
///     payload: [0, 5]            # kg, fixed to the trunk; default: 0
///     set: {speed: [0.3, -0.3], steps: 4}
///     options: {dead-point-margin: 0.3}      # others of `bielle solve`, by their names
///     simulate: {push: ["t=1,impulse=5"]}    # carried out, too, with these options of `bielle simulate`
/// ```
#include <string>
#include <utility>
#include <vector>

#include "tasks/cases.h"
#include "tasks/dry_run.h"

namespace bielle::tasks {

struct DatasetMotion {
  std::string name;  ///< of its files: robot, motion, and what is set, e.g. bipetto_walk_speed_0.3
  std::string motion;
  std::string robot;       ///< name or path, as for the command line
  std::string robot_name;  ///< without directories
  std::string body;        ///< name of the robot with its payload, e.g. bipetto_payload_5
  double payload = 0;      ///< kg
  std::vector<std::pair<std::string, std::string>> set, options;  ///< by name, as for the command line
  bool carried_out = false;
  std::vector<std::pair<std::string, std::string>> simulate;  ///< options of `bielle simulate`, likewise
};

/// A motion to be tried before all: the options of both programs with their place in the file.
struct DatasetTrial {
  DatasetMotion motion;
  OptionEntries options, simulate;
  YamlEntry varied;  ///< what is different from the trial before it
};

struct DatasetSpec {
  std::string path, text;  ///< of the file
  std::string licence;
  std::vector<std::string> formats;
  double rate = 0;    ///< frames per second
  int isaac_lab = 0;  ///< its version; 0: not given
  std::vector<DatasetMotion> motions;
  std::vector<DatasetTrial> trials;  ///< of each entry the first motion, and those that differ from it in one value
};

/// \throws InputError naming the file, the key with its line, and the remedy; options of programs are not checked
DatasetSpec readDatasetSpec(const std::string& path);

/// Dry runs of the trials. `bielle`, `simulate`: paths of the programs; `log`: a file for their output. False if the user
/// asks for the end before they are done. \throws InputError naming the file and the option that is refused
bool checkDataset(const DatasetSpec& spec, const std::string& bielle, const std::string& simulate,
                  const std::string& log);

constexpr const char* kDatasetMotion = "motion";          ///< directory of the result of a case
constexpr const char* kDatasetExecution = "carried_out";  ///< that of the motion as it was carried out
/// `bielle solve` with its check, then `bielle simulate` if asked for. \param robot  that carries the payload
Case makeDatasetCase(const DatasetMotion& motion, const std::string& robot);

}  // namespace bielle::tasks
