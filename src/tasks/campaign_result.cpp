#include "tasks/campaign_result.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "formats/process.h"
#include "tasks/campaign.h"
#include "tasks/cases.h"

namespace bielle::tasks {
namespace {

constexpr std::size_t kLongestSummary = 4'000'000;
// Times of the processor, which differ from run to run, are not among them.
constexpr const char *kTexts[] = {"outcome", "outcome_message"},
                     *kNumbers[] = {"duration",     "distance",    "mean_speed",     "largest_deviation",
                                    "largest_slip", "largest_gap", "energy_balance", "saturated_share"};
constexpr const char* kBrokeOff = "failed";
constexpr int kNotDecided = 3;  // exit status

// JSON has no NaN: a number that is none is null, which is right only where the world broke off.
bool isNumber(const Json& value, bool broke_off) {
  return value.is_number() ? std::isfinite(value.get<double>()) : value.is_null() && broke_off;
}

Json readRunSummary(const std::string& text, int status) {
  const Json summary = parseJson(text);
  const Json result = pickCampaignResult(summary);
  const std::string outcome = result["outcome"];
  if (status != (outcome == kStood ? 0 : outcome == kUndecided ? kNotDecided : 1))
    throw std::runtime_error("its outcome is '" + outcome + "', and the exit status was " + std::to_string(status));
  return result;
}

}  // namespace

Json pickCampaignResult(const Json& summary) {
  if (!summary.is_object()) throw std::runtime_error("it is not an object");
  Json result = Json::object();
  for (const char* field : kTexts) {
    if (!summary.contains(field) || !summary[field].is_string())
      throw std::runtime_error(std::string(field) + " is not text");
    result[field] = summary[field];
  }
  const std::string outcome = result["outcome"];
  if (outcome != kStood && outcome != kFell && outcome != kUndecided && outcome != kBrokeOff)
    throw std::runtime_error("there is no outcome '" + outcome + "'");
  for (const char* field : kNumbers) {
    if (!summary.contains(field) || !isNumber(summary[field], outcome == kBrokeOff))
      throw std::runtime_error(std::string(field) + " is not a number");
    result[field] = summary[field];
  }
  return result;
}

Json readCampaignResult(const tasks::Task& task, int status) {
  const std::string error = findError(tasks::getOutput(task, task.log));
  if (status == 2 && !error.empty()) return {{"outcome", kRefused}, {"outcome_message", error}};
  if (status == 2 || status > kNotDecided || status < 0) throw std::runtime_error(describeEnd(task, status));
  try {
    return readRunSummary(tasks::readOutput(tasks::getOutput(task, "out/summary.json"), kLongestSummary), status);
  } catch (const std::exception& problem) {
    throw std::runtime_error("it returned an invalid result: " + describeJsonError(problem));
  }
}

std::vector<Json> readCampaignResults(const tasks::Task& task, int count) {
  std::vector<Json> results(static_cast<size_t>(count));
  std::string log;
  try {
    log = tasks::readOutput(tasks::getOutput(task, "out/runs.jsonl"), kLongestSummary);
  } catch (const std::exception&) {
    return results;  // it was ended before
  }
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    int run = 0;
    try {
      const Json told = parseJson(line);
      run = told.at("run");
      if (run < 1 || run > count) continue;
      Json& result = results[static_cast<size_t>(run - 1)];
      const int status = told.at("status");
      if (status == 2)
        result = {{"outcome", kRefused}, {"outcome_message", told.at("error")}};
      else
        result = readRunSummary(
            tasks::readOutput(tasks::getOutput(task, "out/" + std::to_string(run) + "/summary.json"), kLongestSummary),
            status);
    } catch (const std::exception& problem) {
      if (run > 0)
        results[static_cast<size_t>(run - 1)] = "it returned an invalid result: " + describeJsonError(problem);
    }
  }
  return results;
}

std::string describeEnd(const tasks::Task& task, int status) {
  const std::string log = describeLog(tasks::getOutput(task, task.log));
  if (status == kNotStarted) return "it could not be started" + log;
  if (status >= 128) return "terminated by signal " + std::to_string(status - 128) + log;
  return "exit status " + std::to_string(status) + log;
}

}  // namespace bielle::tasks
