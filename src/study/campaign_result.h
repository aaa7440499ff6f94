#pragma once
// What a run of a campaign returns, checked like any input: it may come from a machine that nobody here knows.
#include "io/json_text.h"
#include "tasks/engine.h"

namespace bielle::study {

// The fields of its summary that are kept, or the reason for which the program refused it.
// \throws std::exception saying what is wrong, when the task failed, or its outputs are not a result of the program
Json readCampaignResult(const tasks::Task& task, int status);

}  // namespace bielle::study
