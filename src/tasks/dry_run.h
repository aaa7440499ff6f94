#pragma once
/// \file Commands that are tried before many of them run.
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "formats/yaml_entry.h"

namespace bielle::tasks {

/// What a command complains about with `--dry-run`; "" if it does not; none if the user asks for the end.
/// \param log  a file for its output   \param warnings  to which those of the command are added
std::optional<std::string> findComplaint(std::vector<std::string> command, const std::string& log,
                                         std::set<std::string>& warnings);

/// What the output of a dry run of `bielle solve` tells of its motion.
struct PlannedMotion {
  std::optional<double> end;  ///< s, unless it goes on as long as is asked
  int phases = 0;
};
PlannedMotion readPlannedMotion(const std::string& log);

/// Options of a program by their names without dashes, where a file sets them.
using OptionEntries = std::vector<std::pair<std::string, YamlEntry>>;

/// \throws InputError at the option that a complaint names first by its flag, or by its value, or else at `other`. \param command  e.g. "solve walk"
[[noreturn]] void refuse(const std::string& command, const std::string& complaint, const OptionEntries& options,
                         const YamlEntry& other);

}  // namespace bielle::tasks
