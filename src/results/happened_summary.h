#pragma once
#include <string>

#include "bielle/results/result.h"
#include "results/json_text.h"

namespace bielle {

// The summary of a result of what happened, without what tells how it was solved.
Json makeHappenedSummary(const MotionResult& result);

// The summary of a plan or of what happened, then without what only plans have.
struct AnySummary {
  MotionSummary facts;
  bool has_happened = false;  // else it is a plan
};

// \throws InputError as readSummary()
AnySummary readAnySummary(const std::string& directory);

}  // namespace bielle
