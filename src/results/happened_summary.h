#pragma once
#include "bielle/results/result.h"
#include "results/json_text.h"

namespace bielle {

// The summary of a result of what happened, without what tells how it was solved.
Json makeHappenedSummary(const MotionResult& result);

}  // namespace bielle
