#pragma once
/// \file Robots composed of parts by a file. docs/parts.md describes the format.
///
/// The parameters of a part that is mounted are those of its file and of the parts in it. Each is, in this order: what the key `set`
/// of its mounting says; a parameter or a value of the mounting file with the same name, which it shares; or a parameter of the
/// mounting file itself, with the prefix that its mounting gives.
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "formats/robot_files.h"
#include "robots/part_file.h"

namespace bielle {

class ComposedRobot {
 public:
  /// \param path   of a file with the key `tree`
  /// \param parts  by the names of parameters that choose parts: files to be among their choices
  /// \throws InputError naming file, line and remedy
  explicit ComposedRobot(const std::string& path, const std::map<std::string, std::string>& parts = {});

  const std::string& help() const { return file_->help; }
  const OptionSet& parameters() const { return parameters_; }

  /// The contents of a URDF and its YAML file, with numbers. May be called by several threads, one of which waits.
  /// \throws InputError for parameters that are possible one by one, but not together
  RobotFiles make(const OptionSet& parameters) const;

  /// Whether a part has a parameter. \param chosen  choices by the names of parameters; of others, any
  bool uses(const std::string& parameter, PartChoices chosen) const;

 private:
  mutable std::mutex mutex_;
  mutable PartLibrary library_;
  const PartFile* file_;
  OptionSet parameters_;
};

}  // namespace bielle
