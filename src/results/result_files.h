#pragma once
// The files of a result, for those that write another summary or read the files.
#include <string>
#include <vector>

#include "bielle/results/result.h"
#include "results/json_text.h"

namespace bielle {

// summary.json of a solved motion.
Json makeSummary(const MotionResult& result);
// Of summary.json.
Json listGoals(const std::vector<GoalOutcome>& outcomes);
// writeResult() with another summary.
std::vector<std::string> writeResult(const std::string& directory, const MotionRecord& record,
                                     const RobotText& mechanism, const Json& summary);
// summary.json alone.
void writeSummary(const std::string& directory, const Json& summary);

// The robot of a result.
constexpr const char *kMechanismUrdf = "mechanism.urdf", *kMechanismYaml = "mechanism.yaml";

// The files of a directory from which reports and other programs read a result.
std::vector<std::string> listResultFiles(const std::string& directory);

}  // namespace bielle
