#pragma once
// What a run of a campaign returns, checked like any input: it may come from a machine that nobody here knows.
#include <string>
#include <vector>

#include "results/json_text.h"
#include "tasks/engine.h"

namespace bielle::tasks {

// The fields of a summary that are kept, in it or in a line of the log.
// \throws std::runtime_error saying which of them is not what it should be
Json pickCampaignResult(const Json& summary);

// Those of the summary of a task, or the reason for which the program refused it.
// \throws std::exception saying what is wrong, when the task failed, or its outputs are not a result of the program
Json readCampaignResult(const tasks::Task& task, int status);

// Those of each run of a task that does several (`bielle simulate --runs`), of the first on, as far as it has come: null where
// there is none, a text that says what is wrong where it is not a result.
std::vector<Json> readCampaignResults(const tasks::Task& task, int count);
// How a task ended that has no result.
std::string describeEnd(const tasks::Task& task, int status);

}  // namespace bielle::tasks
