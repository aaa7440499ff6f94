#pragma once
/// \file Files of parts and of robots composed of them, before they are evaluated. docs/parts.md describes the format.
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/options.h"
#include "formats/yaml_entry.h"

namespace bielle {

struct PartParameter {
  Option option;
  bool required = false;  ///< it has no value of its own: whoever mounts the part gives it
  std::string file;       ///< that declares it
};

enum class MountKind { Link, Joint };

/// A file with the key `tree`: a robot, or a part of one.
struct PartFile {
  std::string path, help;
  YamlFields fields;
  std::vector<PartParameter> parameters;                  ///< its own
  std::vector<std::string> points;                        ///< that whoever mounts it sets
  std::vector<std::pair<std::string, MountKind>> mounts;  ///< what it wants to be mounted on
  std::vector<std::pair<std::string, YamlEntry>> tree;    ///< links, and parts mounted at their place among them

  const PartParameter* findParameter(const std::string& name) const;
  bool defines(const std::string& name) const;  ///< a parameter, a point, or a value of `let`
};

/// A name with {placeholders} replaced. \throws InputError of `entry` for one that is unknown
std::string fillIn(const std::string& text, const std::map<std::string, std::string>& values, const YamlEntry& entry);

/// What choosing parameters choose.
using PartChoices = std::map<std::string, std::string>;

/// Reads each file once.
class PartLibrary {
 public:
  const PartFile& read(const std::string& path);
  /// A part by its name: a file beside that of `entry`, in `parts` of the directories of robots, or the file of a robot.
  const PartFile& find(const std::string& name, const YamlEntry& entry);

  PartChoices own_parts;  ///< files that are choices of parameters of these names, besides those that files list
  /// Of listParameters (part_parameters.h), by file and choices.
  std::map<std::pair<const PartFile*, PartChoices>, std::vector<PartParameter>> parameters;

 private:
  std::map<std::string, std::unique_ptr<PartFile>> files_;
};

}  // namespace bielle
