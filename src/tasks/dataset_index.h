#pragma once
/// \file The index of a data set, and its card.
#include "results/json_text.h"
#include "tasks/dataset_spec.h"

namespace bielle::tasks {

/// What became of a motion.
struct DatasetEntry {
  const DatasetMotion* motion = nullptr;
  std::string
      result;         ///< directory of its result, or of what it became when it was carried out; empty if there is none
  std::string error;  ///< of a motion that was refused
  bool converged = false, passed = false, met = false;  ///< the solver; the check; all goals
  std::string outcome;                ///< of a motion that was carried out: stood, fell, not decided or failed
  std::vector<std::string> warnings;  ///< of how it was carried out
  bool is_good() const { return converged && passed && met && outcome == (motion->carried_out ? "stood" : ""); }
  Json goals = Json::array(), planned;  ///< measured on the result; where that was carried out, also on its plan
  double duration = 0;                  ///< s, of the result
  std::vector<std::pair<std::string, std::string>> files;  ///< by format, from the directory of the data set
};

/// What a finished case has achieved. \param directory  of the case
DatasetEntry readDatasetEntry(const DatasetMotion& motion, const CaseOutcome& outcome, const std::string& directory);

/// Formats, rate, licence and the program, in one sentence each.
std::string describeDataset(const DatasetSpec& spec);

/// A line of index.jsonl.
Json describeEntry(const DatasetEntry& entry);

/// Paths are relative to the directory of the data set. \throws InputError when a file cannot be written
std::vector<std::string> writeDatasetIndex(const std::string& directory, const DatasetSpec& spec,
                                           const std::vector<DatasetEntry>& entries);

}  // namespace bielle::tasks
